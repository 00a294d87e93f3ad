"""Counting clean rows of a ring: what `RingObserver` adds for each of them, for many at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dissectors.bacnet.limits import T_NO_TOKEN, T_USAGE_DELAY
from dissectors.bacnet.ring_columns import RingColumns, last_of
from dissectors.columns import counted
from dissectors.histogram import add_grouped

if TYPE_CHECKING:
    from dissectors.bacnet.ring_tally import NodeTally, RingTally
    from dissectors.columns import Masks, Times

HOLD_MAX = 64
"""Longest run of data frames that is counted by itself."""

_ADDRESSES = 256


class RingCounts:
    """Clean rows [begin, end) of some columns; `count` adds them to a tally.

    What they need is in the tally: every sender, every edge of a token, who is asked (`unknown`).
    """

    def __init__(self, columns: RingColumns, begin: int, end: int) -> None:
        self._columns = columns
        self._begin = begin
        rows, before = slice(begin, end), slice(begin - 1, end - 1)
        self.source, self.destination = columns.source[rows], columns.destination[rows]
        self.token, self.poll, self.poll_reply = columns.token[rows], columns.poll[rows], columns.poll_reply[rows]
        self._data, self._answers, self._asked = columns.data[rows], columns.answers[rows], columns.asked[rows]
        self._start, self._end, self._slack = columns.start[rows], columns.end[rows], columns.slack[rows]
        self._length, self._gap, self._to_all = columns.length[rows], columns.gap[rows], columns.to_all[rows]
        self._behind_token, self._behind_poll = columns.token[before], columns.poll[before]
        self._start_before, self._slack_before = columns.start[before], columns.slack[before]
        self._source_before = columns.source[before]
        self.own = self._data & ~self._answers  # data that the holder of the token sends
        self._tokens = np.flatnonzero(self.token)
        self._edges = self.source[self._tokens] << 8 | self.destination[self._tokens]

    def unknown(self, tally: RingTally) -> int | None:
        """The first row that brings somebody or something new to a tally, counted from `begin`; None where none does.

        It must be seen by itself, in its turn.
        """
        firsts: list[int] = []
        nodes = tally.nodes
        for source in np.flatnonzero(np.bincount(self.source)).tolist():
            node = nodes.get(source)
            if node is None or not node.first:
                firsts.append(int((self.source == source).argmax()))
        for edge in np.flatnonzero(np.bincount(self._edges)).tolist():
            if (edge >> 8, edge & 0xFF) not in tally.edges:
                firsts.append(int(self._tokens[(self._edges == edge).argmax()]))
        for asked in np.flatnonzero(np.bincount(self.destination[self._asked])).tolist():
            if asked not in nodes:
                firsts.append(int((self._asked & (self.destination == asked)).argmax()))
        return min(firsts, default=None)

    def count(self, tally: RingTally, least_gap: int, hold: int, got: int | None) -> int:
        """Add them. `hold`: data frames sent on the token that is held; of the newest one behind them it is given.

        `got`: when the holder got it, None where that is not known.
        """
        tally.last = max(tally.last, int(self._end.max()))
        tally.frames += len(self._end)
        tally.octets += int(self._length.sum())
        tally.impossible += int((self._gap + self._slack_before < least_gap).sum())
        nodes = tally.nodes
        octets = np.bincount(self.source, self._length, _ADDRESSES).astype(np.int64).tolist()
        for source, last in _lasts(self.source):
            nodes[source].last = int(self._end[last])
            nodes[source].octets += octets[source]
        used = self._behind_token
        add_grouped(lambda mac: nodes[mac].use, self.source[used], self._gap[used])
        self._count_polls(tally)
        self._count_data(nodes)
        return self._count_tokens(tally, hold, got)

    # Tokens

    def _count_tokens(self, tally: RingTally, hold: int, got: int | None) -> int:
        sent = np.cumsum(self.own)
        tokens = self._tokens
        if not len(tokens):
            return hold + int(sent[-1])
        self._count_edges(tally)
        source, destination, ends = self.source[tokens], self.destination[tokens], self._end[tokens]
        before = sent[tokens]
        holds = np.diff(before, prepend=-hold)
        for (mac, many), count in counted(source, np.minimum(holds, HOLD_MAX)):
            tally.nodes[mac].holds[many] = tally.nodes[mac].holds.get(many, 0) + count
        first = int(ends[0]) if got is None else got  # nothing is known of how long the first was held
        held = np.maximum(np.diff(ends, prepend=first), 0)
        of_source = np.bincount(source, held, _ADDRESSES).astype(np.int64).tolist()
        for mac, count in _counts(source):
            tally.nodes[mac].tokens_sent += count
            tally.nodes[mac].held += of_source[mac]
        self._count_loops(tally, destination, ends)
        return int(sent[-1] - before[-1])

    def _count_edges(self, tally: RingTally) -> None:
        edges = self._edges
        pairs = [(int(edge), count) for (edge,), count in counted(edges)]
        lasts = dict(_lasts(edges))
        senders = [edge >> 8 for edge, _ in pairs]
        several: set[int] = {sender for sender in senders if senders.count(sender) > 1}
        for edge, count in pairs:
            source, destination = edge >> 8, edge & 0xFF
            one, node, row = tally.edges[source, destination], tally.nodes[source], int(self._tokens[lasts[edge]])
            one.tokens += count
            one.last = int(self._end[row])
            if source not in several:
                if node.next != destination:
                    self._turn_to(tally, source, destination, int(self._tokens[(edges == edge).argmax()]))
                one.streak += count
        for row in self._tokens[np.isin(edges >> 8, sorted(several))].tolist() if several else ():
            source, destination = int(self.source[row]), int(self.destination[row])
            if tally.nodes[source].next != destination:
                self._turn_to(tally, source, destination, row)
            tally.edges[source, destination].streak += 1

    def _turn_to(self, tally: RingTally, source: int, destination: int, row: int) -> None:
        edge = tally.edges[source, destination]
        tally.nodes[source].next, edge.since, edge.streak = destination, int(self._start[row]), 0

    def _count_loops(self, tally: RingTally, destination: Times, ends: Times) -> None:
        order = np.argsort(destination, kind="stable")
        held, times = destination[order], ends[order]
        loops = np.diff(times, prepend=0)
        again = np.append(False, held[1:] == held[:-1])
        add_grouped(lambda mac: tally.nodes[mac].loop, held[again], loops[again])
        begins = np.flatnonzero(~again)
        counts = np.diff(np.append(begins, len(held)))
        for place, count in zip(begins.tolist(), counts.tolist(), strict=True):
            node = tally.nodes[int(held[place])]
            node.tokens_received += count
            if node.got is not None:
                node.loop.add(int(times[place]) - node.got)
            node.got = node.last_token = int(times[place + count - 1])

    # Polls

    def _count_polls(self, tally: RingTally) -> None:
        nodes, polls = tally.nodes, np.flatnonzero(self.poll)
        again = self.poll & self._behind_poll & (self.source == self._source_before)
        repeated = dict(_counts(self.source[again]))
        for mac, count in _counts(self.source[polls]):
            node = nodes[mac]
            node.polls_sent += count
            node.polls_of_search += repeated.get(mac, 0) if node.tokens_sent else count
        pairs = self.source[polls] << 8 | self.destination[polls]
        for pair, last in _lasts(pairs):
            source, destination = pair >> 8, pair & 0xFF
            nodes[source].highest_polled = max(nodes[source].highest_polled, destination)
            tally.polled[source, destination] = int(self._end[polls[last]])
        polled = self.destination[polls]
        for mac, count in _counts(polled):
            if mac in nodes:
                nodes[mac].polls_received += count
        for mac, last in _lasts(polled):
            if mac in nodes:
                nodes[mac].last_polled = int(self._end[polls[last]])
        for mac, count in _counts(self.source[self.poll_reply]):
            nodes[mac].poll_replies_sent += count
        add_grouped(lambda mac: nodes[mac].poll_reply, self.source[self.poll_reply], self._gap[self.poll_reply])
        self._count_unanswered(tally, self._behind_poll & ~self.poll_reply)

    def _count_unanswered(self, tally: RingTally, gone_on: Masks) -> None:
        nodes, source = tally.nodes, self.source[gone_on]
        wasted = self._start[gone_on] - self._start_before[gone_on]
        tally.poll_waste += int(np.clip(wasted, 0, T_NO_TOKEN).sum())
        add_grouped(lambda mac: nodes[mac].poll_wait, source, self._gap[gone_on])
        for mac, count in _counts(source):
            nodes[mac].polls_unanswered += count
        waited = self._gap[gone_on] - self._slack[gone_on] > T_USAGE_DELAY
        for mac, count in _counts(source[waited]):
            nodes[mac].polls_waited += count

    # Data

    def _count_data(self, nodes: dict[int, NodeTally]) -> None:
        for mac, count in _counts(self.source[self._data]):
            nodes[mac].data_sent += count
        for mac, count in _counts(self.source[self._to_all]):
            nodes[mac].broadcasts_sent += count
        for mac, count in _counts(self.source[self._asked]):
            nodes[mac].requests_sent += count
        for mac, count in _counts(self.destination[self._asked]):
            nodes[mac].requests_received += count
        replies = self._data & self._answers
        for mac, count in _counts(self.source[replies]):
            nodes[mac].replies += count
        add_grouped(lambda mac: nodes[mac].reply, self.source[replies], self._gap[replies])


def _counts(macs: Times) -> list[tuple[int, int]]:
    """How often each address stands there."""
    counts = np.bincount(macs)
    distinct = np.flatnonzero(counts)
    return list(zip(distinct.tolist(), counts[distinct].tolist(), strict=True))


def _lasts(keys: Times) -> list[tuple[int, int]]:
    """Where each key stands last."""
    if not len(keys):
        return []
    last = last_of(keys, int(keys.max()) + 1)
    distinct = np.flatnonzero(last >= 0)
    return list(zip(distinct.tolist(), last[distinct].tolist(), strict=True))
