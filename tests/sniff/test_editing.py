"""File work: cut, merged, compared, recovered and anonymised captures keep what they must."""

from __future__ import annotations

import json
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest

from dissectors.checksums import crc16_modbus
from dissectors.frame import Chunk, Frame
from dissectors.line import LineSettings
from dissectors.pseudonyms import Blanks
from sniff.bus.capture_writer import create
from sniff.bus.offline import settled
from sniff.editing.anonymising import anonymised, anonymous_session
from sniff.editing.cutting import parse_time
from sniff.editing.merging import merged, merged_session
from sniff.engine.session import Item, LineEvent, Session, with_settings
from sniff.formats import read
from sniff.formats.text import parse
from sniff.simulation.scenarios import scenario, simulate
from sniff.testing.capture_reading import read_capture
from tests.seeds import some

OURS = Path(__file__).parents[2] / "captures"
CAPTURES = sorted(OURS.glob("*.cap.txt"))


@pytest.fixture
def sniff485(capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str, str]]:
    from sniff.cli import main

    def run(*arguments: object) -> tuple[int, str, str]:
        code = main([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return run


def octets(items: list[Item]) -> bytes:
    return b"".join(item.octets for item in items if isinstance(item, Chunk))


def shape(session: Session, items: list[Item]) -> list[tuple[object, ...]]:
    """What anonymising must not change."""
    return [
        (item.row.event.start, item.row.event.end, len(item.row.event.octets), isinstance(item.row.event, Frame),
         isinstance(item.row.event, Frame) and item.row.event.ok, item.row.header.kind if item.row.header else None,
         item.transaction.verdict if item.transaction else None)
        for item in settled(items, session)
    ]  # fmt: skip


@pytest.mark.parametrize("path", some(CAPTURES, 2), ids=lambda path: path.name)
def test_anonymising_keeps_frames_times_checks_and_verdicts(path: Path) -> None:
    capture = read(path)
    before = list(capture.items())
    after = list(anonymised(before, capture.session))
    assert shape(capture.session, after) == shape(capture.session, before)
    assert [item.time for item in after] == [item.time for item in before]
    assert [getattr(item, "marks", ()) for item in after] == [getattr(item, "marks", ()) for item in before]


@pytest.mark.parametrize("name", ["modbus-rtu", "modbus-ascii", "n2", "mstp"])
def test_anonymising_renumbers_stations_one_for_one(name: str) -> None:
    session, made = simulate(scenario(name, faults=False), 3)
    items = list(made)
    names = [
        (item.row.header.source, item.row.header.destination)
        for capture in (items, list(anonymised(items, session)))
        for item in settled(capture, session)
        if item.row.header is not None
    ]
    half = len(names) // 2
    pairs = {(a, b) for old, new in zip(names[:half], names[half:], strict=True) for a, b in zip(old, new, strict=True)}
    assert len({a for a, _ in pairs}) == len({b for _, b in pairs}) == len(pairs)


def test_no_name_survives(tmp_path: Path, sniff485: Callable[..., tuple[int, str, str]]) -> None:
    from dissectors.bacnet.envelope import frame as mstp
    from dissectors.modbus.envelope import make_rtu as modbus_rtu

    secret = b"BOILER ROOM 7"
    answer = modbus_rtu(9, b"\x11" + bytes([len(secret) + 1]) + secret + b"\xff")
    i_have = b"\x01\x00\x10\x01" + b"\xc4\x02\x00\x04\xd2" + b"\xc4\x02\x00\x04\xd2" + b"\x75\x0e\x00" + secret
    for protocol, line, frame in (("modbus-rtu", "19200,8E1", answer), ("mstp", "38400,8N1", mstp(6, 255, 5, i_have))):
        path, out = tmp_path / f"{protocol}.cap.txt", tmp_path / f"{protocol}.mcap"
        path.write_text(
            f"#!sniff-capture 1\n# line: {line}\n# protocol: {protocol}\n# port: /dev/boiler\n+0 {frame.hex()}\n"
        )
        assert sniff485("anonymise", path, "-o", out)[0] == 0
        assert secret not in out.read_bytes()
        assert b"boiler" not in out.read_bytes()
        (row,) = read_capture(out).frames
        assert isinstance(row.event, Frame)
        assert row.event.ok
        assert b"\x04\xd2" not in row.event.octets
        assert secret not in octets(list(read(out).items()))


def test_no_name_survives_in_events_of_the_line() -> None:
    """A port that was unplugged is named by its path, which has the adapter's serial number."""
    text = (
        "# line: 19200,8E1\n+0 01 03 00 00 00 02 C4 0B\n"
        "#! +1 unplugged /dev/serial/by-id/usb-ACME_7 is gone\n"
        "#! +2 note boiler room 7\n"
        "#! +3 errors count=2 parity\n"
        "#! +3 errors count=2 boiler\n"
        "#! +4 dropped count=9 boiler\n"
        "#! +5 settings line=9600,8N1 protocol=boiler room\n"
    )
    capture = parse(text)
    events = [item for item in anonymised(capture.items(), capture.session) if isinstance(item, LineEvent)]
    assert [(event.kind.value, event.count, event.text) for event in events] == [
        ("unplugged", 0, ""),
        ("note", 0, ""),
        ("errors", 2, "parity"),
        ("errors", 2, ""),
        ("dropped", 9, ""),
        ("settings", 0, "line=9600,8N1"),
    ]


def test_known_devices_stay_known_under_their_new_addresses() -> None:
    text = "# line: 19200,8E1\n# device: 40=teco-e510\n# device: 7=acme-pump\n# device: *=teco-f510\n"
    capture = parse(text + "+0 28 03 25 21 00 01 D8 F5\n+20 28 03 02 00 11 25 8E\n")
    session = anonymous_session(capture.session)
    assert session.notes == {"devices": "1=teco-e510,*=teco-f510"}
    chunks = [item for item in anonymised(capture.items(), capture.session) if isinstance(item, Chunk)]
    assert {chunk.octets[0] for chunk in chunks} == {1}


def test_session_without_names() -> None:
    session = read(CAPTURES[0]).session
    assert anonymous_session(session).port == "anonymised"
    assert anonymous_session(session).timing == session.timing


def test_parts_of_a_cut_merge_to_the_whole(tmp_path: Path, sniff485: Callable[..., tuple[int, str, str]]) -> None:
    whole = OURS / "rtu-usual-faults.cap.txt"
    first, second, both = (tmp_path / f"{name}.mcap" for name in ("first", "second", "both"))
    assert sniff485("cut", whole, "-o", first, "--to", "+5.5")[0] == 0
    assert sniff485("cut", whole, "-o", second, "--from", "+5.500000001")[0] == 0
    assert sniff485("merge", second, first, "-o", both)[0] == 0
    assert list(read(both).items()) == list(read(whole).items())


def test_what_two_captures_share_is_merged_once() -> None:
    header = "# line: 19200,8E1\n# start: 2026-03-01T10:00:00Z\n"
    first = parse(header + "+0 01\n+0 01\n+5 02\n#! +0 note a\n+5 03\n")
    second = parse(header + "+5 02\n#! +0 note a\n+5 04\n+0 03\n+5 01\n")
    start = first.session.started
    assert [(item.time - start) // 1_000_000 for item in merged([first, second])] == [0, 0, 5, 5, 10, 10, 15]
    assert octets(list(merged([first, second]))) == b"\1\1\2\3\4\1"
    assert list(merged([first, first, first])) == list(first.items())


@pytest.mark.parametrize(
    ("times", "holes"),
    [
        ([(0, 9000)], []),
        ([(0, 9000), (4000, 4500)], []),
        ([(8000,), (0, 3000)], [8000]),
        ([(500,), (0,)], []),
        ([(0,), (2000, 9000), (19000, 19500)], [2000, 19000]),
    ],
    ids=["within one", "one goes on", "apart", "one after the other", "twice"],
)
def test_between_captures_nobody_listened(times: list[tuple[int, ...]], holes: list[int]) -> None:
    head = "# line: 19200,8E1\n# start: 2026-03-01T10:00:00Z\n"
    captures = [
        parse(head + "".join(f"+{time - before} 01\n" for before, time in pairwise((0, *one)))) for one in times
    ]
    events = [item for item in merged(captures) if isinstance(item, LineEvent)]
    start = captures[0].session.started
    assert [(item.time - start) // 1_000_000 for item in events] == holes
    assert all(item.kind.is_hole for item in events)


def test_cut_by_frames_gives_these_frames(tmp_path: Path, sniff485: Callable[..., tuple[int, str, str]]) -> None:
    whole, part = OURS / "rtu-usual-faults.cap.txt", tmp_path / "part.mcap"
    rows = [json.loads(line) for line in sniff485("show", "--json", whole)[1].splitlines()]
    assert sniff485("cut", whole, "-o", part, "--frames", "21-30")[0] == 0
    cut = [json.loads(line) for line in sniff485("show", "--json", part)[1].splitlines()]
    assert [row["hex"] for row in cut] == [row["hex"] for row in rows[20:30]]


def test_cut_around_a_finding_holds_its_evidence(tmp_path: Path, sniff485: Callable[..., tuple[int, str, str]]) -> None:
    whole, part = OURS / "rtu-usual-faults.cap.txt", tmp_path / "part.mcap"
    assert sniff485("cut", whole, "-o", part, "--around", "mb008")[0] == 0
    assert any(finding.code == "MB008" for finding in read_capture(part).findings)
    assert len(read_capture(part).rows) < len(read_capture(whole).rows)


def test_a_margin_may_be_nothing(tmp_path: Path, sniff485: Callable[..., tuple[int, str, str]]) -> None:
    whole, part = OURS / "rtu-usual-faults.cap.txt", tmp_path / "part.mcap"
    assert sniff485("cut", whole, "-o", part, "--around", "MB008", "--margin", "0s")[0] == 0
    assert len(read_capture(part).rows) < 5


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--around", "ZZ1"], "there are: "),
        (["--frames", "7000-8000"], "none of them"),
        (["--frames", "x"], "12-40"),
        (["--from", "noon"], "+12.5"),
        ([], "say what to keep"),
        (["--frames", "1", "--around", "MB008"], "say what to keep"),
    ],
)
def test_a_cut_that_means_nothing_is_explained(
    tmp_path: Path, arguments: list[str], said: str, sniff485: Callable[..., tuple[int, str, str]]
) -> None:
    code, _, err = sniff485("cut", OURS / "rtu-usual-faults.cap.txt", "-o", tmp_path / "x.mcap", *arguments)
    assert code == 2
    assert said in err


@pytest.mark.parametrize("turned", [False, True])
def test_the_worst_adapter_stays_the_worst_in_any_order(turned: bool, tmp_path: Path) -> None:
    """Where the other one is inferred from its reads, which are coarse here."""
    head = "#!sniff-capture 1\n# line: 19200,8E1\n# protocol: modbus-rtu\n# start: 2026-03-01T10:00:00Z\n"
    reads = "+20 01 03 00 00 00 02 C4 0B\n" * 20
    paths = [tmp_path / "coarse.cap.txt", tmp_path / "told.cap.txt"]
    for path, told in zip(paths, ("", "# latency: 50\n# latency-from: told\n"), strict=True):
        path.write_text(head + told + reads)
    captures = [read(path) for path in (paths[::-1] if turned else paths)]
    assert sorted(capture.session.adapter.latency for capture in captures) == [1_000_000, 50_000_000]
    session = with_settings(merged_session(captures, ["one", "other"]))
    assert (session.adapter.latency, session.adapter.latency_from) == (50_000_000, "told")


def test_captures_of_different_buses_are_not_merged(
    tmp_path: Path, sniff485: Callable[..., tuple[int, str, str]]
) -> None:
    code, _, err = sniff485("merge", OURS / "rtu-clean.cap.txt", OURS / "n2-clean.cap.txt", "-o", tmp_path / "x.mcap")
    assert code == 3
    assert "n2 9600,8N1" in err


@pytest.mark.parametrize("path", some(CAPTURES, 2), ids=lambda path: path.name)
def test_redissect_of_an_untouched_capture_changes_nothing(
    tmp_path: Path, path: Path, sniff485: Callable[..., tuple[int, str, str]]
) -> None:
    out, again = tmp_path / "out.mcap", tmp_path / "again.mcap"
    assert sniff485("redissect", path, "-o", out)[0] == 0
    assert sniff485("redissect", out, "-o", again)[0] == 0
    assert list(read(out).items()) == list(read(path).items())
    assert out.read_bytes() == again.read_bytes()


def test_a_recovered_recording_is_whole_and_says_what_was_lost(
    tmp_path: Path, sniff485: Callable[..., tuple[int, str, str]]
) -> None:
    source, cut, out = tmp_path / "a.mcap", tmp_path / "cut.mcap", tmp_path / "out.mcap"
    assert sniff485("convert", OURS / "rtu-usual-faults.cap.txt", source)[0] == 0
    cut.write_bytes(source.read_bytes()[:-1500])
    code, _, err = sniff485("recover", cut, "-o", out)
    assert code == 0
    assert "cut" in err
    recovered = read(out)
    items = list(recovered.items())
    assert recovered.completeness().whole
    assert octets(list(read(source).items())).startswith(octets(items))
    assert "recovered" in recovered.session.notes


@pytest.mark.parametrize("name", ["ms-tp-forbidden-address", "ms-tp-number-is-taken", "rtu-address-250"])
def test_anonymising_keeps_findings(name: str, tmp_path: Path, sniff485: Callable[..., tuple[int, str, str]]) -> None:
    """What is forbidden to one class of addresses, and texts that differ: both must still be so."""
    path, out = OURS / "findings" / f"{name}.cap.txt", tmp_path / "nobody.cap.txt"
    assert sniff485("anonymise", path, "-o", out)[0] == 0

    def codes(of: Path) -> list[tuple[str, str]]:
        found = [json.loads(line) for line in sniff485("check", "--json", of)[1].splitlines()]
        return [(one["code"], one["severity"]) for one in found if "code" in one]

    assert codes(out) == codes(path)
    assert codes(out)


def test_equal_texts_stay_equal_and_others_stay_others() -> None:
    blanks = Blanks()
    texts = [b"Boiler room", b"Pump cellar", b"Boiler room", b"roof"]
    assert [blanks.of(text) for text in texts] == [b"x" * 11, b"x" * 10 + b"a", b"x" * 11, b"xxxx"]
    many = [blanks.of(b"%08d" % number) for number in range(2_000)]
    assert len(set(many)) == 2_000
    assert {len(each) for each in many} == {8}


def test_diff_of_a_capture_with_itself_is_silent(sniff485: Callable[..., tuple[int, str, str]]) -> None:
    path = OURS / "rtu-usual-faults.cap.txt"
    assert sniff485("diff", path, path)[:2] == (0, "no difference worth saying\n")


def test_diff_names_the_station_that_went_bad(sniff485: Callable[..., tuple[int, str, str]]) -> None:
    code, out, _ = sniff485("diff", "--json", OURS / "rtu-clean.cap.txt", OURS / "rtu-early-release.cap.txt")
    found = [json.loads(line) for line in out.splitlines()]
    assert code == 1
    assert any(one["subject"] == "station 2" and one["what"] == "MB006" for one in found)
    assert not any(one["subject"] == "station 1" and "response" in one["what"] for one in found)


def test_diff_of_other_protocols_and_rates_says_so_first(sniff485: Callable[..., tuple[int, str, str]]) -> None:
    out = sniff485("diff", "--json", OURS / "rtu-clean.cap.txt", OURS / "mstp-clean.cap.txt")[1]
    first, second, *_ = [json.loads(line) for line in out.splitlines()]
    assert (first["what"], first["before"], first["after"]) == ("protocol", "Modbus RTU", "BACnet MS/TP")
    assert (second["what"], second["before"], second["after"]) == ("line settings", "19200,8E1", "38400,8N1")


def test_a_blanked_name_is_no_other_name(tmp_path: Path, sniff485: Callable[..., tuple[int, str, str]]) -> None:
    whole, part = OURS / "devices/bacnet-three-objects.cap.txt", tmp_path / "part.cap.txt"
    assert sniff485("anonymise", whole, "-o", part)[0] == 0

    def found(path: Path) -> list[str]:
        return [json.loads(line)["code"] for line in sniff485("check", "--json", path)[1].splitlines()]

    assert found(part) == found(whole)


def polled(path: Path, values: list[tuple[int, int]]) -> Path:
    """A capture in which unit 1 tells its registers 2523h and 2524h, again and again."""
    lines = ["#!sniff-capture 1", "# line: 9600,8N1", "# protocol: modbus-rtu", "# device: 1=teco-e510"]
    for first, second in values:
        request = bytes.fromhex("010325230002")
        answer = bytes.fromhex("010304") + first.to_bytes(2, "big") + second.to_bytes(2, "big")
        lines += [f"+{gap} {(each + crc16_modbus(each).to_bytes(2, 'little')).hex(' ')}"
                  for gap, each in ((200, request), (20, answer))]  # fmt: skip
    path.write_text("\n".join(lines) + "\n")
    return path


def test_diff_tells_values_that_moved_for_good(tmp_path: Path, sniff485: Callable[..., tuple[int, str, str]]) -> None:
    before = polled(tmp_path / "before.cap.txt", [(6000, 5990), (6000, 6010), (6000, 5000)])
    after = polled(tmp_path / "after.cap.txt", [(5000, 5500), (5000, 4000), (5000, 4500)])
    code, out, _ = sniff485("diff", "--json", before, after)
    assert code == 1
    assert [json.loads(line) for line in out.splitlines()] == [
        {"subject": "station 1", "what": "frequency-command", "before": "60.00 Hz", "after": "50.00 Hz"}
    ]
    assert sniff485("diff", "--json", before, before)[0] == 0
    code, out, _ = sniff485("diff", "--json", before, after, "-d", "1=automationdirect-acn")
    assert [json.loads(line)["before"] for line in out.splitlines()] == ["6000"]
    far = polled(tmp_path / "far.cap.txt", [(6000, 1000), (6000, 1200)])
    assert "50.00 … 60.10 Hz" in sniff485("diff", before, far)[1]
    assert "10.00 … 12.00 Hz" in sniff485("diff", before, far)[1]


def test_a_target_that_is_a_source_is_refused(tmp_path: Path, sniff485: Callable[..., tuple[int, str, str]]) -> None:
    path = tmp_path / "a.mcap"
    with create(path, read(CAPTURES[0]).session):
        pass
    before = path.read_bytes()
    assert sniff485("convert", "-f", path, path)[0] == 2
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    ("text", "after"),
    [
        ("12.5", 12.5),
        ("+90s", 90),
        ("1.5 ms", 0.0015),
        ("2m", 120),
        ("1h", 3600),
        ("10:00", -5),
        ("10:00:07.25", 2.25),
        ("02:00:00", 16 * 3600 - 5),  # of the next day
        ("23:00:00", 13 * 3600 - 5),
        ("2026-03-01T10:00:06Z", 1),
        ("2026-03-01T11:00:06+01:00", 1),
    ],
)
def test_times_as_people_write_them(text: str, after: float) -> None:
    session = Session("x", LineSettings.parse("19200,8E1"), "modbus-rtu", started=1772359205 * 10**9)
    assert parse_time(text, session) - session.started == round(after * 10**9)


@pytest.mark.parametrize(
    ("text", "time"),
    [
        ("2026-03-01T10:00:03.766123456Z", 1_772_359_203_766_123_456),  # as `show --json` has it
        ("2026-03-01T12:00:03,766123456+02:00", 1_772_359_203_766_123_456),
        ("20260301T100003.766123456Z", 1_772_359_203_766_123_456),
        ("2026-03-01 10:00:03", 1_772_359_203_000_000_000),
        ("1969-12-31T23:59:59.5Z", -500_000_000),
        ("1969-12-31", -86_400_000_000_000),
    ],
)
def test_a_date_and_time_is_exact(text: str, time: int) -> None:
    assert parse_time(text, Session("x", LineSettings.parse("19200,8E1"), "modbus-rtu")) == time


@pytest.mark.parametrize("text", ["24:00", "10:60", "noon", "-3", "10 parsecs"])
def test_what_is_no_time(text: str) -> None:
    with pytest.raises(ValueError, match=r"expected seconds from the start \(\+12.5\)"):
        parse_time(text, Session("x", LineSettings.parse("19200,8E1"), "modbus-rtu"))
