"""FT 1.2, which begins and ends its frames as PROFIBUS does, is taken for it by no search."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from dissectors.profibus.neighbours import FT12, neighbour
from sniff.analysis.autodetect import Detecting
from sniff.analysis.other_settings import other_protocol
from sniff.analysis.told_protocol import Sureness, told_by
from sniff.formats import read

CAPTURES = Path(__file__).parents[3] / "captures"
LINE = LineSettings.parse("9600,8E1")


def long(octets: bytes) -> bytes:
    return bytes((0x68, len(octets), len(octets), 0x68)) + octets + bytes((sum(octets) & 0xFF, 0x16))


def fixed(*octets: int) -> bytes:
    return bytes((0x10, *octets, sum(octets) & 0xFF, 0x16))


def polled(upper: bytes = b"") -> list[bytes]:
    """Stations that are polled, and send measured values; `upper`: of an address with two octets."""
    draw = random.Random(7)
    frames = []
    for number in range(30):
        station = 1 + number % 3
        frames.append(fixed(0x7B if number % 2 else 0x5B, station, *upper))
        values = bytes(draw.randrange(256) for _ in range(9))
        frames.append(long(bytes((0x08, station, *upper, 0x0D, 1, 3, station)) + values))
    return frames


METERS = [frame for number in range(8) for frame in (fixed(0x40, number), b"\xe5", fixed(0x5B, number))]


@pytest.mark.parametrize("frames", [polled(), polled(b"\0"), METERS], ids=["one octet", "two octets", "meters"])
def test_they_are_told(frames: list[bytes]) -> None:
    assert neighbour(b"".join(frames)) == FT12


@pytest.mark.parametrize("name", ["profibus-clean", "profibus-noisy-ftdi", "profibus-usual-faults"])
def test_a_bus_of_its_own_has_none(name: str) -> None:
    chunks = [item for item in read(CAPTURES / f"{name}.cap.txt").items() if isinstance(item, Chunk)]
    assert neighbour(b"".join(chunk.octets for chunk in chunks)) == ""


def test_what_a_long_telegram_carries_is_none() -> None:
    carried = fixed(0x5B, 1) * 4
    assert neighbour(long(b"\x83\x82\x5d" + carried) * 5) == ""


def test_no_search_takes_them_for_telegrams(tmp_path: Path) -> None:
    frames = polled()
    path = tmp_path / "x.log"
    path.write_text("".join(f"10:00:{number:02d}.100 RX: {frame.hex(' ')}\n" for number, frame in enumerate(frames)))
    told = told_by(read(path).session)
    assert told.sureness is Sureness.NO
    assert FT12 in told.words
    chunks = [Chunk(number * 100_000_000, frame) for number, frame in enumerate(frames, 1)]
    named = other_protocol(chunks, LINE, 0, "modbus-rtu")
    assert named is not None
    assert named.means == f"somebody speaks {FT12}"
    search = Detecting((LINE,), ("profibus",))
    for chunk in chunks:
        search.feed(chunk)
    assert search.found is None


def test_zeros_among_other_octets_are_no_packets_of_a_network(tmp_path: Path) -> None:
    draw = random.Random(3)
    path = tmp_path / "x.log"
    rows = (
        long(b"\x08\x02\x72" + bytes(draw.choice((0, 0, 4, draw.randrange(256))) for _ in range(120))) for _ in "1234"
    )
    path.write_text("".join(f"RECV (126): {row.hex(' ')}\n" for row in rows))
    assert told_by(read(path).session).sureness is Sureness.NO
