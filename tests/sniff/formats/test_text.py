"""Text captures: what is written by hand is read, what is wrong is named with its place, the writer is canonical."""

from __future__ import annotations

from pathlib import Path

import pytest

from dissectors.frame import Chunk, LineError, Mark
from dissectors.line import LineSettings
from sniff.bus.capture_writer import create
from sniff.engine.capture import CaptureError
from sniff.engine.session import Adapter, Item, LineEvent, LineEventKind, Session
from sniff.formats import read
from sniff.formats.text import LONGEST_LINE, parse, render
from sniff.formats.text_line import Line, plain_chunk

P, F, B, O = LineError.PARITY, LineError.FRAMING, LineError.BREAK, LineError.OVERRUN  # noqa: E741
START = 1_772_359_200_000_000_000  # 2026-03-01T10:00:00Z
PLAIN = "+-.0123456789abcdefABCDEF \t"
MS = 1_000_000

BY_HAND = """\
#!sniff-capture 1
# line: 19200,8E1
# protocol: modbus-rtu
# start: 2026-03-01T10:00:00Z
+0        01 03 00 00 00 02 C4 0B       # poll unit 1
+8.2      01 03 04 00 D7 00!P 1A CB C0  # parity error marked on one octet
~4.1      00!B                          # a break, 4.1 ms of silence before it
+250      ":010300000002FA" 0D 0A       # quoted ASCII
"""


def items(lines: str, header: str = "# line: 19200,8E1\n") -> list[Item]:
    return list(parse(f"{header}{lines}").items())


def test_the_capture_of_the_design() -> None:
    capture = parse(BY_HAND)
    assert capture.session == Session("", LineSettings(19200, 8, "E", 1), "modbus-rtu", START, program="")
    break_at = START + 8_200_000 + 4_100_000 + 11 * 1_000_000_000 // 19200
    assert list(capture.items()) == [
        Chunk(START, bytes.fromhex("010300000002C40B")),
        Chunk(START + 8_200_000, bytes.fromhex("01030400D7001ACBC0"), (Mark(5, P),)),
        Chunk(break_at, b"\0", (Mark(0, B),)),
        Chunk(break_at + 250 * MS, b":010300000002FA\r\n"),
    ]
    assert capture.completeness().whole


