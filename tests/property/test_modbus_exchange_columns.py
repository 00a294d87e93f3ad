"""Regular exchanges by columns held against the tracker: placements, transactions, and what it remembers of them."""

from __future__ import annotations

import random
from copy import deepcopy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dissectors.columns import NONE, ROLES, FrameColumns, PlacementColumns, TransactionColumns
from dissectors.frame import Chunk, Event, Frame
from dissectors.line import LineSettings, Timing
from dissectors.modbus import RTU
from dissectors.modbus.envelope import readable_adu
from dissectors.modbus.exchange import Exchange, Seen
from dissectors.modbus.exchange_columns import ExchangeColumns, exchanges, placed
from dissectors.modbus.exchange_memory import heard, holding, outlives, passed
from dissectors.modbus.tracker import ModbusTracker
from dissectors.modbus.tracker_memory import PassedBy
from dissectors.tracker import Placement, Transaction
from sniff import formats
from tests.bench import bulk_rtu
from tests.bus_delivery import FTDI_LATENCY, MS, ftdi, laid_out
from tests.property.kernel_equality import events_of, frame_at, reads_of
from tests.property.modbus_adus import rtu
from tests.seeds import examples, in_turn, seeds

EXACT = Timing(LineSettings.parse("19200,8E1"))
HELD_BACK = replace(EXACT, latency=FTDI_LATENCY)
TIMINGS = (EXACT, HELD_BACK, replace(EXACT, latency=2 * MS))


# --- the tracker's memory, as this test knows it ---------------------------------------------------------------------


def memory(tracker: ModbusTracker) -> dict[str, object]:
    """All that it remembers, in values that compare."""

    def of(exchange: Exchange | None) -> object:
        return exchange and (
            *(exchange.tx, exchange.octets, exchange.request, exchange.fault, exchange.answered),
            exchange.copied,
        )

    learnt = tracker.learnt
    return {
        "times": {key: list(times) for key, times in learnt._times.items()},
        "pauses": list(learnt._pauses),
        "cycles": list(learnt._cycles),
        "unanswered": list(learnt._unanswered),
        "timeout": learnt.timeout,
        "open": of(tracker._held.open),
        "last": of(tracker._held.last),
        "last end": (tracker._last_end, tracker._last_was_answer),
        "answered": [of(one) for one in tracker._held.answered],
        "given up": [(of(one), one.waited, one.outlives) for one in tracker._held.given_up],
        "heard": sorted(tracker._held.heard.items()),
        "echoes": (tracker._echoes.usual, tracker._echoes._votes),
        "others": (tracker._mute, tracker._units, tracker._held.only, tracker.next_tx),
    }


# --- columns as values -----------------------------------------------------------------------------------------------


def _some(value: int) -> int | None:
    return None if value == NONE else int(value)


def placements_of(columns: PlacementColumns, numbers: list[int]) -> list[Placement]:
    return [
        Placement(
            no,
            int(columns.tx[row]),
            ROLES[columns.role[row]],
            _some(columns.source[row]),
            _some(columns.destination[row]),
        )
        for row, no in enumerate(numbers)
    ]


def transactions_of(columns: TransactionColumns) -> list[Transaction]:
    return [columns.transaction(place) for place in range(len(columns))]


def assert_paired_equally(chunks: list[Chunk], timing: Timing) -> tuple[int, int]:
    """Every exchange that is taken up is the tracker's own, and so is what it remembers; (frames so, in all)."""
    octets = b"".join(chunk.octets for chunk in chunks)
    events = events_of(RTU, chunks, timing)
    assert RTU.kernel is not None
    frames = RTU.kernel(reads_of(chunks), timing)
    wire = reads_of(chunks).octets
    found = exchanges(frames, wire, timing)
    row_at = {int(offset): row for row, offset in enumerate(frames.offset)}
    rows = [_row_of(frames, row_at, offset, event, octets, timing) for offset, event in events]
    begins = {int(row): place for place, row in enumerate(found.request)}
    tracker = ModbusTracker(timing)
    at, by_columns = 0, 0
    while at < len(events):
        place = begins.get(rows[at])
        if place is None or (known := tracker.known(int(frames.start[rows[at]]))) is None:
            _, event = events[at]
            tracker.track(at, event, RTU.peek(event) if isinstance(event, Frame) else None)
            at += 1
            continue
        end = holding(found, frames, place, known, timing)
        while end > place and not _is_framed(rows, at, found, place, end):
            end -= 1
        if end == place:
            _, event = events[at]
            tracker.track(at, event, RTU.peek(event))  # type: ignore[arg-type]
            at += 1
            continue
        at = _compare(tracker, events, at, found, frames, place, end, timing)
        by_columns += int(found.last[end - 1] - found.request[place]) + 1
    return by_columns, sum(isinstance(event, Frame) for _, event in events)


