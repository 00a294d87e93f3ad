"""A clock that is set back while packets are written: the times go on, and it is said."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from dissectors.line import NS_PER_S
from dissectors.modbus.envelope import seal_rtu
from sniff.engine.blocks import Block, blocks_of
from sniff.engine.session import LineEvent, LineEventKind
from sniff.formats import read
from tests.sniff.formats.packets_made import as_pcap

ASKED, ANSWERED = seal_rtu(b"\1\3\0\0\0\2"), seal_rtu(b"\1\3\4\0\1\0\2")
BEGIN = 1_772_359_200 * NS_PER_S


def packets(count: int, steps: dict[int, float]) -> list[tuple[int, bytes]]:
    """A packet each 50 ms; `steps`: s by which the clock is changed before a packet."""
    shift, made = 0, []
    for number in range(count):
        shift += round(steps.get(number, 0) * NS_PER_S)
        made.append((BEGIN + number * 50_000_000 + shift, ANSWERED if number % 2 else ASKED))
    return made


def spread(blocks) -> list[tuple[int, bytes] | LineEvent]:
    return [
        (one.time, one.octets) if not isinstance(one, LineEvent) else one
        for block in blocks
        for one in (block.chunks() if isinstance(block, Block) else (block,))
    ]


def test_times_go_on_where_the_clock_was_set_back(tmp_path: Path) -> None:
    capture = read(as_pcap(tmp_path / "x.pcap", packets(40, {20: -5}), 147))
    items = list(capture.items())
    (event,) = (item for item in items if isinstance(item, LineEvent))
    assert (event.kind, event.text) == (LineEventKind.CLOCK, "the file's clock goes back by 4.95 s")
    times = [item.time for item in items]
    assert times == sorted(times)
    assert times[-1] - times[0] < 2.1 * NS_PER_S
    assert times[-1] - times[-11] == 10 * 50_000_000


def test_one_packet_that_came_too_late_into_the_file_moves_no_other(tmp_path: Path) -> None:
    made = packets(40, {20: -5, 21: 5})
    items = list(read(as_pcap(tmp_path / "x.pcap", made, 147)).items())
    assert [item.time for item in items][-19:] == [time for time, _ in made][-19:]


@pytest.mark.parametrize("seed", range(12))
def test_columns_tell_the_same(seed: int, tmp_path: Path) -> None:
    dice = random.Random(seed)
    steps = {dice.randrange(400): dice.choice([-0.5, -1, -3, -3600, 2, 40]) for _ in range(dice.choice([0, 1, 2, 9]))}
    capture = read(as_pcap(tmp_path / "x.pcap", packets(400, steps), 147))
    assert spread(capture.blocks()) == spread(blocks_of(capture.items()))


def as_table(path: Path, rows: list[tuple[int, bytes]]) -> list[Chunk | LineEvent]:
    path.write_text("time,data\n" + "".join(f"{time / NS_PER_S:.3f},{octets.hex(' ')}\n" for time, octets in rows))
    return list(read(path).items())


@pytest.mark.parametrize("back", [3, 5, 12, 3600])
def test_a_table_goes_on_where_the_clock_was_set_back(back: float, tmp_path: Path) -> None:
    items = as_table(tmp_path / "x.csv", packets(400, {200: -back}))
    (event,) = (item for item in items if isinstance(item, LineEvent))
    assert event.kind is LineEventKind.CLOCK
    told = [item for item in items if isinstance(item, Chunk)]
    assert [item.octets for item in told] == [ASKED, ANSWERED] * 200  # none came between two others
    assert told[-1].time - told[200].time == 199 * 50_000_000
    assert told[200].time > told[199].time


@pytest.mark.parametrize("late", [0, 5])
def test_lists_of_directions_below_one_another_are_one(late: float, tmp_path: Path) -> None:
    made = packets(400, {})
    asked, answered = made[::2], [row for row in made[1::2] if row[0] >= BEGIN + late * NS_PER_S]
    items = as_table(tmp_path / "x.csv", asked + answered)
    assert [(item.time, item.octets) for item in items] == [(time, octets) for time, octets in sorted(asked + answered)]


def test_rows_in_another_order_are_sorted(tmp_path: Path) -> None:
    made = packets(400, {})
    mixed = random.Random(1).sample(made, len(made))
    assert [item.time for item in as_table(tmp_path / "x.csv", mixed)] == [time for time, _ in made]
