"""The stations on a bus and how each fares; mergeable."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from dissectors.frame import Frame
from dissectors.histogram import Histogram, add_grouped
from dissectors.tracker import PASSING, Passing, Transaction, Verdict
from sniff.analysis.poll import ANSWERS
from sniff.engine.engine import Row

if TYPE_CHECKING:
    from dissectors.columns import Small, TransactionColumns
    from sniff.engine.table import Table


@dataclass(slots=True)
class Node:
    """One station. Times are ns; `damaged` counts frames from it that were not good; those to it are somebody else's,
    also of a master without an address.

    `verdicts`: of requests and data to it. Tokens and polls for masters are `passed` to it instead; a token that it did
    not use is `unused`, and no request without answer. `errors`: what was wrong with answers; not with the requests,
    which are somebody else's frames.
    """

    address: int
    sent: int = 0  # frames from it
    received: int = 0  # frames to it
    damaged: int = 0
    heard: int = 0  # good frames from it, or put right: a damaged frame may name a station that there is not
    first: int | None = None
    last: int | None = None
    verdicts: Counter[Verdict] = field(default_factory=Counter)
    passed: int = 0  # tokens and polls
    unused: int = 0  # tokens of those
    kinds: Counter[str] = field(default_factory=Counter)
    errors: Counter[str] = field(default_factory=Counter)
    latency: Histogram = field(default_factory=Histogram)

    @property
    def seen(self) -> bool:
        """Whether there is a sign of it but being polled for: it sent a good frame, was asked or given a token, or
        what came in its answer to a poll was damaged."""
        return bool(self.heard or self.asked or self.unused or self.errors)

    @property
    def asked(self) -> int:
        """Requests that expected an answer from it; an answer that came late has its request among them."""
        if not self.verdicts:  # most addresses that are only polled for
            return 0
        late = min(self.verdicts[Verdict.LATE], self.verdicts[Verdict.NO_RESPONSE])
        return sum(self.verdicts[verdict] for verdict in EXPECTING) - late

    @property
    def answered(self) -> int:
        """Those of them that got what they asked for, in time."""
        return sum(self.verdicts[verdict] for verdict in ANSWERS)

    @property
    def unanswered(self) -> int:
        """Those of them that got none, not even late."""
        return max(0, self.verdicts[Verdict.NO_RESPONSE] - self.verdicts[Verdict.LATE]) if self.verdicts else 0

    def merge(self, other: Node) -> Node:
        """Both together, as a new value."""
        times = [time for time in (self.first, other.first) if time is not None]
        lasts = [time for time in (self.last, other.last) if time is not None]
        return Node(
            self.address,
            self.sent + other.sent,
            self.received + other.received,
            self.damaged + other.damaged,
            self.heard + other.heard,
            min(times, default=None),
            max(lasts, default=None),
            self.verdicts + other.verdicts,
            self.passed + other.passed,
            self.unused + other.unused,
            self.kinds + other.kinds,
            self.errors + other.errors,
            self.latency.merge(other.latency),
        )


EXPECTING = (
    Verdict.ANSWERED,
    Verdict.RETRY,
    Verdict.EXCEPTION,
    Verdict.NO_RESPONSE,
    Verdict.LATE,
    Verdict.DAMAGED_ANSWER,
)


_BEGIN = 4096
"""Rows in which most stations have spoken."""


def _first_places(held: Small, counts: Sequence[int]) -> Iterator[tuple[int, int]]:
    """Each address, ascending, and its first place; `counts`: how often each stands there."""
    import numpy as np

    present = sum(map(bool, counts))
    for most in (_BEGIN, len(held)):
        addresses, places = np.unique(held[:most], return_index=True)
        if len(addresses) == present:
            break
    return zip(addresses.tolist(), places.tolist(), strict=True)


@dataclass(slots=True)
class NodeTable:
    """All stations of one bus by address."""

    nodes: dict[int, Node] = field(default_factory=dict)

    def add_row(self, row: Row) -> None:
        """Count one frame (noise belongs to nobody)."""
        if not isinstance(row.event, Frame) or row.header is None:
            return
        placement = row.placement
        source = placement.source if placement is not None else row.header.source
        destination = placement.destination if placement is not None else row.header.destination
        for address, sends in ((source, True), (destination, False)):
            if address is None:
                continue
            node = self._node(address)
            node.sent += sends
            node.received += not sends
            node.damaged += sends and not row.event.ok
            node.heard += sends and (row.event.ok or row.event.repair is not None)
            node.first = row.event.start if node.first is None else node.first
            node.last = row.event.end

    def add_transaction(self, transaction: Transaction) -> None:
        """Count one closed transaction."""
        if transaction.station is None:
            return
        node = self._node(transaction.station)
        if transaction.is_passing:
            node.passed += 1
            node.unused += transaction.kind == Passing.TOKEN and transaction.verdict is Verdict.NO_RESPONSE
        else:
            node.verdicts[transaction.verdict] += 1
        node.kinds[transaction.kind] += 1
        if transaction.error and transaction.verdict is not Verdict.DAMAGED_REQUEST:
            node.errors[transaction.error] += 1
        if transaction.latency is not None and transaction.verdict is not Verdict.DATA:  # the use of a token is none
            node.latency.add(transaction.latency.nominal)

    def add_table(self, table: Table) -> None:
        """Count frames and transactions; the same as one after the other."""
        self._add_frames(table)
        self._add_transactions(table.transactions)

    def _add_frames(self, table: Table) -> None:
        import numpy as np

        from dissectors.columns import NONE

        frames, has_place, known = table.frames, table.placed.tx != 0, table.is_frame & table.heard
        source = np.where(has_place, table.placed.source, frames.source)
        destination = np.where(has_place, table.placed.destination, frames.destination)
        good = table.good
        whole = good | table.repaired
        seen: dict[int, list[int]] = {}
        for addresses, sends in ((source, True), (destination, False)):
            rows = np.flatnonzero(known & (addresses != NONE))
            held = addresses[rows]
            counts, bad, heard = (np.bincount(of).tolist() for of in (held, held[~good[rows]], held[whole[rows]]))
            for address, first in _first_places(held, counts):
                node = self._node(address)
                node.sent += counts[address] * sends
                node.received += counts[address] * (not sends)
                node.damaged += bad[address] if sends and address < len(bad) else 0
                node.heard += heard[address] if sends and address < len(heard) else 0
                seen.setdefault(address, []).append(int(rows[first]))
            for address, last in _first_places(held[::-1], counts):
                seen[address].append(int(rows[len(rows) - 1 - last]))
        for address, places in seen.items():
            node = self._node(address)
            node.first = int(frames.start[min(places)]) if node.first is None else node.first
            node.last = int(frames.end[max(places)])

    def _add_transactions(self, closed: TransactionColumns) -> None:
        from dissectors.columns import NONE, VERDICTS, counted

        of_station = closed.station != NONE
        if not of_station.any():
            return
        stations = closed.station[of_station]
        keys = (stations, closed.kind[of_station], closed.verdict[of_station], closed.error[of_station])
        for (address, kind, verdict, error), count in counted(*keys):
            node, name = self._node(address), closed.names[kind]
            if name in PASSING:
                node.passed += count
                node.unused += count * (name == Passing.TOKEN and VERDICTS[verdict] is Verdict.NO_RESPONSE)
            else:
                node.verdicts[VERDICTS[verdict]] += count
            node.kinds[name] += count
            if error and VERDICTS[verdict] is not Verdict.DAMAGED_REQUEST:
                node.errors[closed.names[error]] += count
        timed = of_station & (closed.latency != NONE) & (closed.verdict != VERDICTS.index(Verdict.DATA))
        add_grouped(lambda address: self._node(address).latency, closed.station[timed], closed.latency[timed])

    def merge(self, other: NodeTable) -> NodeTable:
        """Both together, as a new value."""
        merged = dict(self.nodes)
        for address, node in other.nodes.items():
            merged[address] = merged[address].merge(node) if address in merged else node
        return NodeTable(merged)

    def present(self) -> list[Node]:
        """Stations of which there is more than a poll for a possible new one: free addresses are polled too."""
        return [node for node in self if node.seen]

    def absent(self) -> list[int]:
        """Addresses that were polled for or given a token, and gave no sign."""
        return [node.address for node in self if not node.seen and node.passed]

    def __iter__(self) -> Iterator[Node]:
        return iter(sorted(self.nodes.values(), key=lambda node: node.address))

    def __len__(self) -> int:
        return len(self.nodes)

    def _node(self, address: int) -> Node:
        node = self.nodes.get(address)
        if node is None:
            node = self.nodes[address] = Node(address)
        return node
