"""Rows that the marks of a capture are about: a mark says a moment, and may come long after it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sniff.engine.engine import Output
from sniff.engine.session import LineEvent, LineEventKind

if TYPE_CHECKING:
    from sniff.engine.table import Table


class MarkedRows:
    """An observer of a whole capture: 16 octets a row are kept."""

    def __init__(self) -> None:
        self._starts: list[np.ndarray[tuple[int], np.dtype[np.int64]]] = []
        self._ends: list[np.ndarray[tuple[int], np.dtype[np.int64]]] = []
        self._events: list[LineEvent] = []

    def add(self, output: Output) -> None:
        """Note when rows were."""
        self._starts.append(np.array([row.event.start for row in output.rows], np.int64))
        self._ends.append(np.array([row.event.end for row in output.rows], np.int64))

    def add_table(self, table: Table) -> None:
        """The same of many."""
        self._starts.append(table.frames.start.astype(np.int64))
        self._ends.append(table.frames.end.astype(np.int64))

    def add_line_event(self, event: LineEvent) -> None:
        """Note marks, and comments of a text."""
        if event.is_mark or event.kind is LineEventKind.COMMENT:
            self._events.append(event)

    def by_row(self) -> dict[int, str]:
        """What was written, by number of the row, the first is 1."""
        if not self._events or not self._starts:
            return {}
        starts, ends = np.concatenate(self._starts), np.concatenate(self._ends)
        marks: dict[int, str] = {}
        said: dict[int, list[str]] = {}
        for event in self._events:
            moment = event.moment
            at = int(np.searchsorted(starts, moment))
            if not (at < len(starts) and starts[at] == moment) and at and ends[at - 1] >= moment:
                at -= 1
            if event.kind is LineEventKind.UNMARK:
                marks.pop(at + 1, None)
            elif event.kind is LineEventKind.COMMENT:
                said.setdefault(min(at, len(starts) - 1) + 1, []).append(event.text)
            elif at < len(starts):
                marks[at + 1] = event.text
        for no, text in marks.items():
            said.setdefault(no, []).insert(0, text)
        return {no: "; ".join(texts) for no, texts in sorted(said.items())}