def _row_of(
    frames: FrameColumns, row_at: dict[int, int], offset: int, event: Event, octets: bytes, timing: Timing
) -> int:
    """The row that is this event, or NONE."""
    row = row_at.get(offset, NONE)
    if row == NONE or not isinstance(event, Frame):
        return NONE
    return row if frame_at(frames, row, octets, RTU.name, timing.latency)[0] == event else NONE


def _is_framed(rows: list[int], at: int, found: ExchangeColumns, place: int, end: int) -> bool:
    """Whether the framer gave all rows of exchanges [place, end), from event `at` on."""
    first, last = int(found.request[place]), int(found.last[end - 1])
    return rows[at : at + last - first + 1] == list(range(first, last + 1))


def _compare(
    tracker: ModbusTracker,
    events: list[tuple[int, Event]],
    at: int,
    found: ExchangeColumns,
    frames: FrameColumns,
    place: int,
    end: int,
    timing: Timing,
) -> int:
    """Track the exchanges [place, end) and hold all against the columns; the next event."""
    before = deepcopy(tracker)
    first, last = int(found.request[place]), int(found.last[end - 1])
    numbers = np.arange(len(frames)) + (at - first)
    placements, transactions = placed(found, frames, slice(place, end), numbers, tracker.next_tx, timing)
    span = range(at, at + last - first + 1)
    seen = {no: _seen(no, events[no][1]) for no in span}
    tracked = [tracker.track(no, events[no][1], seen[no].header) for no in span]
    assert [one.placement for one in tracked] == placements_of(placements, list(span))
    assert [closed for one in tracked for closed in one.closed] == transactions_of(transactions)
    went = passed(found, frames, place, end)
    newest = {}
    for one in sorted({*went.answered, *went.given_up, end - 1}):
        request = Exchange(
            before.next_tx + one - place, seen[int(found.request[one]) - first + at], bool(found.sure[one])
        )
        request.fault = request.request.header.error if found.faulty[one] else None
        request.answered = bool(found.answered[one])
        request.outlives = outlives(found, one, end)
        request.waited = int(found.gap[one]) if found.unanswered[one] else None
        newest[one] = request
    if found.copy[end - 1]:
        newest[end - 1].copied = int(found.gap[end - 1])
    by = PassedBy(
        seen[at],
        [one for place_of, one in newest.items() if place_of in went.answered or place_of == end - 1],
        [newest[one] for one in went.given_up],
        heard(went, place, before.next_tx),
        end - place,
        int(frames.end[last]),
        {int(unit) for unit in found.unit[place:end]} - {0},
    )
    before.pass_by(went, by)
    mine, its = memory(before), memory(tracker)
    mine["answered"], its["answered"] = _without_copied(mine["answered"]), _without_copied(its["answered"])
    assert mine == its
    return span.stop


def _without_copied(exchanges: object) -> list[object]:
    return [one[:-1] for one in exchanges]  # type: ignore[attr-defined]


def _seen(no: int, event: Event) -> Seen:
    assert isinstance(event, Frame)
    return Seen(no, event, RTU.peek(event), readable_adu(event))


# --- buses -----------------------------------------------------------------------------------------------------------


