"""Values of points on their way into a recording: as many as it has room for. Pure: messages out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial

import numpy as np

from dissectors.manifest import Dissector
from dissectors.profiles import Devices
from sniff.analysis.point_reader import PointReader, Sample
from sniff.bus.telling_rows import telling_rows, telling_transactions
from sniff.bus.thinning import Budget, Room
from sniff.bus.value_topics import ValueChannels
from sniff.engine.engine import Output
from sniff.engine.table import Table
from sniff.recording.derived_message import DerivedMessage

VALUES_AT_ONCE = 4000
MOST_REQUESTS = 1 << 14
"""Requests of which it is remembered what points they ask for."""


class RecordedValues:
    """Of one bus. Fed samples that somebody else has read, or tables: of those only that is read which has its turn."""

    def __init__(self, bus: str, dissector: Dissector, devices: Devices) -> None:
        self._devices = devices
        self._channels = ValueChannels(bus, devices)
        self._room = Room()
        self._budget = Budget(Room.LEAST, VALUES_AT_ONCE)
        self.settle(dissector)

    def settle(self, dissector: Dissector) -> None:
        """Go on with a protocol that was found."""
        self._reader = PointReader(dissector, self._devices)
        self._topics: dict[bytes, set[str]] = {}  # by the octets of a request

    def hear(self, octets: int, reads: int) -> None:
        """So much of the bus goes into the recording."""
        self._room.add(octets, reads)

    def pass_time(self, now: int) -> None:
        """It is `now` (ns)."""
        self._budget.settle(now, self._room.rate(now))

    def of_samples(self, samples: Iterable[Sample]) -> Iterator[DerivedMessage]:
        """Those that are to be written."""
        for sample in samples:
            message = self._channels.message(sample, self._budget.take)
            if message is not None:
                yield message

    def of_rows(self, rows: Table | Output) -> Iterator[DerivedMessage]:
        """The same of the values that rows hold."""
        return self.of_table(rows).rest() if isinstance(rows, Table) else self.of_samples(self._reader.add(rows))

    def of_table(self, table: Table) -> TableValues:
        """The same of a table, a stretch at a time; all of it is to be taken before what follows."""
        return TableValues(self, table)

    def of_exchange(self, asked: bytes, time: int, read: Callable[[], Output]) -> Iterator[DerivedMessage]:
        """Those of an exchange that closed at `time` (ns); it is only read where some of it may have its turn.

        `asked`: what its request asks (`stems`), by which it is known what points it tells; b"" where that is not at
        hand.
        """
        topics = self._topics.get(asked)
        if self._budget.is_spent(time) if topics is None else not self._budget.would_take(topics, time):
            return
        samples = self._reader.add(read())
        if asked and samples:
            if len(self._topics) >= MOST_REQUESTS:
                self._topics.clear()
            topics = self._topics.setdefault(asked, set())
            topics.update(topic for topic in map(self._channels.topic, samples) if self._channels.has_room(topic))
        yield from self.of_samples(samples)

    def stems(self, table: Table, places: Sequence[int]) -> list[bytes]:
        """What the requests at some places of a table ask, the same for those that ask the same; b"" for a place
        outside."""
        inside = [place for place in places if 0 <= place < len(table)]
        questions = self._reader.dissector.questions
        frames = table.frames.take(np.array(inside, np.int64))
        begins, ends = frames.offset, frames.offset + frames.length
        holes = np.full(len(inside), -1, np.int64)
        if questions is not None and questions.stems is not None:
            begins, ends, holes = questions.stems(frames, table.octets)
        octets = table.octets.tobytes()
        spans = zip(begins.tolist(), ends.tolist(), holes.tolist(), strict=True)
        told = [octets[b:e] if hole < b else octets[b:hole] + octets[hole + 1 : e] for b, e, hole in spans]
        found = iter(told)
        return [next(found) if 0 <= place < len(table) else b"" for place in places]

    def remember(self, rows: Output) -> None:
        """Rows whose exchanges are still open."""
        self._reader.remember(rows)


class TableValues:
    """A table on its way into a recording: its exchanges in the order in which its rows closed them."""

    def __init__(self, values: RecordedValues, table: Table) -> None:
        closed, last = table.transactions, max(0, len(table) - 1)
        self._values, self._table = values, table
        self._telling = telling_transactions(table)
        by = np.maximum.accumulate(np.where(table.closed_by < 0, last, table.closed_by))
        self._closed_by: list[int] = by[self._telling].tolist()
        self._stems = values.stems(table, [int(closed.request[at]) - table.first for at in self._telling])
        self._request, self._response, self._ended = closed.request, closed.response, closed.end
        self._next = 0

    def until(self, stop: int) -> Iterator[DerivedMessage]:
        """Those of exchanges that rows before `stop` closed, and that were not given before."""
        while self._next < len(self._telling) and self._closed_by[self._next] < stop:
            at, asked = self._telling[self._next], self._stems[self._next]
            self._next += 1
            yield from self._values.of_exchange(asked, int(self._ended[at]), partial(self._exchange, at))

    def rest(self) -> Iterator[DerivedMessage]:
        """All others; what is still open is remembered."""
        yield from self.until(len(self._table) + 1)
        self._values.remember(telling_rows(self._table, ()))

    def _exchange(self, at: int) -> Output:
        """An exchange that closed, with its rows as far as they are in the table."""
        table = self._table
        places = sorted(int(numbers[at]) - table.first for numbers in (self._request, self._response))
        rows = (table.row(place) for place in places if 0 <= place < len(table) and table.is_frame[place])
        return Output(tuple(rows), (table.transaction(at),))