@pytest.mark.parametrize(
    ("line", "chunk"),
    [
        ("+0 01", Chunk(0, b"\x01")),
        ("  +0\t01", Chunk(0, b"\x01")),
        ("+0 c40b", Chunk(0, b"\xc4\x0b")),
        ("+0 C40B 0d", Chunk(0, b"\xc4\x0b\x0d")),
        ("+0 01#no space", Chunk(0, b"\x01")),
        ("+0.000001 01", Chunk(1, b"\x01")),
        ("+1.5 01", Chunk(1_500_000, b"\x01")),
        ("-1.5 01", Chunk(-1_500_000, b"\x01")),
        ("+0 01 !P", Chunk(0, b"\x01", (Mark(0, P),))),
        ("+0 01!p!f", Chunk(0, b"\x01", (Mark(0, P | F),))),
        ("+0 01!PF 02!O!B", Chunk(0, b"\x01\x02", (Mark(0, P | F), Mark(1, O | B)))),
        ("+0 0102!P", Chunk(0, b"\x01\x02", (Mark(1, P),))),
        ('+0 ":A#"!P 0D', Chunk(0, b":A#\r", (Mark(2, P),))),
        ('+0 "a""b"', Chunk(0, b"ab")),
        (r'+0 "\"\\\r\n\x00\xfF"', Chunk(0, b'"\\\r\n\x00\xff')),
        ("~0 01 02", Chunk(2 * 11 * 1_000_000_000 // 19200, b"\x01\x02")),
        ("~1 01", Chunk(1_000_000 + 11 * 1_000_000_000 // 19200, b"\x01")),
    ],
)
def test_lenient(line: str, chunk: Chunk) -> None:
    assert items(line) == [chunk]


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_line_ends_and_blank_lines(end: str, tmp_path: Path) -> None:
    path = tmp_path / "a.cap.txt"
    text = end.join(["# line: 9600", "", "  # comment: 1 2", "+1 01", "   ", "+2 02"])
    path.write_bytes(b"\xef\xbb\xbf" + text.encode())
    assert list(read(path).items()) == [Chunk(MS, b"\x01"), Chunk(3 * MS, b"\x02")] == list(parse(text).items())


def test_silence_follows_a_change_of_speed() -> None:
    found = items('~0 01\n#! +0 settings line=9600,8N1 protocol=n2\n~0 "A"\n#! +0 settings line=fast\n~0 "B"')
    chunks = [item for item in found if isinstance(item, Chunk)]
    slow = 10 * 1_000_000_000 // 9600
    assert [chunk.time - chunks[0].time for chunk in chunks] == [0, slow, 2 * slow]


@pytest.mark.parametrize(
    ("line", "event"),
    [
        ("#! +12.5 unplugged", LineEvent(12_500_000, LineEventKind.UNPLUGGED)),
        ("#!replugged", LineEvent(0, LineEventKind.REPLUGGED)),
        ("#! -1 clock count=-5", LineEvent(-MS, LineEventKind.CLOCK, "", -5)),
        ("#! +0 Dropped count=7 host too busy # yes", LineEvent(0, LineEventKind.DROPPED, "host too busy # yes", 7)),
        ('#! +0 note "a\\nb"', LineEvent(0, LineEventKind.NOTE, "a\nb")),
        ('#! +0 note "count=3"', LineEvent(0, LineEventKind.NOTE, "count=3")),
        ("#! +0 settings line=9600,8N1", LineEvent(0, LineEventKind.SETTINGS, "line=9600,8N1")),
    ],
)
def test_events(line: str, event: LineEvent) -> None:
    assert items(line) == [event]


def test_events_do_not_move_the_chunks() -> None:
    with_event = items("+1 01\n#! +500 unplugged\n+1 02")
    assert [item for item in with_event if isinstance(item, Chunk)] == items("+1 01\n# +500 unplugged\n+1 02")
    assert with_event[1].time == 501 * MS


@pytest.mark.parametrize(
    ("text", "place", "said"),
    [
        ("01 03", "1:1", "+D, ~D or -D"),
        ("+ 01", "1:1", "+D, ~D or -D"),
        ("+1.1234567 01", "1:1", "at most six decimals"),
        ("+1.5", "1:5", "octets such as 01 03"),
        ("+1 # nothing", "1:4", "octets such as 01 03"),
        ("+1 01 3", "1:7", "pairs of hexadecimal digits"),
        ("+1 01 0x03", "1:7", "pairs of hexadecimal digits"),
        ("+1 010", "1:4", "pairs of hexadecimal digits"),
        ("+1 zz", "1:4", "pairs of hexadecimal digits"),
        ("\n\n  +1 01 gg", "3:9", "found 'gg'"),
        ("+1 !P 01", "1:4", "an octet before the mark"),
        ("+1 01!X", "1:6", "!P (parity), !F (framing)"),
        ('+1 "abc', "1:4", "ASCII in quotes"),
        ('+1 "ä"', "1:4", "ASCII in quotes"),
        ('+1 ""', "1:4", "ASCII in quotes"),
        (r'+1 "\q"', "1:4", "ASCII in quotes"),
        ("~1 01", "1:1", "# line: 19200,8E1"),
        ("# line: 19200,9X1\n+1 01", "1:9", "line settings such as"),
        ("# start: yesterday", "1:10", "a time with a zone"),
        ("# start: 2026-02-30T10:00:00Z", "1:10", "a time with a zone"),
        ("# start: 2026-02-03T10:00:00", "1:10", "a time with a zone"),
        ("# start: 9999-02-03T10:00:00Z", "1:10", "before the year 2262"),
        ("# latency: -4", "1:12", "milliseconds"),
        ('# port: "half', "1:9", "a JSON string"),
        ("# device: pump", "1:11", "ADDRESS=PROFILE such as 3=teco-e510"),
        ("# device: 256=teco-e510", "1:11", "ADDRESS 0 … 255"),
        ("# device: 3=../secret", "1:11", "ADDRESS=PROFILE"),
        ("#!sniff-capture 2", "1:16", "version 1"),
        ("#!sniff-capture", "1:16", "version 1"),
        ("#! +1 exploded", "1:7", "one of unplugged, replugged"),
        ("#! +1.2.3 note", "1:4", "at most six decimals"),
        ("#! +1", "1:1", "'#! +D KIND count=N text'"),
        ("#! +1 note:x", "1:11", "a space"),
        ("+999999999999999 01", "1:1", "before the year 2262"),
    ],
)
def test_bad_lines_are_named(text: str, place: str, said: str) -> None:
    with pytest.raises(CaptureError) as caught:
        list(parse(text, "a.cap.txt").items())
    message = str(caught.value)
    assert message.startswith(f"a.cap.txt:{place}: expected ")
    assert said in message
    assert "\n" not in message


SESSION = Session(
    "/dev/ttyUSB0",
    LineSettings(38400, 7, "O", 2),
    "mstp",
    START + 123_456_789,
    "boiler-room",
    Adapter("FTDI FT232R", "ftdi_sio", 16_000_001, "read from the driver", ("parity", "break"), "one\nflag", "A5"),
    "sniff485 0.1.0",
    {"profile 3": "teco-e510", 'a: "b"': "  spaces ", "empty": ""},
)

CANONICAL = r"""#!sniff-capture 1
# line: 38400,7O2
# protocol: mstp
# start: 2026-03-01T10:00:00.123456789Z
# port: /dev/ttyUSB0
# bus: boiler-room
# program: sniff485 0.1.0
# adapter: FTDI FT232R
# driver: ftdi_sio
# latency: 16.000001
# latency-from: read from the driver
# reports: parity,break
# detail: "one\nflag"
# serial-number: A5
# note profile 3: teco-e510
# note "a: \"b\"": "  spaces "
# note empty: ""
+0        01 0A!P!F FF
#! +12.5 dropped count=-1 "\u001b[31m"
-0.000001 00!B
"""


def test_devices_have_lines_of_their_own() -> None:
    text = "# protocol: modbus-rtu\n"
    text += "# device: 3=teco-e510\n#device:  0x10=acme_7 , *=teco-f510\n# note devices: 9=old\n# note site: a\n+0 01\n"
    session = parse(text).session
    assert session.notes == {"devices": "3=teco-e510,0x10=acme_7,*=teco-f510,9=old", "site": "a"}
    lines = render(session, []).splitlines()
    assert lines[4:] == [
        "# device: 3=teco-e510",
        "# device: 0x10=acme_7",
        "# device: *=teco-f510",
        "# device: 9=old",
        "# note site: a",
    ]
    assert parse("\n".join(lines)).session == session


@pytest.mark.parametrize("note", ["", "3", "3=a b", "3=teco-e510,", " 3=teco-e510", "300=teco-e510", "3=\x1b[m"])
def test_a_note_that_is_no_list_of_devices_stays_a_note(note: str) -> None:
    session = Session("", LineSettings(), "modbus-rtu", program="", notes={"devices": note})
    text = render(session, [])
    assert "# device:" not in text
    assert parse(text).session == session


def test_no_more_devices_than_addresses() -> None:
    session = parse("# device: 3=teco-e510\n" * 5000).session
    assert session.notes["devices"].count(",") < 300


def test_the_canonical_form(tmp_path: Path) -> None:
    given: list[Item] = [
        Chunk(SESSION.started, b"\x01\n\xff", (Mark(1, P | F),)),
        LineEvent(SESSION.started + 12_500_000, LineEventKind.DROPPED, "\x1b[31m", -1),
        Chunk(SESSION.started - 1, b"\0", (Mark(0, B),)),
    ]
    assert render(SESSION, given) == CANONICAL
    path = tmp_path / "a.cap.txt"
    with create(path, SESSION) as writer:
        for item in given:
            writer.write(item)
    assert path.read_bytes() == CANONICAL.encode()
    assert read(path).session == SESSION
    assert list(read(path).items()) == given


def test_what_cannot_be_kept_is_said() -> None:
    given = [Chunk(0, b""), Chunk(5, b"\x01", (Mark(1, P), Mark(0, LineError(0))))]
    text = render(Session("", LineSettings(), "n2"), given)
    assert text.count("# not kept: ") == 2
    assert list(parse(text).items()) == [Chunk(5, b"\x01")]


def test_files_that_are_none(tmp_path: Path) -> None:
    path = tmp_path / "a.cap.txt"
    path.touch()
    with pytest.raises(CaptureError, match="empty file"):
        read(path)
    path.write_bytes("#!sniff-capture 1\n".encode("utf-16"))
    with pytest.raises(CaptureError, match="save it as UTF-8"):
        read(path)
    path.write_bytes(b"# " + bytes(LONGEST_LINE))
    with pytest.raises(CaptureError, match="a line longer than"):
        read(path)
    path.write_bytes(b"\x89MCAP0\r\n" + bytes(100))
    with pytest.raises(CaptureError, match="an MCAP file, but not a recording"):
        list(read(path).items())
    with pytest.raises(CaptureError, match="a directory"):
        read(tmp_path.rename(tmp_path.with_name("d.cap.txt")))


def test_a_failed_conversion_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "a.cap.txt"
    path.write_text("+0 01\n")

    def convert() -> None:
        with create(path, SESSION) as writer:
            writer.write(Chunk(0, b"\x02"))
            raise RuntimeError

    with pytest.raises(RuntimeError):
        convert()
    assert path.read_text() == "+0 01\n"
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.cap.txt"]


def test_a_capture_can_be_converted_onto_itself(tmp_path: Path) -> None:
    path = tmp_path / "a.cap.txt"
    path.write_text("+0 01\n+5 02\n")
    capture = read(path)
    with create(path, capture.session) as writer:
        for item in capture.items():
            writer.write(item)
    assert list(read(path).items()) == [Chunk(0, b"\x01"), Chunk(5 * MS, b"\x02")]


def test_a_file_that_cannot_be_created(tmp_path: Path) -> None:
    with pytest.raises(CaptureError, match="no such directory"):
        create(tmp_path / "none" / "a.cap.txt", SESSION)
    (tmp_path / "d.cap.txt").mkdir()
    with pytest.raises(CaptureError, match="a directory"):
        create(tmp_path / "d.cap.txt", SESSION)


@pytest.mark.parametrize(
    "line",
    [
        "+8.2 01 03 04", "-8.000001 0103 04", "+0\t01\t0304   # a comment", "+1.5 01 03#next", "+1 0103 04 # 7 é",
        "+99999999999999 01 03", "-3 01 03", "+1 01 0", "+1 01 0G", "+1.1234567 01", "+1.5.2 01", "~4 01", "+1 01!P",
        '+1 01 "a"', "+1", "+1 # 01", "+ 1 01", "+1  01\x0b02", "+1\u00a001",
    ],
)  # fmt: skip
def test_a_plain_line_is_what_a_closer_look_finds(line: str) -> None:
    plain = plain_chunk(line, START)
    try:
        closer = Line("x", 1, line).chunk(START, LineSettings())
    except CaptureError:
        closer = None
    assert plain in (None, closer)
    assert (plain is None) == (closer is None or bool(closer.marks) or not set(line.partition("#")[0]) <= set(PLAIN))
