"""What pairing by columns says held against the tracker, row by row: placements, transactions, and what comes after."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from random import Random

import numpy as np

from dissectors.bacnet import MSTP
from dissectors.bacnet.exchange import Exchange, Key
from dissectors.bacnet.kernel import kernel
from dissectors.bacnet.pairing import Pairing, Run, prepare
from dissectors.bacnet.tracker import MstpTracker
from dissectors.bacnet.turn import Turn
from dissectors.columns import NONE, ROLES
from dissectors.frame import Chunk, Event, Frame
from dissectors.line import Timing
from dissectors.tracker import Placement, Tracked, Transaction, Verdict
from tests.property.kernel_equality import events_of, frame_at, reads_of

FIRST = 1


def _some(value: int) -> int | None:
    return None if value == NONE else value


def transactions_of(run: Run) -> list[Transaction]:
    """The transactions of a run as values."""
    return [run.transactions.transaction(place) for place in range(len(run.transactions))]


def placements_of(run: Run, no: int) -> list[Placement]:
    """The placements of a run as values."""
    rows = zip(
        run.placements.tx.tolist(),
        run.placements.role.tolist(),
        run.placements.source.tolist(),
        run.placements.destination.tolist(),
        strict=True,
    )
    return [
        Placement(no + at, tx, ROLES[role], source, destination)
        for at, (tx, role, source, destination) in enumerate(rows)
    ]


def assert_paired_alike(
    chunks: Sequence[Chunk], timing: Timing, late: Random | None = None, block: int = 1_000_000
) -> tuple[int, int]:
    """The tracker over all events, and pairing with a tracker for the rest: the same; (rows by columns, frames).

    `late`: gives some frames more slack, as where reads came late. `block`: rows after which pairing begins anew.
    """
    events = [(offset, _late(event, late)) for offset, event in events_of(MSTP, chunks, timing)]
    reference = MstpTracker(timing)
    total = sum(isinstance(event, Frame) for _, event in events)
    octets = b"".join(chunk.octets for chunk in chunks)
    if not octets:
        return 0, total
    reads = reads_of(chunks)
    columns = kernel(reads, timing)
    tracker = MstpTracker(timing)
    slacks = {offset: event.slack for offset, event in events if isinstance(event, Frame)}
    slack = np.array([slacks.get(offset, timing.latency) for offset in columns.offset.tolist()], np.int64)
    pairing = Pairing(columns, reads.octets, timing, prepare(tracker), slack if late else None)
    rows = {int(offset): row for row, offset in enumerate(columns.offset)}
    place, before, by_columns, begins_anew = 0, NONE, 0, block
    while place < len(events):
        offset, event = events[place]
        row = rows.get(offset, NONE)
        if row != NONE and frame_at(columns, row, octets, "mstp", int(slack[row]))[0] != event:
            row = NONE  # a chain that the reference does not take up
        no = place + FIRST
        if place >= begins_anew:
            begins_anew += block
            pairing = Pairing(columns, reads.octets, timing, prepare(tracker), slack if late else None)
        run = pairing.run(tracker, row, no) if row > 0 and row - 1 == before else None
        count = 1 if run is None else run.end - run.begin
        expected = [_track(reference, place + at + FIRST, events[place + at][1]) for at in range(count)]
        if run is None:
            assert _track(tracker, no, event) == expected[0], f"{no}: {event}"
            place, before = place + 1, row
            continue
        assert placements_of(run, no) == [one.placement for one in expected]
        assert transactions_of(run) == [one for each in expected for one in each.closed]
        assert not any(each.assembly for each in expected)
        _assert_alike(tracker, reference)
        place, before, by_columns = place + count, run.end - 1, by_columns + count
    assert tracker.close() == reference.close()
    assert list(_past(tracker)) == list(_past(reference))
    return by_columns, total


def _late(event: Event, dice: Random | None) -> Event:
    if dice is None or not isinstance(event, Frame) or dice.random() < 0.5:
        return event
    return replace(event, slack=event.slack + dice.randrange(50_000_000))


def _track(tracker: MstpTracker, no: int, event: Event) -> Tracked:
    return tracker.track(no, event, MSTP.peek(event) if isinstance(event, Frame) else None)


def _assert_alike(tracker: MstpTracker, reference: MstpTracker) -> None:
    """Both know the same; of the past the newest is looked at."""
    one, other = tracker.standing(), reference.standing()
    assert (one.next, one.waiting, one.previous) == (other.next, other.waiting, other.previous)
    assert one.postponed == other.postponed
    assert set(one.reassembler.open_keys) == set(other.reassembler.open_keys)
    assert all(getattr(one.turn, name) == getattr(other.turn, name) for name in Turn.__slots__)
    assert len(one.past) == len(other.past)
    newest = next(reversed(other.past), None)
    if newest is not None:
        assert one.past.get(newest) == other.past[newest]


def _past(tracker: MstpTracker) -> Iterator[tuple[Key, tuple[Exchange, Verdict, int]]]:
    """Takes out what is over, the latest first."""
    past = tracker.standing().past
    while len(past):
        yield past.popitem()
