"""A packet file of a slow bus is read at the rate that its packets show."""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from dissectors.line import MS, LineSettings, Timing
from sniff.formats import read
from sniff.formats.packet_rate import slower_line
from tests.sniff.formats.packets_made import Packet, as_pcap, as_pcapng

MSTP = 165
"""Link type."""

USUAL = LineSettings.parse("38400,8N1")


def chunks(baud: int, seed: int = 0, *, least: float = 2, most: float = 30, longest: int = 500) -> list[Chunk]:
    """Packets of all lengths, each so many ms at least and most behind the one before."""
    dice, char, now = random.Random(seed), Timing(LineSettings(baud)).char, 10**18
    made = []
    for _ in range(300):
        count = dice.choice([8, 8, 8, 29, dice.randint(8, longest)])
        now += round(dice.uniform(least, most) * MS) + count * char
        made.append(Chunk(now, bytes(count)))
    return made


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("baud", [9600, 19200])
def test_the_rate_of_a_slow_bus(baud: int, seed: int) -> None:
    assert slower_line(chunks(baud, seed), USUAL) == LineSettings.parse(f"{baud},8N1")


@pytest.mark.parametrize("write", [as_pcap, as_pcapng])
def test_a_packet_file_of_another_program_is_read_at_that_rate(
    write: Callable[[Path, Sequence[Packet], int], Path], tmp_path: Path
) -> None:
    capture = read(write(tmp_path / "slow", [(one.time, one.octets) for one in chunks(9600)], MSTP))
    assert (capture.session.line, capture.session.line_is_assumed) == (LineSettings.parse("9600,8N1"), True)


@pytest.mark.parametrize(
    "heard",
    [
        chunks(38400),
        chunks(115200),
        chunks(38400, least=120, most=400),  # all wait long
        chunks(9600, longest=40),  # nothing long
        [Chunk(10**18, bytes(100))] * 50,  # no times
        [],
    ],
)
def test_what_shows_no_slower_rate(heard: list[Chunk]) -> None:
    assert slower_line(heard, USUAL) is None
