"""Byte logs of other tools: every kind is told and read; real ones of logic analysers too."""

from __future__ import annotations

import contextlib
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dissectors.frame import Chunk, Frame, LineError, Mark
from dissectors.line import NS_PER_S, LineSettings
from sniff.bus.offline import settled
from sniff.engine.capture import CaptureError
from sniff.engine.session import LineEvent, LineEventKind, with_settings
from sniff.formats import bytelog, read, table_reads
from tests.seeds import examples

REQUEST, ANSWER = bytes.fromhex("010300000002C40B"), bytes.fromhex("01030400D7001ACBC0")
CHAR = LineSettings.parse("19200,8E1").char
DAY = 1_139_833_427  # 2006-02-13T12:23:47Z

LOGS = {
    "candump": "(1139833427.100000) bus 01 03 00 00 00 02 C4 0B\n(1139833427.110000) bus 1#01030400D7001ACBC0\n",
    "Docklight": (
        "2/13/2006 12:23:47.100 [TX] - 01 03 00 00 00 02 C4 0B \n"
        "13.02.2006 12:23:47.110 [RX] - 01 03 04 00 D7 00 1A CB C0\n"
    ),
    "jpnevulator": (
        "2006-02-13 12:23:47.100000: /dev/ttyS0\n01 03 00 00 00 02 C4 0B                          ........\n"
        "2006-02-13 12:23:47.110000: /dev/ttyS0\n01 03 04 00 D7 00                                ......\n1A CB C0\n"
    ),
    "times and pairs": (
        "# a note\n0.100000 01 03 00 00 00 02 c4 0b ; request\n0.110000 01 03 04 00 d7 00 1a cb c0 ; answer\n"
    ),
    "clock and pairs": (
        "[12:23:47.100] TX: 01 03 00 00 00 02 C4 0B\n2006-02-13 12:23:47,110 << 01 03 04 00 D7 00 1A CB C0\n"
    ),
    "pairs": "; from the terminal program\n01 03 00 00 00 02 C4 0B\n0x01, 0x03, 0x04, 0x00, 0xD7, 0x00, 0x1A,\nCBC0\n",
    "hexdump": (
        "00000000  01 03 00 00 00 02 c4 0b  01 03 04 00 d7 00 1a cb  |................|\n00000010  c0  |.|\n00000011\n"
    ),
}


KINDS = {"times and pairs": "times and pairs", "clock and pairs": "times, directions and pairs"}


