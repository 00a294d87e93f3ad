"""The stretches of a block as one table that nobody has placed yet, so that what follows is done once a block."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dissectors.columns import NONE, UNSAID, FrameColumns, Masks, PlacementColumns
from dissectors.frame import Event, Frame
from dissectors.manifest import Dissector
from sniff.engine.engine import Row
from sniff.engine.framing import Clean, Stretch
from sniff.engine.late_columns import LateColumns
from sniff.engine.row_packing import frame_columns, is_plain, transaction_columns
from sniff.engine.table import Table, joined_columns


@dataclass(frozen=True, slots=True)
class Gathered:
    """Rows of a block in their order. `given`: by place, those that the reference framer gave, as they are."""

    table: Table
    given: dict[int, Row]

    @property
    def to_pair(self) -> FrameColumns:
        """The columns as a pairing is handed them."""
        frames = self.table.frames
        if not self.table.odd:
            return frames
        odd = _mask(len(frames), self.table.odd)
        return replace(frames, ok=frames.ok & ~odd, damage=np.where(odd, np.uint8(UNSAID), frames.damage))


def gathered(dissector: Dissector, first: int, stretches: Sequence[Stretch], late: LateColumns) -> Gathered:
    """The rows of stretches, of which one at least is a kernel's, as a table that begins with number `first`."""
    clean = [one for one in stretches if isinstance(one, Clean)]
    columns = clean[0].columns
    places, events, count = _heard(stretches)
    is_frame, slack = np.ones(count, bool), np.zeros(count, np.int64)
    heard = _mask(count, places)
    ends = np.empty(count, np.int64)
    ends[~heard] = np.concatenate([columns.end[one.begin : one.end] for one in clean])
    ends[heard] = [event.end for event in events]
    is_frame[heard] = [isinstance(event, Frame) for event in events]
    slack[is_frame] = late.slack(ends[is_frame])
    given = []
    for place, event in zip(places, events, strict=True):
        if not isinstance(event, Frame):
            given.append(Row(first + place, event))
            continue
        if slack[place] > event.slack:
            event = replace(event, slack=int(slack[place]))
        slack[place] = event.slack
        given.append(Row(first + place, event, dissector.peek(event)))
    frames = joined_columns(FrameColumns, list(_parts(stretches, columns, frame_columns(given))))
    lengths = frames.length.astype(np.int64)
    frames = replace(frames, offset=np.cumsum(lengths) - lengths)
    nowhere = np.full(count, NONE, np.int16)
    table = Table(
        dissector.name,
        first,
        np.concatenate([_octets(one) for one in stretches]),
        frames,
        slack,
        is_frame,
        PlacementColumns(np.zeros(count, np.int64), np.zeros(count, np.uint8), nowhere, nowhere),
        transaction_columns(()),
        np.zeros(0, np.int64),
        {place: row for place, row in zip(places, given, strict=True) if not is_plain(row)},
    )
    return Gathered(table, dict(zip(places, given, strict=True)))


def _heard(stretches: Sequence[Stretch]) -> tuple[list[int], list[Event], int]:
    """The events of the reference framer and their places among all rows; how many those are."""
    places: list[int] = []
    events: list[Event] = []
    count = 0
    for one in stretches:
        if isinstance(one, Clean):
            count += one.end - one.begin
            continue
        places += range(count, count + len(one))
        events += one
        count += len(one)
    return places, events, count


def _parts(stretches: Sequence[Stretch], of_kernel: FrameColumns, given: FrameColumns) -> Iterator[FrameColumns]:
    """The columns of each stretch."""
    at = 0
    for one in stretches:
        if isinstance(one, Clean):
            yield of_kernel.take(slice(one.begin, one.end))
        else:
            yield given.take(slice(at, at + len(one)))
            at += len(one)


def _octets(stretch: Stretch) -> np.ndarray[tuple[int], np.dtype[np.uint8]]:
    if not isinstance(stretch, Clean):
        return np.frombuffer(b"".join([event.octets for event in stretch]), np.uint8)
    columns, last = stretch.columns, stretch.end - 1
    return stretch.octets[int(columns.offset[stretch.begin]) : int(columns.offset[last]) + int(columns.length[last])]


def _mask(count: int, places: Sequence[int] | Mapping[int, Row]) -> Masks:
    mask: Masks = np.zeros(count, bool)
    mask[list(places)] = True
    return mask
