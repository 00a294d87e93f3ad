"""Logs of serial monitors and taps: each octet once, whatever stands beside it, and when it came."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from dissectors.line import MS
from sniff.engine.capture import CaptureError
from sniff.formats import read
from sniff.formats.log_octets import octets_in
from sniff.formats.log_spellings import CONTROLS

FRAMES = [
    bytes.fromhex(pairs)
    for pairs in (
        "0903002100029489",
        "0903047263240F6409",  # pairs of nothing but digits among others
        "09030C200009224F",
        "09030AFF725135447F5935",
        "0903002100029489",
        "090304003C3A20E0A4",  # < and : among the characters
    )
]


def way(number: int) -> str:
    return "Host   -->" if number % 2 == 0 else "Device -->"


def braced(octet: int) -> str:
    """As WaveForms shows a character."""
    return chr(octet) if 0x20 < octet < 0x7F else f"{{h{octet:02X}}}"


IDLE = "drive.exe IRP_MJ_READ Serial0 TIMEOUT Length 0: "


def took(number: int, octets: bytes) -> str:
    """As Portmon does."""
    lasted, what = (391, "WRITE") if number % 2 == 0 else (1551789, "READ")
    return f"7 0.0{lasted:07d} drive.exe IRP_MJ_{what} Serial0 SUCCESS Length {len(octets)}: {octets.hex(' ').upper()} "


def apart(octets: bytes) -> str:
    return octets.hex(" ").replace(" ", "  ").upper()


def sign(octet: int) -> bytes:
    """As slsnif shows a character."""
    name = [*CONTROLS, "SPACE"][octet] if octet < 33 else "DEL" if octet == 127 else ""
    return f"<{name}>".encode() if name else bytes((octet,))


def lines(written: Callable[[int, bytes], str | bytes]) -> bytes:
    made = (written(number, frame) for number, frame in enumerate(FRAMES))
    return b"\n".join(line.encode() if isinstance(line, str) else line for line in made) + b"\n"


def dump(octets: bytes) -> str:
    return f"        {octets.hex(' '):<48}  {''.join(chr(one) if 32 <= one < 127 else '.' for one in octets)}\t"


def numbered(form: str) -> Callable[[int, bytes], bytes]:
    return lambda number, frame: (
        b"\n%s " % way(number).encode() + b" ".join(sign(octet) + f" ({octet:{form}})".encode() for octet in frame)
    )


IRP = ("IRP_MJ_WRITE - Request transfers data from a client", "IRP_MJ_READ - Transfers data from a COM port")
SHAPES: dict[str, tuple[bytes, int | None]] = {  # what is in the log, and ns from the first read to the second
    "two spaces between pairs": (
        lines(lambda number, frame: f"[RTU]>{'TR'[number % 2]}x > 10:00:{number:02d}:100 - {apart(frame)}  "),
        1000 * MS,
    ),
    "short numbers behind &H": (lines(lambda _, frame: "Tx: " + ",".join(f"&H{one:X}" for one in frame)), None),
    "characters and decimals": (lines(numbered("03d")), None),
    "characters and pairs": (lines(numbered("02x")), None),
    "zone in a column of its own": (
        lines(
            lambda number, frame: (
                f"2024-11-28 10:00:{number:02d}.100  +11:00\n    {('Transmit', 'Receive')[number % 2]} PORT1 Length"
                f" {len(frame)}\n{dump(frame)}"
            )
        ),
        1000 * MS,
    ),
    "seconds behind a decoder's name": (
        lines(lambda number, frame: f"uart_packet-1: {number + 0.25:8.3f} {'TR'[number % 2]}X: {frame.hex(' ')}"),
        1000 * MS,
    ),
    "how the check went": (
        lines(
            lambda number, frame: (
                f"DATE=2024-11-28T10:00:{number:02d}.100;ERR={('NO', 'CRC')[number == 4]};FRAME={frame.hex('-')};"
            )
        ),
        1000 * MS,
    ),
    "two blocks under what a monitor says": (
        b"[18/08/2026 16:31:40]\t\n33\tIRP_MJ_DEVICE_CONTROL - Request operates a serial port (COM5)\t\n"
        b"    STATUS_SUCCESS\t\n        IOCTL_SERIAL_SET_DTR - Request sets DTR\t\n" * 5
        + b"".join(
            f"[18/08/2026 16:31:4{number}]\t\n{number + 40}\t{said}\t\n    STATUS_SUCCESS\t\n{dump(frame)}\n".encode()
            for number, (said, frame) in enumerate(zip(IRP, FRAMES[:2], strict=True), 1)
        ),
        1000 * MS,
    ),
    "a date before @": (
        lines(lambda number, frame: f"28/12/2022@22:43:{number:02d}.100::>>COM5 Sent\n{frame.hex('|')}| | | || . ."),
        1000 * MS,
    ),
    "hexadecimal among characters in braces": (
        lines(lambda number, frame: f"{number}: " + "".join(map(braced, frame))),
        None,
    ),
    "h ahead of each": (
        lines(lambda number, frame: f"10:00:{number:02d}.100," + " ".join(f"h{one:02X}" for one in frame)),
        1000 * MS,
    ),
    "how long each request took": (lines(lambda number, frame: f"{took(number, frame)}\n9 0.00000391 {IDLE}"), None),
    "an octet behind <": (
        b"".join(b"2022-09-29 22:43:36.4%d4 <%02x\n" % (at % 10, one) for at, one in enumerate(FRAMES[0][:8])),
        10 * MS,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SHAPES)
def test_every_octet_once(name: str, tmp_path: Path) -> None:
    log, apart = SHAPES[name]
    path = tmp_path / "x.log"
    path.write_bytes(log)
    capture = read(path)
    chunks = [item for item in capture.items() if isinstance(item, Chunk)]
    octets = b"".join(chunk.octets for chunk in chunks)
    assert octets
    assert octets in (b"".join(FRAMES), b"".join(FRAMES[:2]), FRAMES[0])
    assert capture.completeness().whole
    assert ("@" in name) <= (chunks[0].time > 10**18)
    if apart is not None:
        assert chunks[1].time - chunks[0].time == pytest.approx(apart, abs=2)


def test_octets_above_the_first_time_came_right_before_it(tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    path.write_text(
        "09 03 02 FF 7F 59 35\n"
        "2026/05/11 13:17:34.792 port write 8\n\n09 03 00 21 00 02 94 89\n"
        "2026/05/11 13:17:34.821 port read 9\n\n09 03 04 72 63 24 0F 64 09\n"
    )
    capture = read(path)
    chunks = [item for item in capture.items() if isinstance(item, Chunk)]
    assert [len(chunk.octets) for chunk in chunks] == [7, 8, 9]
    assert 0 < chunks[1].time - chunks[0].time < 50 * MS
    assert capture.session.started == chunks[0].time
    assert chunks[2].time - chunks[1].time == 29 * MS


def test_decoded_fields_of_a_monitor_are_no_octets(tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    field = (
        "[18/09/2023 09:17:1{}]\nModbus Response (COM11)\nAddress: 1\n    Values: 00 {}0 04 b2\nChecksum: 0x7931 - OK\n"
    )
    path.write_text("\n".join(field.format(second, second) for second in range(5)))
    with pytest.raises(CaptureError, match="dump view"):
        read(path)


def test_an_octet_that_says_its_base_counts_before_its_decimal() -> None:
    run = octets_in("> | 0x5e | 94 | |")
    assert run is not None
    assert run.octets == b"\x5e"


def test_durations_are_no_times(tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    path.write_bytes(SHAPES["how long each request took"][0])
    assert not read(path).session.has_times


def test_what_a_tool_tells_in_two_spellings_is_told_once(tmp_path: Path) -> None:
    pieces = [b":0105", b"0", b"000FF00FB\r\n"] * 3
    path = tmp_path / "x.log"
    told = "  modbus-serial { action: 'receive',\n  modbus-serial   data: <Buffer %s>,\n"
    again = '  modbus-serial {"action":"receive","data":{"type":"Buffer","data":%s}} +1ms\n'
    path.write_text("".join(told % piece.hex(" ") + again % json.dumps(list(piece)) for piece in pieces))
    capture = read(path)
    assert b"".join(item.octets for item in capture.items() if isinstance(item, Chunk)) == b"".join(pieces)
    assert capture.completeness().whole


def test_lists_of_a_tool_are_decimal_though_they_may_be_pairs(tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    path.write_text('{"action":"send","data":{"type":"Buffer","data":[58,48,49,48,51,70,67,13,10]}}\n' * 3)
    assert read(path).session.sample[0].octets.startswith(b":0103FC\r\n")
