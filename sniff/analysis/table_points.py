"""Values taken out of tables: `PointReader` for many exchanges at once. Pure.

Which exchanges tell something is asked of columns. Those of stations without a profile that are numbers and nothing
else stay columns; only for the others the two frames become objects.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dissectors.columns import NONE, VERDICTS, Masks, Numbers, Times
from dissectors.frame import Frame
from dissectors.reading_columns import HOWS, ReadingColumns
from dissectors.readings import Origin
from dissectors.tracker import PASSING, Verdict
from sniff.analysis.point_columns import PlainSamples, TableSamples, no_samples
from sniff.analysis.point_reader import ALONE, MOST_ASKED, MOST_OPEN, WHOLE, Remembered, Sample, ValuedExchange
from sniff.engine.table import Table, rows_at

if TYPE_CHECKING:
    from sniff.analysis.point_reader import PointReader

_WHOLE = np.array([verdict in WHOLE for verdict in VERDICTS])
_ALONE = np.array([verdict in ALONE for verdict in VERDICTS])
_LATE = VERDICTS.index(Verdict.LATE)
_BROADCAST = VERDICTS.index(Verdict.BROADCAST)
_READ, _REPORT = HOWS.index(Origin.READ), HOWS.index(Origin.REPORT)


def samples_of(reader: PointReader, table: Table) -> TableSamples:
    """What a reader makes of the table that follows."""
    if reader.dissector.readings is None:
        return TableSamples(no_samples(), ())
    return _Work(reader, table).run()


@dataclass(frozen=True, slots=True)
class _Side:
    """The requests or the answers of all transactions: their places in the table, and whether there is a good frame
    there, or one that is remembered from a table before. `plain`: whether the table's columns say all of it."""

    no: Times
    place: Times
    inside: Masks
    there: Masks
    plain: Masks

    @classmethod
    def of(cls, numbers: Times, table: Table, good: Masks, remembered: Sequence[int]) -> _Side:
        place = numbers - table.first
        inside = (numbers != NONE) & (place >= 0) & (place < len(table))
        place = np.where(inside, place, 0)
        if not len(table):
            inside[:] = False
        of_table = inside.copy()
        of_table[inside] = good[place[inside]]
        plain = of_table.copy()
        if table.odd:
            plain &= ~np.isin(place, list(table.odd))
        before = np.isin(numbers, remembered) if remembered else np.zeros(len(numbers), bool)
        return cls(numbers, place, of_table, of_table | before, plain)


