"""Rows and transactions of one bus in memory, as they are read: by number, by time, in words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import overload

from dissectors.frame import Frame
from dissectors.manifest import Dissector
from dissectors.meaning import Meaning
from dissectors.profiles import Devices
from dissectors.profiles.decoding import Value, decode
from dissectors.tracker import Transaction
from sniff.analysis.point_reader import TELLING, meaning_of
from sniff.analysis.wording import describe, describe_briefly
from sniff.bus.kept_tables import KeptTables
from sniff.bus.model import BusModel
from sniff.engine.engine import Row
from sniff.engine.session import Session


class KeptRows:
    """Rows in order of the wire, numbered without holes. `kept`: the rows and transactions; `model`: of their bus."""

    def __init__(self, model: BusModel) -> None:
        self.model = model
        self.kept = KeptTables()

    @property
    def session(self) -> Session:
        """Of the bus."""
        return self.model.session

    @property
    def dissector(self) -> Dissector:
        """Its protocol."""
        return self.model.dissector

    @property
    def devices(self) -> Devices:
        """Profiles by station."""
        return self.model.devices

    def __len__(self) -> int:
        return self.kept.last_no - self.kept.first_no + 1

    @property
    def rows(self) -> Sequence[Row]:
        """All rows; each is made when it is asked for."""
        return _Rows(self.kept)

    @property
    def first_no(self) -> int:
        """Number of the oldest row kept (1 when there is none)."""
        return self.kept.first_no

    @property
    def last_no(self) -> int:
        """Number of the newest row (0 when there never was one)."""
        return self.kept.last_no

    def row_at(self, time: int) -> int:
        """Number of the first row that begins at `time` (ns) or after; one after the last where there is none."""
        return self.kept.row_at(time)

    def closed_by_no(self, no: int) -> Transaction | None:
        """The transaction that closed as number `no` (from 1, without holes), None when dropped or not yet."""
        return self.kept.closing(no)

    def closed_number(self, transaction: int) -> int | None:
        """The number under which a transaction closed, by its id; None when dropped or open."""
        return self.kept.closing_of(transaction)

    @property
    def last_closed(self) -> int:
        """How many transactions have closed, with those dropped."""
        return self.kept.last_closed

    @property
    def dropped_transactions(self) -> int:
        """How many of them are no longer in memory."""
        return self.kept.first_closed - 1

    def by_no(self, no: int) -> Row | None:
        """The row of that number, None when it was dropped or never was."""
        return self.kept.row(no)

    def transaction(self, row: Row) -> Transaction | None:
        """The closed transaction that a row belongs to; None while open, and for noise."""
        if row.placement is None:
            return None
        no = self.kept.closing_of(row.placement.tx)
        return None if no is None else self.kept.closing(no)

    def partner(self, row: Row) -> int | None:
        """Number of the response to a request, of the request to a response; None when there is none."""
        transaction = self.transaction(row)
        if transaction is None:
            return None
        if transaction.request == row.no:
            return transaction.response
        return transaction.request

    def text(self, row: Row) -> str:
        """One line that says what a row is, and what that means to its device."""
        return describe(self.dissector, row, self.meaning(row))

    def brief_text(self, row: Row, room: int) -> str:
        """The same in `room` cells, where leaving out some of what it means makes it fit."""
        return describe_briefly(self.dissector, row, self.meaning(row), room)

    def meant_text(self, row: Row, room: int) -> str:
        """The same, and nothing but what it means where that is known."""
        return describe_briefly(self.dissector, row, self.meaning(row), room, raw=False)

    def meaning(self, row: Row) -> Meaning | None:
        """What is known of a row besides its octets."""
        return meaning_of(self.dissector, self.devices, row, self._request_of(row))

    def told(self, no: int) -> tuple[Value, ...]:
        """The values that the row of a number carries; none before its exchange is whole."""
        row = self.by_no(no)
        transaction = None if row is None else self.transaction(row)
        if row is None or transaction is None or transaction.verdict not in TELLING:
            return ()
        meaning = self.meaning(row)
        return () if meaning is None else decode(meaning.profile, meaning.readings)

    def answered(self, row: Row) -> dict[str, int | float | str]:
        """Fields of an answer that only its request tells."""
        fields, meaning = self.dissector.answer_fields, self.meaning(row)
        if fields is None or meaning is None or meaning.request is None or not isinstance(row.event, Frame):
            return {}
        return fields(meaning.request, row.event)

    def _request_of(self, row: Row) -> Frame | None:
        transaction = self.transaction(row)
        asked = self.by_no(transaction.request) if transaction is not None and transaction.request else None
        return asked.event if asked is not None and isinstance(asked.event, Frame) else None

    def row_marked(self, time: int) -> int | None:
        """Number of the row that a mark of that moment (ns) is about; None where it has not come yet."""
        no = self.row_at(time)
        here, before = self.by_no(no), self.by_no(no - 1)
        if here is not None and here.event.start == time:
            return no
        if before is not None and before.event.end >= time:
            return no - 1
        return no if here is not None else None


class _Rows(Sequence[Row]):
    """Rows that are made when they are asked for."""

    def __init__(self, kept: KeptTables) -> None:
        self._kept = kept

    def __len__(self) -> int:
        return self._kept.last_no - self._kept.first_no + 1

    @overload
    def __getitem__(self, at: int) -> Row: ...
    @overload
    def __getitem__(self, at: slice) -> list[Row]: ...

    def __getitem__(self, at: int | slice) -> Row | list[Row]:
        if isinstance(at, slice):
            return [self[index] for index in range(*at.indices(len(self)))]
        row = self._kept.row(self._kept.first_no + (at if at >= 0 else at + len(self)))
        if row is None:
            raise IndexError(at)
        return row
