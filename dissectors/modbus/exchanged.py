"""Regular exchanges (`regular_exchanges.py`) as lists, for those who look at them one by one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

from dissectors.frame import Frame
from dissectors.modbus.asked import AskedRequest
from dissectors.modbus.response_groups import AnsweredRequest
from dissectors.modbus.station_record import Key
from dissectors.tracker import Interval, Transaction

if TYPE_CHECKING:
    from dissectors.columns import TransactionColumns
    from dissectors.modbus.regular_exchanges import Adus, Regular
    from dissectors.row_columns import RowColumns


@dataclass(frozen=True, slots=True)
class Exchanged:
    """Regular exchanges as lists, which a loop reads faster than arrays, by place among them.

    `octets`: unit and PDU of all frames; those of a request stand in [begin, end), of an answer in [answer_begin,
    answer_end). `request`, `last`: rows. `copy`: whether the answer says what the request said. Times and readings: ns.
    """

    rows: RowColumns
    found: Regular
    closed: TransactionColumns
    octets: bytes
    copy: list[bool]
    request: list[int]
    last: list[int]
    begin: list[int]
    end: list[int]
    answer_begin: list[int]
    answer_end: list[int]
    unit: list[int]
    kind: list[int]
    address: list[int]
    became: list[int]
    started: list[int]
    ended: list[int]
    low: list[int]
    nominal: list[int]
    high: list[int]

    @classmethod
    def of(cls, rows: RowColumns, found: Regular, adus: Adus) -> Self:
        """Of some rows."""
        request, last = found.request, found.request + found.answered
        closed = rows.transactions.take(found.transaction)
        ends = adus.offset + adus.length
        columns = (
            request,
            last,
            adus.offset[request],
            ends[request],
            adus.offset[last],
            ends[last],
            closed.station,
            rows.frames.kind[request],
            rows.frames.address[request],
            found.became,
            closed.start,
            closed.end,
            closed.least,
            closed.latency,
            closed.most,
        )
        octets = adus.octets.tobytes()
        same = found.answered & ~found.refused & (adus.length[request] == adus.length[last])
        copies = [False] * len(found)
        for at in np.flatnonzero(same).tolist():
            asked, came, size = int(columns[2][at]), int(columns[4][at]), int(adus.length[request[at]])
            copies[at] = octets[asked : asked + size] == octets[came : came + size]
        return cls(rows, found, closed, octets, copies, *(column.tolist() for column in columns))

    def said(self, at: int) -> bytes:
        """Unit and PDU of a request."""
        return self.octets[self.begin[at] : self.end[at]]

    def answer(self, at: int) -> bytes:
        """Unit and PDU of an answer."""
        return self.octets[self.answer_begin[at] : self.answer_end[at]]

    def key(self, at: int) -> Key:
        """What a request asks for, as a poll list has it."""
        address = self.address[at]
        return self.rows.frames.names[self.kind[at]], None if address < 0 else address

    def asked(self, at: int) -> AskedRequest:
        """A request as the rules see it."""
        row = self.rows.row(self.request[at])
        assert isinstance(row.event, Frame)
        assert row.header is not None
        return AskedRequest(row.no, row.event, row.header, self.said(at))

    def transaction(self, at: int) -> Transaction:
        """As it closed."""
        return self.rows.transaction(int(self.found.transaction[at]))

    def answered(self, at: int) -> AnsweredRequest:
        """An answer, to be compared with others."""
        latency = Interval(self.nominal[at], self.low[at], self.high[at])
        return AnsweredRequest(self.rows.first + self.last[at], self.ended[at], latency, self.answer(at))
