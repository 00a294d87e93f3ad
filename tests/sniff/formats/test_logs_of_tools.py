"""Logs of tools by name: every frame, every octet once, nothing left that was not understood, no option given."""

from __future__ import annotations

from pathlib import Path

import pytest

from dissectors.frame import Chunk, Frame
from sniff.analysis.told_protocol import detected
from sniff.bus.offline import settled
from sniff.engine.capture import CaptureError
from sniff.formats import read
from tests.seeds import IS_SEARCH
from tests.sniff.formats.written_anew import write_anew

LOGS = Path(__file__).parents[3] / "captures" / "logs"
NAMES = sorted(path.name for path in LOGS.iterdir() if path.suffix not in (".frames", ".md"))


def frames_of(log: Path) -> list[bytes]:
    return [bytes.fromhex(line) for line in log.with_suffix(".frames").read_text().splitlines()]


@pytest.mark.parametrize("name", NAMES)
def test_logs_of_tools(name: str) -> None:
    capture = read(LOGS / name)
    items = list(capture.items())
    expected = frames_of(LOGS / name)
    assert b"".join(item.octets for item in items if isinstance(item, Chunk)) == b"".join(expected)
    events = [item.row.event for item in settled(items, detected(capture.session))]
    assert [event.octets for event in events] == expected
    assert all(isinstance(event, Frame) and event.ok for event in events)
    assert capture.completeness().whole, capture.completeness().text


def test_a_windows_log_of_two_octets_a_character(tmp_path: Path) -> None:
    text = (LOGS / "qmodmaster.log").read_text()
    path = tmp_path / "x.log"
    write_anew(path, text.replace("\n", "\r\n").encode("utf-16"))
    assert list(read(path).items()) == list(read(LOGS / "qmodmaster.log").items())


def test_a_log_goes_on_after_midnight(tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    path.write_text("23:59:59.900 TX 01 03 00 00 00 02 C4 0B\n00:00:00.100 RX 01 03 04 00 D7 00 1A CB C0\n")
    first, second = (item.time for item in read(path).items())
    assert second - first == 200_000_000


def test_much_that_is_not_understood_is_an_error_when_all_else_was_given(tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    path.write_text("TX: 01 03 00 00 00 02 C4 0B\n" + "RX: 01 03 04 00 D7 00 1A CB C\n" * 3)
    items = read(path).items()
    assert next(items)
    with pytest.raises(CaptureError, match=r":2: 3 lines were not understood"):
        next(items)


@pytest.mark.parametrize(
    "text",
    [
        "Let it be\nand the cafe was closed\n",
        "total 12 of 345, see page 10\nchapter 20\n",
        "GET /index.html 200 5120\n",
        "The feed added 3 bad beef\n" * 5,
    ],
)
def test_prose_is_no_log(text: str, tmp_path: Path) -> None:
    path = tmp_path / "x.txt"
    path.write_text(text)
    with pytest.raises(CaptureError, match="no byte log"):
        read(path)


@pytest.mark.parametrize("name", NAMES)
def test_logs_cut_anywhere(name: str, tmp_path: Path) -> None:
    whole = (LOGS / name).read_bytes()
    expected = b"".join(frames_of(LOGS / name))
    path = tmp_path / name
    cuts = min(12 if IS_SEARCH else 3, max(3, 30_000 // len(whole)))
    for end in range(0, len(whole), max(1, len(whole) // cuts)):
        write_anew(path, whole[:end])
        try:
            heard = b"".join(item.octets for item in read(path).items() if isinstance(item, Chunk))
        except CaptureError as error:
            assert "\n" not in str(error)  # noqa: PT017
        else:
            assert len(heard) <= len(expected) + 2


@pytest.mark.parametrize("way", ["", "10:00:00.100 RX: "])
@pytest.mark.parametrize("between", [" ", "", ", "])
def test_a_whole_capture_on_one_line(way: str, between: str, tmp_path: Path) -> None:
    heard = b"".join(frames_of(LOGS / "qmodmaster.log")) * 200
    path = tmp_path / "x.log"
    path.write_text(way + between.join(f"{octet:02X}" for octet in heard) + "\n")
    chunks = [item for item in read(path).items() if isinstance(item, Chunk)]
    assert b"".join(chunk.octets for chunk in chunks) == heard
    assert max(len(chunk.octets) for chunk in chunks) < 20_000


@pytest.mark.parametrize(
    "form",
    [
        "0x{0:02X} (0b{0:08b})",
        "0b{0:08b} (0x{0:02x})",
        "0x{0:02x} ({0})",
        "0x{0:02X}(0b{0:08b})",
        "{0:02X} ({0})",
        "{0:02X}h ({0})",
        "0x{0:02X} '.'",
        "{0:02X}('.')",
        "0x{0:02X}/{0:03d}",
        "{0:02X}[{0:08b}]",
        "0x{0:X} ({0})",
    ],
)
def test_an_octet_that_is_written_twice_is_one(form: str, tmp_path: Path) -> None:
    heard = bytes.fromhex("010300100002C5CE")
    path = tmp_path / "x.log"
    path.write_text("".join(f">>> {', '.join(form.format(octet) for octet in heard)}\n" for _ in range(4)))
    assert b"".join(item.octets for item in read(path).items() if isinstance(item, Chunk)) == heard * 4
