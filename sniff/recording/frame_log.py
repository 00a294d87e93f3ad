"""What an engine finds, on its way into the /frames of a recording."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from dissectors.columns import Times
from sniff.engine.bulk import FAR
from sniff.engine.engine import Output
from sniff.engine.event_texts import settings_change
from sniff.engine.session import LineEvent, Session
from sniff.engine.table import Table, joined
from sniff.recording.frames import StoredTable, encode, octets_of
from sniff.recording.stored_tables import StoredRecord, is_kept, record_of

AT_ONCE = 1 << 16
"""Rows of a message, about."""

GATHERED = 1000
"""Rows that came one by one, to be one table."""


class FrameLog:
    """Takes what an engine gives of a capture, with the line events between; gives the messages and the record that
    ends them.

    `fits`: whether whoever reads it can take it for what an engine would find: not where settings are searched for or
    change, where a plug-in dissects, where times run backwards or are far away (then what is found depends on how
    reads are cut into blocks), and where a table is not kept. From then on nothing is given, and no record: what was
    given before is left in the file, and read by nobody.
    """

    def __init__(self, session: Session) -> None:
        self.fits = is_kept(session)
        self._session = session
        self._outputs: list[Output] = []
        self._tables: list[Table] = []
        self._rows = 0  # of those that wait
        self._heard = -FAR
        self._made: list[tuple[int, int, bytes]] = []
        self._all_rows = self._closed = self._octets = self._events = 0
        self._is_over = False  # a hole ends what was framed: the next table is the end of a stretch

    def hear(self, time: int) -> None:
        """A read came, ns; before what is found in it."""
        self.fits = self.fits and self._heard <= time <= FAR
        self._heard = time
        self._is_over = False

    def hear_many(self, times: Times) -> None:
        """Reads came, at least one."""
        self.fits = self.fits and bool((times[1:] >= times[:-1]).all())
        self.hear(int(times[0]))
        self.hear(int(times[-1]))

    def add(self, output: Output) -> None:
        """Rows, and what closed with them."""
        self._outputs.append(output)
        self._rows += len(output.rows)
        if self._rows >= GATHERED:
            self._gather()

    def add_table(self, table: Table) -> None:
        """The same as a table."""
        self._gather()
        if table:
            self._tables.append(table)
            self._rows += len(table)
        if self._rows >= AT_ONCE or self._is_over:
            self._make()
        self._is_over = False

    def add_line_event(self, event: LineEvent) -> None:
        """What happened on the line, after the rows before it; a hole before those that it ends."""
        if settings_change(event) is not None:
            self.fits = False
        self._gather()
        self._make()
        self._events += 1
        self._is_over = event.kind.is_hole

    def close(self) -> None:
        """Nothing more comes."""
        self._gather()
        self._make()

    def take(self) -> list[tuple[int, int, bytes]]:
        """log time, publish time and data of the messages that were made since."""
        made, self._made = self._made, []
        return made if self.fits else []

    def record(self) -> dict[str, str] | None:
        """The record that ends them; None where they do not fit."""
        if not self.fits:
            return None
        counted = StoredRecord(self._all_rows, self._closed, self._octets, self._events)
        return record_of(self._session, counted)

    def _gather(self) -> None:
        outputs, self._outputs = self._outputs, []
        if outputs:
            given = sum(len(output.rows) for output in outputs)
            self._rows -= given
            self.add_table(Table.of_outputs(self._session.protocol, self._next(outputs), outputs))

    def _next(self, outputs: Sequence[Output]) -> int:
        first = next((row.no for output in outputs for row in output.rows), None)
        return self._all_rows + sum(map(len, self._tables)) + 1 if first is None else first

    def _make(self) -> None:
        tables, self._tables, self._rows = self._tables, [], 0
        if not tables or not self.fits:
            return
        whole = joined(self._session.protocol, tables[0].first, tables)
        try:
            for table in _pieces(whole):
                message = encode(table, self._events)
                if table.first != self._all_rows + 1 or not _comes_back(message, table):
                    self.fits = False
                    return
                self._made.append((*_span(table), message))
                self._all_rows += len(table)
                self._closed += len(table.transactions)
                self._octets += int(table.frames.length.sum())
        except ValueError:
            self.fits = False


def _pieces(table: Table) -> Iterator[Table]:
    """The table in parts of about equal length, so that none holds only what was left over."""
    count = max(1, round(len(table) / AT_ONCE))
    return table.parts([len(table) * part // count for part in range(count + 1)]) if count > 1 else iter((table,))


def _comes_back(message: bytes, table: Table) -> bool:
    """Whether whoever reads it will take it."""
    stored = StoredTable.decode(message)
    return stored is not None and stored.table(table.protocol, octets_of(table)) is not None


def _span(table: Table) -> tuple[int, int]:
    """The latest end and the earliest start, of rows, else of exchanges."""
    of = table.frames if len(table) else table.transactions
    return int(np.max(of.end)), int(np.min(of.start))
