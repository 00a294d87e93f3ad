"""Whether a bus has a second protocol, and from which row on: the one answer for all who list or count rows. Pure.

What the first protocol leaves is asked window by window, of as many octets each, however long a capture is: so a second
one that begins to speak after an hour is heard, and what is asked of a window is bounded. What is left is sparse on
most buses; so the windows before are asked once more, up to SAMPLE octets. Each further question asks for one more bit
of evidence as often as their number doubles, or chance would find a second protocol in noise at last.

From the window on in which it is proven, frames of the second are listed as such. Rows that were given before stay as
they were; so who lists rows holds back those of a window from the first that is left until the window has been asked
(`proving`). A capture of which nothing is left is never asked, and nothing of it waits.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Iterator
from typing import Generic, TypeVar

import numpy as np

from dissectors import registry
from dissectors.columns import Times
from dissectors.frame import Chunk, Noise
from sniff.engine.capture_error import CaptureError
from sniff.engine.engine import Output, Row
from sniff.engine.session import SECOND_NOTE, LineEvent, Session
from sniff.engine.table import Table, rows_at

WINDOW = 1 << 20
"""Octets of a window."""

SAMPLE = 6000
"""Octets which the first protocol leaves of a window that are asked for a second one."""

AT_ONCE = 256
"""Rows that are looked at together: most windows have few that are left, or give SAMPLE octets soon."""

Given = TypeVar("Given", bound="Output | Table | LineEvent")


class SecondProof:
    """Fed all rows of a bus in order. `name`: the second protocol, "" where none is proven so far; `since`: the number
    of the first row that may be one of its frames."""

    def __init__(self, session: Session) -> None:
        told = session.notes.get(SECOND_NOTE, "")
        self.name = told if registry.is_of_lines(told) else ""  # what a file says may be anything
        self.since = 0
        self._session = session
        known = not session.unknown and registry.is_of_lines(session.protocol)  # a relative on networks has streams
        self._asks = known and not self.name
        self._octets = self._window = self._asked = 0
        self._sample: deque[tuple[int, Chunk]] = deque()  # with the number of the row
        self._sampled = self._fresh = 0  # octets of the sample, and those of them that were not asked
        self._first_left = 0  # number of the row
        self._is_asked = False  # whether this window was

    @property
    def known_before(self) -> int | None:
        """The number of the first row seen that may yet be a second protocol's; None where nothing waits."""
        return self._first_left if self._fresh else None

    def see(self, item: Output | Table | LineEvent) -> None:
        """Take what an engine gave, as rows or as columns."""
        if not self._asks or isinstance(item, LineEvent):
            return
        if isinstance(item, Table):
            self._see_table(item)
            return
        for row in item.rows:
            if is_left(row):
                self._left(row, self._octets)
            self._octets += len(row.event.octets)
        self._end_window(self._octets)

    def close(self) -> None:
        """Say that nothing follows."""
        if self._asks:
            self._ask()

    def _see_table(self, table: Table) -> None:
        places = left_places(table)
        if len(places):
            ends = np.cumsum(table.frames.length) + self._octets
            begins = ends[places] - table.frames.length[places]
            at = 0
            while at < len(places) and self._asks:
                if self._is_asked:  # what follows of its window does not count
                    at = max(at, int(np.searchsorted(begins, (self._window + 1) * WINDOW)))
                some = places[at : at + AT_ONCE].tolist()
                for row, begin in zip(rows_at(table, some), begins[at : at + AT_ONCE].tolist(), strict=True):
                    self._left(row, begin)
                at += AT_ONCE
        self._octets += int(table.frames.length.sum())
        self._end_window(self._octets)

    def _end_window(self, octets: int) -> None:
        """Ask where a window has ended before so many octets."""
        if self._asks and octets // WINDOW > self._window:
            self._ask()
            self._window, self._is_asked = octets // WINDOW, False

    def _left(self, row: Row, begin: int) -> None:
        """Take a row that the first protocol leaves, so many octets after the begin of the capture."""
        self._end_window(begin)
        if self._is_asked or not self._asks:
            return
        octets = row.event.octets[:SAMPLE]
        if not self._fresh:
            self._first_left = row.no
        self._sample.append((row.no, Chunk(row.event.end, octets)))
        self._sampled += len(octets)
        self._fresh += len(octets)
        while self._sampled - len(self._sample[0][1].octets) >= SAMPLE:
            self._sampled -= len(self._sample.popleft()[1].octets)
        if self._fresh >= SAMPLE:
            self._ask()
            self._is_asked = True

    def _ask(self) -> None:
        """Ask the sample, unless nothing came since the last time."""
        if not self._fresh:
            return
        from sniff.analysis.rest_evidence import SECOND_BITS, second_in  # with the search: most buses leave nothing

        self._fresh = 0
        self._asked += 1
        session = self._session
        others = [one.name for one in registry.usable() if one.name != session.protocol]
        found = second_in(self._stretches(), session, others, SECOND_BITS + math.log2(self._asked))
        if found is not None:
            self.name, self.since, self._asks = found[0], self._first_left, False
            self._sample.clear()

    def _stretches(self) -> list[list[Chunk]]:
        """The sample, rows that follow one another together."""
        stretches: list[list[Chunk]] = []
        before = None
        for no, chunk in self._sample:
            if no - 1 != before:
                stretches.append([])
            stretches[-1].append(chunk)
            before = no
        return stretches


def is_left(row: Row) -> bool:
    """Whether the first protocol makes nothing good of a row."""
    return row.searched is None and (isinstance(row.event, Noise) or not row.event.ok)


def left_places(table: Table) -> Times:
    """Places in a table of the rows of which the first protocol makes nothing good."""
    left: Times = np.flatnonzero(~table.good)
    return left[table.heard[left]] if len(left) else left


class Proving(Generic[Given]):
    """Hands on what an engine gives when it is known which of its rows may be frames of a second protocol."""

    def __init__(self, proof: SecondProof) -> None:
        self._proof = proof
        self._held: list[Given] = []

    def add(self, item: Given) -> list[Given]:
        """Take what follows; give what is known."""
        self._proof.see(item)
        self._held.append(item)
        first = self._proof.known_before
        if first is None:
            return self._all()
        known = next((at for at, held in enumerate(self._held) if _last_row(held) >= first), len(self._held))
        given, self._held = self._held[:known], self._held[known:]
        return given

    def close(self) -> list[Given]:
        """Give all that is left."""
        self._proof.close()
        return self._all()

    def _all(self) -> list[Given]:
        held, self._held = self._held, []
        return held


def _last_row(item: Output | Table | LineEvent) -> int:
    """The number of the last row of something, -1 where it has none."""
    if isinstance(item, Table):
        return item.first + len(item) - 1 if len(item) else -1
    return item.rows[-1].no if isinstance(item, Output) and item.rows else -1


def proving(items: Iterable[Given], proof: SecondProof | None) -> Iterator[Given]:
    """The same items in their time (`Proving`); as they come where nothing is to be proven. Raises what `items` raises,
    when all before it was given."""
    if proof is None:
        yield from items
        return
    holding: Proving[Given] = Proving(proof)
    try:
        for item in items:
            yield from holding.add(item)
    except CaptureError:
        yield from holding.close()
        raise
    yield from holding.close()
