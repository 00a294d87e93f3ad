"""What pairing by columns says held against the tracker, row by row: placements, transactions, and what comes after."""

from __future__ import annotations

from collections.abc import Sequence

from dissectors.bacnet import MSTP
from dissectors.bacnet.kernel import kernel
from dissectors.bacnet.pairing import Pairing, Run, prepare
from dissectors.bacnet.tracker import MstpTracker
from dissectors.columns import NONE, ROLES, VERDICTS
from dissectors.frame import Chunk, Frame
from dissectors.line import Timing
from dissectors.tracker import Interval, Placement, Transaction
from tests.property.kernel_equality import events_of, frame_at, reads_of

FIRST = 1


def _some(value: int) -> int | None:
    return None if value == NONE else value


def transactions_of(run: Run) -> list[Transaction]:
    """The transactions of a run as values."""
    columns, given = run.transactions, []
    for row in range(len(columns)):
        latency = int(columns.latency[row])
        interval = Interval(latency, int(columns.least[row]), int(columns.most[row]))
        given.append(
            Transaction(
                int(columns.id[row]),
                int(columns.station[row]),
                columns.names[columns.kind[row]],
                _some(int(columns.request[row])),
                _some(int(columns.response[row])),
                VERDICTS[columns.verdict[row]],
                int(columns.start[row]),
                int(columns.end[row]),
                None if latency == NONE else interval,
                int(columns.attempt[row]),
                _some(int(columns.of[row])),
                columns.names[columns.error[row]] if columns.error[row] else None,
            )
        )
    return given


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


def assert_paired_alike(chunks: Sequence[Chunk], timing: Timing) -> tuple[int, int]:
    """The tracker over all events, and pairing with a tracker for the rest: the same; (rows by columns, frames)."""
    events = events_of(MSTP, chunks, timing)
    tracker = MstpTracker(timing)
    expected = [
        tracker.track(no, event, MSTP.peek(event) if isinstance(event, Frame) else None)
        for no, (_, event) in enumerate(events, FIRST)
    ]
    at_end = tracker.close()
    total = sum(isinstance(event, Frame) for _, event in events)
    octets = b"".join(chunk.octets for chunk in chunks)
    if not octets:
        return 0, total
    reads = reads_of(chunks)
    columns = kernel(reads, timing)
    tracker = MstpTracker(timing)
    pairing = Pairing(columns, reads.octets, timing, prepare(tracker))
    rows = {int(offset): row for row, offset in enumerate(columns.offset)}
    place, before, by_columns = 0, NONE, 0
    while place < len(events):
        offset, event = events[place]
        row = rows.get(offset, NONE)
        if row != NONE and frame_at(columns, row, octets, "mstp", timing.latency)[0] != event:
            row = NONE  # a chain that the reference does not take up
        no = place + FIRST
        run = pairing.run(tracker, row, no) if row > 0 and row - 1 == before else None
        if run is None:
            tracked = tracker.track(no, event, MSTP.peek(event) if isinstance(event, Frame) else None)
            assert tracked == expected[place], f"{no}: {event}"
            place, before = place + 1, row
            continue
        count = run.end - run.begin
        assert placements_of(run, no) == [one.placement for one in expected[place : place + count]]
        assert transactions_of(run) == [one for each in expected[place : place + count] for one in each.closed]
        assert not any(each.assembly for each in expected[place : place + count])
        place, before, by_columns = place + count, run.end - 1, by_columns + count
    assert tracker.close() == at_end
    return by_columns, total
