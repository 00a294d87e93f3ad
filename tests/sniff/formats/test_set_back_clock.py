"""A clock that is set back while packets are written: the times go on, and it is said."""

from __future__ import annotations

import random
from collections.abc import Callable
from datetime import UTC, datetime
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


Rows = list[tuple[int, bytes]]


def as_table(path: Path, rows: Rows) -> list[Chunk | LineEvent]:
    path = path.with_suffix(".csv")
    path.write_text("time,data\n" + "".join(f"{time / NS_PER_S:.3f},{octets.hex(' ')}\n" for time, octets in rows))
    return list(read(path).items())


def as_log(path: Path, rows: Rows) -> list[Chunk | LineEvent]:
    path = path.with_suffix(".log")
    stamps = [datetime.fromtimestamp(time / NS_PER_S, UTC) for time, _ in rows]
    path.write_text(
        "".join(f"{at:%F %T.%f}Z {octets.hex(' ')}\n" for at, (_, octets) in zip(stamps, rows, strict=True))
    )
    return list(read(path).items())


Written = Callable[[Path, Rows], list[Chunk | LineEvent]]
as_written = pytest.mark.parametrize("written", [as_table, as_log])


@as_written
@pytest.mark.parametrize("back", [3, 5, 12, 3600])
def test_a_table_or_log_goes_on_where_the_clock_was_set_back(back: float, written: Written, tmp_path: Path) -> None:
    items = written(tmp_path / "x", packets(400, {200: -back}))
    (event,) = (item for item in items if isinstance(item, LineEvent))
    assert event.kind is LineEventKind.CLOCK
    told = [item for item in items if isinstance(item, Chunk)]
    assert [item.octets for item in told] == [ASKED, ANSWERED] * 200  # none came between two others
    assert told[-1].time - told[200].time == 199 * 50_000_000
    assert told[200].time > told[199].time


@as_written
@pytest.mark.parametrize("late", [0, 5])
def test_lists_of_directions_below_one_another_are_one(late: float, written: Written, tmp_path: Path) -> None:
    made = packets(400, {})
    asked, answered = made[::2], [row for row in made[1::2] if row[0] >= BEGIN + late * NS_PER_S]
    items = written(tmp_path / "x", asked + answered)
    assert [(item.time, item.octets) for item in items] == [(time, octets) for time, octets in sorted(asked + answered)]


@as_written
def test_what_a_thread_hands_over_late_lies_at_its_time(written: Written, tmp_path: Path) -> None:
    made = packets(400, {})
    late = [row for at in range(0, 400, 5) for row in (*made[at : at + 3], made[at + 4], made[at + 3])]
    assert [item.time for item in written(tmp_path / "x", late)] == [time for time, _ in made]


def test_a_program_that_was_started_anew_is_no_list_of_the_same_time(tmp_path: Path) -> None:
    made = [(time - BEGIN, octets) for time, octets in packets(40, {})]
    path = tmp_path / "x.log"
    path.write_text("".join(f"[{time / NS_PER_S:.3f}] {octets.hex(' ')}\n" for time, octets in made + made[:-5]))
    items = list(read(path).items())
    assert [item.octets for item in items if isinstance(item, Chunk)] == [octets for _, octets in made + made[:-5]]
    assert [item.time for item in items] == sorted(item.time for item in items)


def test_rows_in_another_order_are_sorted(tmp_path: Path) -> None:
    made = packets(400, {})
    mixed = random.Random(1).sample(made, len(made))
    assert [item.time for item in as_table(tmp_path / "x", mixed)] == [time for time, _ in made]
