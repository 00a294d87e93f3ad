"""Values of points on their way into a recording: as many as it has room for. Pure: messages out."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from dissectors.columns import NONE
from dissectors.manifest import Dissector
from dissectors.profiles import Devices
from sniff.analysis.point_reader import PointReader, Sample
from sniff.bus.telling_rows import telling_rows, telling_transactions
from sniff.bus.thinning import Budget, Room
from sniff.bus.value_topics import ValueChannels, ValueMessage
from sniff.engine.engine import Output
from sniff.engine.table import Table

VALUES_AT_ONCE = 4000
MOST_REQUESTS = 4096
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
        self._budget.rate = self._room.rate(now)

    def of_samples(self, samples: Iterable[Sample]) -> Iterator[ValueMessage]:
        """Those that are to be written."""
        for sample in samples:
            message = self._channels.message(sample, self._budget.take)
            if message is not None:
                yield message

    def of_rows(self, rows: Table | Output) -> Iterator[ValueMessage]:
        """The same of the values that rows hold."""
        return self._of_table(rows) if isinstance(rows, Table) else self.of_samples(self._reader.add(rows))

    def _of_table(self, table: Table) -> Iterator[ValueMessage]:
        requests: dict[int, bytes] = {}  # by the numbers of the frames that may carry values
        transactions = []
        closed, octets = table.transactions, table.octets
        begins, lengths = table.frames.offset.tolist(), table.frames.length.tolist()
        request, response, ended = closed.request.tolist(), closed.response.tolist(), closed.end.tolist()
        for at in telling_transactions(table):
            place = request[at] - table.first
            if request[at] != NONE and 0 <= place < len(table):
                asked = octets[begins[place] : begins[place] + lengths[place]].tobytes()
                topics = self._topics.get(asked)
                if topics and not self._budget.would_take(topics, ended[at]):
                    continue
                requests[request[at]] = requests[response[at]] = asked
            transactions.append(at)
        samples = self._reader.add(telling_rows(table, transactions))
        for sample in samples:
            known = requests.get(sample.frame)
            if known is not None:
                if len(self._topics) >= MOST_REQUESTS:
                    self._topics.clear()
                self._topics.setdefault(known, set()).add(self._channels.topic(sample))
        yield from self.of_samples(samples)