class _Work:
    def __init__(self, reader: PointReader, table: Table) -> None:
        self._reader = reader
        self._table = table
        closed = table.transactions
        good, known = table.good, list(reader.frames)
        self._request = _Side.of(closed.request, table, good, known)
        self._response = _Side.of(closed.response, table, good, known)
        self._good = good

    def run(self) -> TableSamples:
        closed, request, response = self._table.transactions, self._request, self._response
        late = closed.verdict == _LATE
        tells = request.there & (_ALONE[closed.verdict] | (response.there & _WHOLE[closed.verdict]))
        answered = response.there & ~_ALONE[closed.verdict]
        by_columns = tells & request.plain & (response.plain | ~answered) & self._without_profile(self._station())
        done, plain = self._plain(np.flatnonzero(by_columns), answered)
        places = np.flatnonzero((tells & ~done) | late)
        others = self._others(places, late)
        self._carry()
        return TableSamples(plain, others)

    def _station(self) -> Numbers:
        """Of the transactions."""
        closed = self._table.transactions
        return np.where(closed.verdict == _BROADCAST, NONE, closed.station).astype(np.int32)

    def _without_profile(self, stations: Numbers) -> Masks:
        """Which of the stations have no profile."""
        distinct, which = np.unique(stations, return_inverse=True)
        at = self._reader.devices.at
        free = np.array([at(None if one == NONE else one) is None for one in distinct.tolist()], bool)
        without: Masks = free[which] if len(which) else np.zeros(0, bool)
        return without

    def _plain(self, chosen: Times, answered: Masks) -> tuple[Masks, PlainSamples]:
        """Of the transactions at these places: which are done by columns, and what they tell."""
        table = self._table
        done = np.zeros(len(table.transactions), bool)
        make = self._reader.dissector.reading_columns
        if make is None or not len(chosen):
            return done, no_samples()
        asked_at, has_answer = self._request.place[chosen], answered[chosen]
        answered_at = np.where(has_answer, self._response.place[chosen], asked_at)
        read: ReadingColumns = make(
            table.frames.take(asked_at), table.frames.take(answered_at), has_answer, table.octets
        )
        station = self._station()[chosen[read.exchange]]
        if read.told is not None:
            described = np.zeros(len(chosen), bool)
            described[read.exchange[~self._without_profile(read.told.station)]] = True
            read = read.without(described)
            station = read.told.station if read.told is not None else station
        done[chosen[read.done]] = True
        of = read.exchange
        carrier = np.where((read.how == _READ) | (read.how == _REPORT), answered_at[of], asked_at[of])
        return done, PlainSamples(
            chosen[of],
            table.frames.end[answered_at[of]],
            station,
            carrier + table.first,
            read.space,
            read.address,
            read.raw,
            read.how,
            read.spaces,
            read.told,
        )

    def _others(self, places: Times, late: Masks) -> list[tuple[int, Sample]]:
        """What the transactions at these places tell, and whatever may be asked for later."""
        reader, closed = self._reader, self._table.transactions
        asks = np.array([name not in PASSING for name in closed.names], bool)
        asked = np.flatnonzero(self._request.there & asks[closed.kind])
        begin, found = 0, []
        exchanges: list[tuple[int, ValuedExchange]] = []
        lates = set(places[late[places]].tolist())
        frames = self._frames(places)
        for place in places.tolist():
            request = frames.get(self._request.no[place]) if self._request.there[place] else None
            transaction = closed.transaction(place)
            if place in lates:
                end = int(np.searchsorted(asked, place, side="right"))
                self._remember(asked[begin:end])
                begin = end
                before = reader.asked.get(transaction.of) if transaction.of is not None else None
                if before is not None:
                    request = before
                    reader.ask(transaction.id, before)
            response = frames.get(self._response.no[place]) if self._response.there[place] else None
            if request is None or (response is None and not _ALONE[closed.verdict[place]]):
                continue
            exchanges.append(
                (place, ValuedExchange(transaction, request, None if _ALONE[closed.verdict[place]] else response))
            )
        self._remember(asked[begin:])
        for place, exchange in exchanges:
            found += [(place, sample) for sample in reader.samples(exchange)]
        return found

    def _frames(self, places: Times) -> dict[int, Remembered]:
        """The frames of these transactions, by number."""
        held: dict[int, Remembered] = {}
        for side in (self._request, self._response):
            inside = side.place[places[side.inside[places]]].tolist()
            for row in rows_at(self._table, inside):
                if isinstance(row.event, Frame):
                    held[row.no] = Remembered(row.no, row.event)
            for no in side.no[places[side.there[places] & ~side.inside[places]]].tolist():
                held[no] = Remembered(no, self._reader.frames[no])
        return held

    def _remember(self, places: Times) -> None:
        """Requests that answers may still come for, of the transactions at these places."""
        newest = places[-MOST_ASKED:]
        frames, ids = self._frames(newest), self._table.transactions.id
        for place in newest.tolist():
            request = frames.get(int(self._request.no[place]))
            if request is not None:
                self._reader.ask(int(ids[place]), request)

    def _carry(self) -> None:
        """Keep the good frames whose transactions have not closed, forget those that were asked for."""
        frames, table = self._reader.frames, self._table
        for side in (self._request, self._response):
            for no in side.no[side.there & ~side.inside].tolist():
                frames.pop(no, None)
        tx = table.placed.tx
        open_ones = np.flatnonzero(self._good & (tx > 0) & ~np.isin(tx, table.transactions.id))
        for row in rows_at(table, open_ones[-MOST_OPEN:].tolist()):
            if isinstance(row.event, Frame):
                frames[row.no] = row.event
        while len(frames) > MOST_OPEN:
            frames.popitem(last=False)