@pytest.mark.parametrize("kind", LOGS)
def test_every_kind_is_told_and_read(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    path.write_text(LOGS[kind])
    log = read(path)
    chunks = [item for item in log.items() if isinstance(item, Chunk)]
    assert KINDS.get(kind, kind) in log.completeness().text
    assert b"".join(chunk.octets for chunk in chunks) == REQUEST + ANSWER
    assert "not understood" not in log.completeness().text
    if kind == "clock and pairs":
        assert chunks[0].time == ((12 * 60 + 23) * 60 + 47) * 10**9 + 100_000_000  # no date: of no day
        assert chunks[1].time == DAY * 10**9 + 110_000_000
    elif kind not in ("hexdump", "pairs"):
        assert chunks[1].time - chunks[0].time == 10_000_000
    if kind in {"candump", "Docklight", "jpnevulator"}:
        assert chunks[0].time == DAY * 10**9 + 100_000_000
    frames = [item.row.event for item in settled(chunks, log.session)]
    assert [frame.octets for frame in frames] == [REQUEST, ANSWER]
    assert all(isinstance(frame, Frame) and frame.ok for frame in frames)


def test_candump_as_it_prints_to_a_terminal(tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    path.write_text(" (1139833427.100000)  can0  123   [8]  01 03 00 00 00 02 C4 0B\n")
    (chunk,) = read(path).items()
    assert chunk == Chunk(DAY * 10**9 + 100_000_000, REQUEST)


@pytest.mark.parametrize(
    ("table", "first", "second"),
    [
        (
            "Time [s],Value,Parity Error,Framing Error\n-0.5,0x01,,\n1e-3,'A' (0x41),Error,\n",
            Chunk(CHAR, b"\x01"),  # counted from a trigger: no time is before 1970
            Chunk(501_000_000 + CHAR, b"A", (Mark(0, LineError.PARITY),)),
        ),
        (
            'name,type,start_time,duration,"data",error\nA,data,0.5,0.0005,0x01,\nA,data,0.6,0.0005,0x03,framing\n',
            Chunk(500_500_000, b"\x01"),
            Chunk(600_500_000, b"\x03", (Mark(0, LineError.FRAMING),)),
        ),
        (
            "time,hex\n0.5,01 03 00\n0.25,0x02 0x03\n",
            Chunk(250_000_000, b"\x02\x03"),
            Chunk(500_000_000, b"\x01\x03\0"),
        ),
    ],
    ids=["Saleae Logic 1", "Saleae Logic 2", "ends only"],
)
def test_tables_of_other_programs(table: str, first: Chunk, second: Chunk, tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text(table)
    log = read(path)
    assert list(log.items()) == [first, second]
    assert log.completeness().whole


def test_only_a_begin_on_the_line_is_an_exact_time(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text("start,octet\n0.5,01\n")
    assert read(path).session.adapter.latency == 0
    path.write_text("time,octet\n0.5,01\n")
    assert read(path).session.adapter.latency > 0
    path.write_text(f"start,data\n0.5,{REQUEST.hex(' ')}\n0.6,{ANSWER.hex(' ')}\n")  # frames, as programs list them
    assert read(path).session.adapter.latency > 0


@pytest.mark.parametrize("step", [0, 4_000_000])
def test_rows_that_tell_their_begin_stay_in_order(step: int, tmp_path: Path) -> None:
    """Also where the clock is coarse, or the line faster than is assumed: what is longer did not end later."""
    reads = [bytes(200), REQUEST, bytes(100), ANSWER]
    begins = [at // 2 * NS_PER_S + at % 2 * step for at in range(len(reads))]
    rows = [f"{begin / NS_PER_S:.3f},{octets.hex(' ')}\n" for begin, octets in zip(begins, reads, strict=True)]
    path = tmp_path / "x.csv"
    path.write_text("Time [s],Data\n" + "".join(rows))
    found = [item for item in read(path).items() if isinstance(item, Chunk)]
    assert [chunk.octets for chunk in found] == reads
    times = [chunk.time for chunk in found]
    assert times == sorted(set(times))


@pytest.mark.parametrize("heading", ["Time", "Time [s]"])
def test_a_table_whose_newest_row_is_the_first(heading: str, tmp_path: Path) -> None:
    """What has the same time was listed the other way round, too."""
    rows = [f"{at},{octets.hex(' ')}\n" for at in range(9) for octets in (REQUEST, ANSWER)]
    path = tmp_path / "x.csv"
    path.write_text(f"{heading},Data\n{''.join(rows[::-1])}")
    assert [item.octets for item in read(path).items() if isinstance(item, Chunk)] == [REQUEST, ANSWER] * 9


def test_a_log_whose_newest_line_is_the_first_is_refused(tmp_path: Path) -> None:
    lines = [f"2026-03-01 10:00:{at:02d} {octets.hex(' ')}\n" for at in range(30) for octets in (REQUEST, ANSWER)]
    path = tmp_path / "x.log"
    path.write_text("".join(lines[::-1]))
    with pytest.raises(CaptureError, match="newest first"):
        read(path)


def test_xxd_is_a_hexdump_too(tmp_path: Path) -> None:
    path = tmp_path / "x.hex"
    path.write_text("00000000: 0103 0000 0002 c40b  ........\n")
    assert [item.octets for item in read(path).items() if isinstance(item, Chunk)] == [REQUEST]


@pytest.mark.parametrize("octal", [False, True])
def test_rows_that_a_dump_leaves_out(octal: bool, tmp_path: Path) -> None:
    """However many places it leaves out rows in that are as the one above."""
    octets = (bytes(range(16)) + bytes(64)) * 9
    rows = [octets[at : at + 16] for at in range(0, len(octets), 16)]
    lines = []
    for number, row in enumerate(rows):
        if number and row == rows[number - 1]:
            lines += ["*"] * (lines[-1] != "*")
        else:
            cells = " ".join(f"{one:03o}" if octal else f"{one:02x}" for one in row)
            lines.append(f"{16 * number:07o} {cells}" if octal else f"{16 * number:08x}  {cells}")
    path = tmp_path / "x.txt"
    path.write_text("\n".join([*lines, f"{len(octets):07o}" if octal else f"{len(octets):08x}", ""]))
    log = read(path)
    assert b"".join(item.octets for item in log.items() if isinstance(item, Chunk)) == octets
    assert log.completeness().whole


def test_more_rows_left_out_than_are_read_are_counted(tmp_path: Path) -> None:
    path = tmp_path / "x.txt"
    path.write_text(f"00000000  {'00 ' * 16}\n*\n00100000  {'01 ' * 16}\n00100010  02\n")
    items = list(read(path).items())
    given = sum(len(item.octets) for item in items if isinstance(item, Chunk))
    (lost,) = [item for item in items if isinstance(item, LineEvent)]
    assert (lost.kind, given + lost.count) == (LineEventKind.DROPPED, 0x100011)


def test_the_last_digit_of_a_number_with_a_power_is_its_clock(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text("Time [s],Data\n" + "".join(f"{100 + at / 2:.3E},01 03 00 00 00 02 C4 0B\n" for at in range(9)))
    assert read(path).session.adapter.latency == 100_000_000


def test_what_is_no_byte_log_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    path.write_text("\n# mine\nDear diary,\ntoday nothing happened.\n")
    with pytest.raises(CaptureError, match=r"x\.log:3: no byte log .* lines of pairs"):
        read(path)


@pytest.mark.parametrize(
    ("name", "line", "count"),
    [
        ("sigrok-flowmeter-graph_tool", "9600,8N1", 18),
        ("sigrok-flowmeter-target_0liter_per_min", "9600,8N1", 112),
        ("sigrok-flowmeter-target_20liter_per_min", "9600,8N1", 66),
        ("sigrok-brainchild-io16do", "19200,8E1", 30),
    ],
)
def test_logic_analyser_csv_of_others(name: str, line: str, count: int) -> None:
    path = Path(__file__).parents[4] / "shared/captures" / name / "octets.csv"
    if not path.exists():
        pytest.skip("shared captures are not here")
    log = read(path)
    session = with_settings(log.session, "modbus-rtu", LineSettings.parse(line))
    rows = [item.row.event for item in settled(log.items(), session)]
    assert len(rows) == count
    assert all(isinstance(row, Frame) and row.ok for row in rows)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=examples(200))
@given(kind=st.sampled_from(sorted(LOGS)), place=st.floats(0, 0.999), text=st.text(max_size=3), cut=st.floats(0, 1))
def test_any_change_is_no_traceback(tmp_path: Path, kind: str, place: float, text: str, cut: float) -> None:
    whole = LOGS[kind]
    at = int(place * len(whole))
    path = tmp_path / "x.log"
    changed = whole[:at] + text + whole[at + 1 :]
    path.write_text(changed[: int(cut * len(changed))], encoding="utf-8", errors="replace")
    try:
        log = read(path)
    except CaptureError:
        return
    assert all(isinstance(item, Chunk) for item in log.items())


def test_a_table_too_long_for_memory_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "long.csv"
    path.write_text("time,data\n" + "".join(f"0.{number:03},01\n" for number in range(50)))
    monkeypatch.setattr(table_reads, "MOST_ROWS", 50)
    assert len(list(bytelog.read(path).items())) == 50
    monkeypatch.setattr(table_reads, "MOST_ROWS", 49)
    with pytest.raises(CaptureError, match="over 49 rows; cut it into pieces"):
        bytelog.read(path)


@pytest.mark.parametrize("time", ["1e999999", "-9e999999", "9e999999999", "1e-999999", "nan", "-inf"])
@pytest.mark.parametrize("heading", ["Time [s],Channel 0", "time,data", "a,b", "Time [s],Value,Parity Error"])
def test_times_of_tables_that_no_clock_tells(heading: str, time: str, tmp_path: Path) -> None:
    rows = [f"0.{at:03},{at % 2}" for at in range(40)]
    rows[20:20] = [f"{time},1", f"{time.replace('-', '')},1", f"-{time.replace('-', '')},0"]
    path = tmp_path / "x.csv"
    path.write_text("\n".join([heading, *rows]))
    with contextlib.suppress(CaptureError):
        list(read(path).items())