def said(seed: int, count: int, *, lost: float = 0.0, spread: int = 6) -> list[tuple[bytes, int]]:
    """Frames and the silence before each: reads, writes, writes to all, exceptions; some answers lost, late, doubled,
    some requests repeated, some frames spoilt."""
    dice = random.Random(seed)
    frames: list[tuple[bytes, int]] = []
    speed = {unit: dice.randint(3, 30) for unit in range(1, 6)}
    while len(frames) < count:
        unit, code = dice.randint(1, 5), dice.choice((3, 3, 3, 4, 1, 6, 6, 5, 16, 15, 23))
        at = bytes((0, dice.randrange(40)))
        asked = bytes((unit, code)) + at
        if code == 6:
            asked += bytes((0, dice.randrange(3)))
            answered = asked
        elif code == 5:
            asked += dice.choice((b"\xff\0", b"\0\0"))
            answered = asked
        elif code in (16, 15):
            size = 4 if code == 16 else 3
            asked += bytes((0, 2 if code == 16 else 20, size)) + dice.randbytes(size)
            answered = asked[:6]
        elif code == 23:
            asked += b"\0\2" + at + b"\0\1\2" + dice.randbytes(2)
            answered = asked[:2] + b"\4" + dice.randbytes(4)
        else:
            asked += b"\0\2"
            answered = asked[:2] + (b"\1\3" if code == 1 else b"\4" + dice.randbytes(4))
        pause, wait = dice.randint(8, 8 + spread) * MS, (speed[unit] + dice.randint(0, spread)) * MS
        if code in (5, 6, 15, 16):
            wait += 4 * MS
        if dice.random() < 0.02 and code in (5, 6, 15, 16):
            frames.append((rtu(b"\0" + asked[1:]), pause))
            frames.append((rtu(bytes((unit, 3, 0, 0, 0, 1))), 120 * MS))
            frames.append((rtu(bytes((unit, 3, 2, 0, 7))), wait))
            continue
        if dice.random() < 0.03:
            answered = bytes((unit, code | 0x80, dice.choice((1, 2, 4))))
        frames.append((rtu(asked), pause))
        if dice.random() >= lost:
            frames.append((rtu(answered), wait))
            continue
        fault = dice.randrange(10)
        if fault == 0:
            frames.append((rtu(asked), 300 * MS))
            frames.append((rtu(answered), wait))
        elif fault == 1:
            frames.append((rtu(answered)[:-1] + b"\x55", wait))
        elif fault == 2:
            frames += [(rtu(answered), wait), (rtu(answered), dice.choice((2, 9, 60)) * MS)]
        elif fault == 3:
            frames += [(rtu(asked), 2 * MS), (rtu(answered), wait)]
        elif fault == 4:
            frames.append((rtu(answered), wait * dice.choice((3, 10))))
        elif fault == 5:
            frames.append((rtu(bytes((9,)) + answered[1:]), wait))
        elif fault == 6:
            frames.append((_spoilt(rtu(answered), dice), wait))
        elif fault == 7:
            frames[-1] = _spoilt(rtu(asked), dice), pause
            frames.append((rtu(answered), wait))
        elif fault == 8:  # asked again, after a damaged answer, sooner or later
            frames += [(_spoilt(rtu(answered), dice), wait), (rtu(asked), dice.choice((3, 40, 70, 300, 4000)) * MS)]
            frames.append((rtu(answered), wait))
    return frames


def _spoilt(octets: bytes, dice: random.Random) -> bytes:
    at = dice.randrange(len(octets))
    return octets[:at] + bytes((octets[at] ^ dice.randint(1, 255),)) + octets[at + 1 :]


def with_dead_station(seed: int, count: int, repeats: int, timeout: int, jitter: int) -> list[tuple[bytes, int]]:
    """Polls of which one in seven is for a station that is not there."""
    dice, frames = random.Random(seed), []
    for number in range(count):
        unit = 1 + number % 7
        asked = bytes((unit, 3, 0, dice.randrange(40), 0, 2))
        if unit == 5:
            frames += [
                (rtu(asked), (dice.randint(8, 12) if n == 0 else timeout + dice.randint(0, jitter)) * MS)
                for n in range(repeats)
            ]
            frames.append((rtu(bytes((6, 3, 0, 0, 0, 2))), (timeout + dice.randint(0, jitter)) * MS))
        elif unit == 6 and dice.random() < 0.3:
            frames += [(rtu(bytes((1, 6, 0, 7)) + dice.randbytes(2)), 10 * MS)] * 2
            continue
        elif unit != 6:
            frames.append((rtu(asked), dice.randint(8, 12) * MS))
        if unit != 5:
            frames.append((rtu(bytes((unit, 3, 4)) + dice.randbytes(4)), dice.randint(3, 9) * MS))
    return frames


@pytest.mark.parametrize("timing", TIMINGS, ids=str)
@pytest.mark.parametrize(("repeats", "timeout", "jitter"), [(1, 200, 5), (3, 300, 2), (2, 60, 40), (3, 1000, 900)])
def test_of_a_station_that_is_not_there(repeats: int, timeout: int, jitter: int, timing: Timing) -> None:
    for seed in seeds(3):
        frames = with_dead_station(seed, 500, repeats, timeout, jitter)
        by_columns, total = assert_paired_equally(delivered(frames, timing), timing)
        if jitter < 10:
            assert by_columns >= 0.8 * total


