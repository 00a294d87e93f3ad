"""The bulk form of the Modbus tracker, as the engine asks for it (`dissectors.columns.Pairing`).

Frames in ASCII are paired as the RTU frames that would carry the same. What counts in characters of silence is that of
RTU, which is more than ASCII asks: then the tracker looks at more by itself.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dissectors.columns import NONE, FrameColumns, Octets, PlacementColumns, Run, Times, TransactionColumns
from dissectors.line import Timing
from dissectors.modbus.ascii_kernel import rtu_twins
from dissectors.modbus.envelope import ASCII_NAME, RTU_NAME, readable_adu
from dissectors.modbus.exchange import Exchange, Seen
from dissectors.modbus.exchange_columns import exchanges, placed
from dissectors.modbus.exchange_memory import heard, holding, outlives, passed
from dissectors.modbus.tracker import ModbusTracker
from dissectors.modbus.tracker_memory import PassedBy
from dissectors.tracker import Tracker


class ModbusBlockPairing:
    """Runs of regular exchanges among some frames. `twins`: the frames as RTU carries them, where they are others."""

    def __init__(
        self,
        protocol: str,
        tracker: ModbusTracker,
        frames: FrameColumns,
        octets: Octets,
        timing: Timing,
        slack: Times,
        twins: tuple[FrameColumns, Octets] | None = None,
    ) -> None:
        self._protocol = protocol
        self._tracker = tracker
        self._frames, self._octets, self._timing, self._slack = frames, octets, timing, slack
        self._found = exchanges(*(twins or (frames, octets)), timing, slack, damaged=twins is None)
        self._last = self._found.last
        self._rows: Times = np.zeros(0, np.int64)  # of all exchanges before each, once they are placed
        self._whole: tuple[Times, PlacementColumns, TransactionColumns] | None = None

    def run(self, begin: int, no: int) -> Run | None:
        """See `dissectors.columns.BlockPairing`."""
        found, frames = self._found, self._frames
        place = int(np.searchsorted(found.request, begin))
        if place == len(found) or found.request[place] != begin:
            return None
        known = self._tracker.known(int(frames.start[begin]))
        if known is None:
            return None
        end = holding(found, frames, place, known, self._timing)
        if end == place:
            return None
        which, last = slice(place, end), int(self._last[end - 1])
        placements, transactions = self._placed(which, no - begin)
        self._let_pass(place, end, no - begin)
        closed_by = self._last[which].copy()
        closed_by[:-1] = np.where(found.goes_on[which][:-1], found.request[which][1:], closed_by[:-1])
        return Run(begin, last + 1, placements, transactions, closed_by)

    def _placed(self, which: slice, to_number: int) -> tuple[PlacementColumns, TransactionColumns]:
        """What `placed` gives for some exchanges: a part of what it gives for all, where that is the same."""
        found, tx = self._found, self._tracker.next_tx
        if self._whole is None:
            numbers = np.arange(len(self._frames)) + to_number  # the rows follow one another: the same in every run
            everything = slice(0, len(found))
            self._rows = np.append(0, np.cumsum(1 + (found.answered | found.garbled)))
            self._whole = (
                numbers,
                *placed(found, self._frames, everything, numbers, 0, self._timing, self._slack),
            )
        numbers, placements, transactions = self._whole
        if found.repeat[which.start]:  # its attempts count from here
            return placed(found, self._frames, which, numbers, tx, self._timing, self._slack)
        further, rows = tx - which.start, slice(int(self._rows[which.start]), int(self._rows[which.stop]))
        closed = transactions.take(which)
        return (
            PlacementColumns(
                placements.tx[rows] + further,
                placements.role[rows],
                placements.source[rows],
                placements.destination[rows],
            ),
            replace(closed, id=closed.id + further, of=np.where(closed.of == NONE, NONE, closed.of + further)),
        )

    def _let_pass(self, place: int, end: int, to_number: int) -> None:
        """Put the tracker behind exchanges [place, end)."""
        found, went = self._found, passed(self._found, self._frames, place, end)
        tx = self._tracker.next_tx
        made: dict[int, Exchange] = {}
        for one in sorted({*went.answered, *went.given_up, end - 1}):
            row = int(found.request[one])
            request = Exchange(tx + one - place, self._seen(row, to_number), bool(found.sure[one]))
            if found.faulty[one]:
                request.fault = request.request.header.error
            request.answered = bool(found.answered[one])
            request.outlives = outlives(found, one, end)
            request.waited = int(found.gap[one]) if found.unanswered[one] else None
            made[one] = request
        if found.copy[end - 1]:
            made[end - 1].copied = int(found.gap[end - 1])
        by = PassedBy(
            first=self._seen(int(found.request[place]), to_number),
            newest=[one for at, one in made.items() if at in went.answered or at == end - 1],
            given_up=[made[at] for at in went.given_up],
            heard=heard(went, place, tx),
            count=end - place,
            end=int(self._frames.end[self._last[end - 1]]),
            units=set(np.flatnonzero(np.bincount(found.unit[place:end])).tolist()) - {0},
        )
        self._tracker.pass_by(went, by)

    def _seen(self, row: int, to_number: int) -> Seen:
        frame = self._frames.frame(row, self._octets, self._protocol, int(self._slack[row]))
        return Seen(row + to_number, frame, self._frames.header(row, self._protocol), readable_adu(frame))


def rtu_pairing(
    tracker: Tracker, frames: FrameColumns, octets: Octets, timing: Timing, slack: Times
) -> ModbusBlockPairing:
    """For the manifest."""
    assert isinstance(tracker, ModbusTracker)
    return ModbusBlockPairing(RTU_NAME, tracker, frames, octets, timing, slack)


def ascii_pairing(
    tracker: Tracker, frames: FrameColumns, octets: Octets, timing: Timing, slack: Times
) -> ModbusBlockPairing:
    """For the manifest."""
    assert isinstance(tracker, ModbusTracker)
    return ModbusBlockPairing(ASCII_NAME, tracker, frames, octets, timing, slack, rtu_twins(frames, octets))
