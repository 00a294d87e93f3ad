"""The frames of one tap as columns, kept from the tables of its bus."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from dissectors.columns import NONE, Masks, Octets, Small, Times
from dissectors.fingerprints import LONGEST, fingerprints, gathered
from sniff.analysis.holes import Holes
from sniff.engine.engine import Output
from sniff.engine.session import LineEvent
from sniff.engine.table import Table

Keys = npt.NDArray[np.uint64]


@dataclass(frozen=True, slots=True)
class TapFrames:
    """Frames and noise of one tap in the order of the wire, one entry a row.

    `no`: number of the row. `start`, `end`: ns. `key`: equal for equal octets. `good`: a whole frame with a good check
    where it has one. `sender`: station that sent it; `NONE` where the protocol does not say, as for the one master of a
    polled bus. `begin`, `length`: its octets in `octets`.
    """

    no: Times
    start: Times
    end: Times
    key: Keys
    good: Masks
    sender: Small
    begin: Times
    length: Times
    octets: Octets

    def __len__(self) -> int:
        return len(self.no)

    def octets_at(self, place: int) -> bytes:
        """The octets of an entry."""
        begin = int(self.begin[place])
        return self.octets[begin : begin + int(self.length[place])].tobytes()


class TapEar:
    """Keeps what a tap heard, and when it did not (`holes`). An observer of tables."""

    def __init__(self) -> None:
        self.holes = Holes()
        self._parts: list[TapFrames] = []
        self._held = 0  # octets

    def add(self, output: Output) -> None:
        """Take rows one by one."""
        if output.rows:
            self.add_table(Table.of_outputs("", output.rows[0].no, [output]))

    def add_line_event(self, event: LineEvent) -> None:
        """Take what happened to the line: what came in a hole may have been whole."""
        if event.kind.is_hole:
            self.holes.miss(event)

    def add_table(self, table: Table) -> None:
        """Take rows that follow."""
        if not len(table):
            return
        heard, lengths = table.heard.copy(), table.frames.length.astype(np.int64)
        if heard.any():
            self.holes.take(table.frames.start[heard], table.frames.end[heard])
        heard &= (lengths > 0) & (lengths <= LONGEST)
        places = np.flatnonzero(heard)
        if not len(places):
            return
        lengths = lengths[places]
        octets, edges = gathered(table.octets, table.frames.offset[places], lengths)
        self._parts.append(
            TapFrames(
                table.first + places,
                table.frames.start[places],
                table.frames.end[places],
                fingerprints(octets, edges, lengths),
                table.good[places],
                np.where(table.is_frame[places], table.shown("source")[places], NONE).astype(np.int16),
                self._held + edges,
                lengths,
                octets,
            )
        )
        self._held += len(octets)

    def frames(self) -> TapFrames:
        """All that was heard."""
        if not self._parts:
            whole, small = np.zeros(0, np.int64), np.zeros(0, np.int16)
            none, octets = np.zeros(0, bool), np.zeros(0, np.uint8)
            return TapFrames(whole, whole, whole, whole.astype(np.uint64), none, small, whole, whole, octets)
        columns = {
            one.name: np.concatenate([getattr(part, one.name) for part in self._parts]) for one in fields(TapFrames)
        }
        return TapFrames(**columns)