@pytest.mark.parametrize("late", [12, 25, 90, 400])
def test_of_a_copy_that_comes_late(late: int) -> None:
    """After many quick ones it is the request again; before them it would have been the answer."""
    frames: list[tuple[bytes, int]] = []
    for number in range(120):
        write = rtu(bytes((1 + number % 2, 6, 0, 7, number, 9)))
        frames += [(rtu(bytes((3, 3, 0, 1, 0, 1))), 10 * MS), (rtu(bytes((3, 3, 2, 0, number))), 4 * MS)]
        frames += [(write, 10 * MS), (write, (late if number in (3, 60, 61, 90) else 4) * MS)]
    for timing in TIMINGS:
        assert_paired_equally(delivered(frames, timing), timing)


def delivered(frames: list[tuple[bytes, int]], timing: Timing) -> list[Chunk]:
    """One read a frame, each held back a little where the adapter may do so."""
    chunks, now = [], 0
    dice = random.Random(len(frames))
    for octets, pause in frames:
        now += pause + len(octets) * timing.char
        chunks.append(Chunk(now + dice.randint(0, timing.latency) // 8, octets))
    return chunks


@pytest.mark.parametrize("timing", TIMINGS, ids=str)
@pytest.mark.parametrize("seed", seeds(4))
def test_of_clean_buses(seed: int, timing: Timing) -> None:
    by_columns, total = assert_paired_equally(delivered(said(seed, 1200), timing), timing)
    assert by_columns >= 0.6 * total


@pytest.mark.parametrize("timing", TIMINGS, ids=str)
@pytest.mark.parametrize("lost", [0.01, 0.1, 0.4])
@pytest.mark.parametrize("seed", seeds(4))
def test_of_buses_with_faults(seed: int, lost: float, timing: Timing) -> None:
    for spread in (1, 6, 60):
        assert_paired_equally(delivered(said(seed, 600, lost=lost, spread=spread), timing), timing)


@pytest.mark.parametrize("timing", [bulk_rtu.TIMING, bulk_rtu.HELD_BACK], ids=str)
def test_of_the_bulk_bus(timing: Timing) -> None:
    table, length = bulk_rtu.frames(3000)
    for share in (0.0, 0.005, 0.05):
        reads = bulk_rtu.bus(bulk_rtu.damaged(table, length, share) if share else table, length, timing)
        octets, begins = reads.octets.tobytes(), reads.begins.tolist()
        chunks = [
            Chunk(time, octets[a:b]) for time, a, b in zip(reads.times.tolist(), begins[:-1], begins[1:], strict=True)
        ]
        by_columns, total = assert_paired_equally(chunks, timing)
        assert by_columns >= (0.95 if share < 0.05 else 0.7) * total


OURS = sorted((Path(__file__).parents[2] / "captures").rglob("*rtu*.cap.txt"))


@pytest.mark.parametrize("path", OURS, ids=lambda path: path.name)
def test_of_our_captures(path: Path) -> None:
    capture = formats.read(path)
    chunks = [item for item in capture.items() if isinstance(item, Chunk)]
    for latency in in_turn((0, FTDI_LATENCY), OURS.index(path), 2):
        assert_paired_equally(chunks, replace(capture.session.timing, latency=latency))


@settings(max_examples=examples(60), deadline=None)
@given(st.integers(0, 10**6), st.sampled_from((0.0, 0.05, 0.3)), st.sampled_from(TIMINGS), st.booleans())
def test_of_any_bus(seed: int, lost: float, timing: Timing, held: bool) -> None:
    frames = said(seed, 250, lost=lost, spread=1 + seed % 40)
    if held:
        wire, now = [], 0
        for octets, pause in frames:
            now += pause
            for octet in octets:
                now += timing.char
                wire.append((now, octet))
        assert_paired_equally(ftdi(wire, timer=max(MS, timing.latency - MS)), timing)
    else:
        assert_paired_equally(delivered(frames, timing), timing)


def test_nothing_gives_nothing() -> None:
    assert assert_paired_equally([Chunk(0, b"\1")], EXACT) == (0, 0)
    assert assert_paired_equally(ftdi(laid_out([rtu(b"\1\3\0\0\0\1")], EXACT, MS)), EXACT)[0] == 0
