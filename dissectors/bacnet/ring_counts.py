"""Counting clean rows of a ring: what `MstpRingObserver` adds for each of them, for many at once.

What an observer asks for while it sees a single row (when a station got its token last, to whom it passed it …) is true
at once; what only adds up is added at the end of a table, for all runs of clean rows together.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from dissectors.bacnet.limits import T_NO_TOKEN, T_USAGE_DELAY
from dissectors.bacnet.ring_window import Happening
from dissectors.columns import counted
from dissectors.histogram import add_grouped

if TYPE_CHECKING:
    from collections.abc import Callable

    from dissectors.bacnet.ring_columns import RingColumns
    from dissectors.bacnet.ring_tally import RingTally
    from dissectors.columns import Masks, Times

HOLD_MAX = 64
"""Longest run of data frames that is counted by itself."""

_ADDRESSES = 256
_MANY = 2000
"""Entries from which on arrays are faster than dictionaries."""


class RingCounts:
    """Runs of clean rows of a table on their way into a tally."""

    def __init__(self, columns: RingColumns, tally: RingTally, least_gap: int) -> None:
        self._columns, self._tally, self._least_gap = columns, tally, least_gap
        self._begins: list[int] = []
        self._ends: list[int] = []
        self._own = columns.data & ~columns.answers  # data that the holder of the token sends
        self._sent = np.cumsum(self._own)
        self._tokens = np.flatnonzero(columns.token)
        self._edges = columns.source[self._tokens] << 8 | columns.destination[self._tokens]
        self._before_same = _before_same(columns.destination[self._tokens], self._tokens)
        self._polls = np.flatnonzero(columns.poll)
        self._pairs = columns.source[self._polls] << 8 | columns.destination[self._polls]
        self._asked, self._replies = np.flatnonzero(columns.asked), np.flatnonzero(columns.poll_reply)
        self._asked_whom, self._replied = columns.destination[self._asked], columns.source[self._replies]
        self._answers = np.flatnonzero(columns.answers & columns.data)
        self._answered = columns.source[self._answers]
        self._polling = self._pairs >> 8
        self._known: tuple[set[int], ...] = (set(), set(), set(), set(), set(), set())
        # what the first token of a run says, by station
        self._loops: list[tuple[int, int, int]] = []  # with its place
        self._holds: list[tuple[int, int]] = []
        self._held: list[tuple[int, int]] = []

    def unknown(self, begin: int, end: int) -> int:
        """The first row that brings somebody or something new to the tally; `end` where none does.

        It must be seen by itself, in its turn: a sender, a way of the token, who is asked or answers, polls or answers
        a poll.
        """
        columns, nodes, edges = self._columns, self._tally.nodes, self._tally.edges

        def polls(mac: int) -> bool:
            node = nodes.get(mac)
            return node is not None and bool(node.polls_sent and node.tokens_sent)

        is_known: tuple[Callable[[int], object], ...] = (
            lambda mac: mac in nodes and nodes[mac].first,
            lambda edge: (edge >> 8, edge & 0xFF) in edges,
            lambda mac: mac in nodes,
            polls,
            lambda mac: mac in nodes and nodes[mac].poll_replies_sent,
            lambda mac: mac in nodes and nodes[mac].replies,
        )
        keyed = (
            (np.arange(begin, end), columns.source[begin:end]),
            self._of(self._tokens, self._edges, begin, end),
            self._of(self._asked, self._asked_whom, begin, end),
            self._of(self._polls, self._polling, begin, end),
            self._of(self._replies, self._replied, begin, end),
            self._of(self._answers, self._answered, begin, end),
        )
        firsts: list[int] = []
        for (places, keys), known, ask in zip(keyed, self._known, is_known, strict=True):
            for key in _distinct(keys) - known:
                if ask(key):
                    known.add(key)
                else:
                    firsts.append(int(places[(keys == key).argmax()]))
        return min(firsts, default=end)

    def _of(self, places: Times, keys: Times, begin: int, end: int) -> tuple[Times, Times]:
        first, beyond = np.searchsorted(places, (begin, end)).tolist()
        return places[first:beyond], keys[first:beyond]

    def take(self, begin: int, end: int, hold: int, got: int | None) -> int:
        """Take clean rows, in which nothing is unknown.

        `hold`: data frames sent on the token that is held; that of the newest one behind the rows is given. `got`: when
        the holder got it, None where that is not known.
        """
        columns, tally = self._columns, self._tally
        self._begins.append(begin)
        self._ends.append(end)
        tally.last = max(tally.last, int(columns.end[begin:end].max()))
        for mac, time in _lasts(columns.source[begin:end], columns.end[begin:end]).items():
            tally.nodes[mac].last = time
        self._poll(begin, end)
        sent, before = int(self._sent[end - 1]), int(self._sent[begin - 1])
        first, beyond = np.searchsorted(self._tokens, (begin, end)).tolist()
        if first == beyond:
            return hold + sent - before
        row, newest = int(self._tokens[first]), int(self._tokens[beyond - 1])
        source = int(columns.source[row])
        self._holds.append((source, hold + int(self._sent[row]) - before))
        if got is not None:
            self._held.append((source, int(columns.end[row]) - got))
        self._pass(first, beyond, begin)
        return sent - int(self._sent[newest])

    def _poll(self, begin: int, end: int) -> None:
        tally, columns = self._tally, self._columns
        places, pairs = self._of(self._polls, self._pairs, begin, end)
        ends = columns.end[places]
        for pair, time in _lasts(pairs, ends).items():
            source, destination = pair >> 8, pair & 0xFF
            tally.polled[source, destination] = time
            tally.nodes[source].highest_polled = max(tally.nodes[source].highest_polled, destination)
        counts = np.bincount(pairs & 0xFF, minlength=_ADDRESSES)
        for mac, time in _lasts(pairs & 0xFF, ends).items():
            if mac in tally.nodes:  # what was polled before it was heard is counted nowhere
                tally.nodes[mac].last_polled = time
                tally.nodes[mac].polls_received += int(counts[mac])

    def _pass(self, first: int, beyond: int, begin: int) -> None:
        """Tokens `first` … `beyond` of all, in a run that begins with row `begin`."""
        tally, some = self._tally, slice(first, beyond)
        edges, ends = self._edges[some], self._columns.end[self._tokens[some]]
        new = np.flatnonzero(self._before_same[some] < begin)
        places = self._tokens[some][new].tolist()
        for place, edge, time in zip(places, edges[new].tolist(), ends[new].tolist(), strict=True):
            got = tally.nodes[edge & 0xFF].got
            if got is not None:
                self._loops.append((edge & 0xFF, time - got, place))
        for mac, time in _lasts(edges & 0xFF, ends).items():
            tally.nodes[mac].got = tally.nodes[mac].last_token = time
        for edge, time in _lasts(edges, ends).items():
            tally.edges[edge >> 8, edge & 0xFF].last = time
        self._go_on(edges, first)

    def _go_on(self, edges: Times, first: int) -> None:
        """How often stations have passed the token to the same one since they did to another."""
        tally = self._tally
        counts = Counter(edges.tolist()) if len(edges) <= _MANY else {edge: n for (edge,), n in counted(edges)}
        ways = Counter(edge >> 8 for edge in counts)
        for edge, count in counts.items():
            source, destination = edge >> 8, edge & 0xFF
            if ways[source] == 1:
                if tally.nodes[source].next != destination:
                    self._turn_to(source, destination, first + int((edges == edge).argmax()))
                tally.edges[source, destination].streak += count
        several = [source for source, count in ways.items() if count > 1]
        for at in np.flatnonzero(np.isin(edges >> 8, several)).tolist() if several else ():
            source, destination = int(edges[at]) >> 8, int(edges[at]) & 0xFF
            if tally.nodes[source].next != destination:
                self._turn_to(source, destination, first + at)
            tally.edges[source, destination].streak += 1

    def _turn_to(self, source: int, destination: int, token: int) -> None:
        edge = self._tally.edges[source, destination]
        edge.since, edge.streak = int(self._columns.start[self._tokens[token]]), 0
        self._tally.nodes[source].next = destination

    # What only adds up

    def add_up(self) -> None:
        """Add all that was taken."""
        if not self._begins:
            return
        columns, tally = self._columns, self._tally
        begins, ends = np.array(self._begins), np.array(self._ends)
        taken: Masks = np.zeros(len(columns), bool)
        for begin, end in zip(self._begins, self._ends, strict=True):
            taken[begin:end] = True
        rows = np.flatnonzero(taken)
        tally.frames += len(rows)
        tally.octets += int(columns.length[rows].sum())
        tally.impossible += int((columns.gap[rows] + columns.slack[rows - 1] < self._least_gap).sum())
        octets = np.bincount(columns.source[rows], columns.length[rows], _ADDRESSES)
        for mac in np.flatnonzero(octets).tolist():
            tally.nodes[mac].octets += int(octets[mac])
        used = rows[columns.token[rows - 1]]
        add_grouped(lambda mac: tally.nodes[mac].use, columns.source[used], columns.gap[used])
        self._note(Happening.USE, used, columns.source[used], columns.gap[used])
        tokens = self._tokens[taken[self._tokens]]
        self._add_tokens(tokens, np.repeat(begins, ends - begins)[np.searchsorted(rows, tokens)], taken)
        self._add_polls(rows)
        self._add_data(rows)

    def _add_tokens(self, tokens: Times, begins: Times, taken: Masks) -> None:
        """`begins`: of the run of each."""
        columns, nodes = self._columns, self._tally.nodes
        source, destination = columns.source[tokens], columns.destination[tokens]
        self._count("tokens_sent", source)
        self._count("tokens_received", destination)
        self._note(Happening.RECEIVED, tokens, destination)
        self._note(Happening.PASSED, tokens, source, destination)
        for (edge,), count in counted(source << 8 | destination):
            self._tally.edges[edge >> 8, edge & 0xFF].tokens += count
        same = self._before_same[taken[self._tokens]]
        again = same >= begins
        values = columns.end[tokens[again]] - columns.end[same[again]]
        loops, at_begin = _with(destination[again], values, [loop[:2] for loop in self._loops]), self._loops
        add_grouped(lambda mac: nodes[mac].loop, *loops)
        places = np.concatenate([tokens[again], np.array([place for *_, place in at_begin], np.int64)])
        self._note(Happening.LOOP, places, *loops)
        again = tokens[:-1] >= begins[1:]
        now, before = tokens[1:][again], tokens[:-1][again]
        macs, holds = _with(columns.source[now], self._sent[now] - self._sent[before], self._holds)
        for (mac, many), count in counted(macs, np.minimum(holds, HOLD_MAX)):
            nodes[mac].holds[many] = nodes[mac].holds.get(many, 0) + count
        macs, held = _with(columns.source[now], columns.end[now] - columns.end[before], self._held)
        sums = np.bincount(macs, np.maximum(held, 0), _ADDRESSES)
        for mac in np.flatnonzero(sums).tolist():
            nodes[mac].held += int(sums[mac])

    def _add_polls(self, rows: Times) -> None:
        columns, nodes = self._columns, self._tally.nodes
        polls = rows[columns.poll[rows]]
        source = columns.source[polls]
        self._count("polls_sent", source)
        again = columns.poll[polls - 1] & (columns.source[polls - 1] == source)
        self._count("polls_of_search", source[again])
        replies = rows[columns.poll_reply[rows]]
        self._count("poll_replies_sent", columns.source[replies])
        add_grouped(lambda mac: nodes[mac].poll_reply, columns.source[replies], columns.gap[replies])
        gone_on = rows[columns.poll[rows - 1] & ~columns.poll_reply[rows]]
        wasted = columns.start[gone_on] - columns.start[gone_on - 1]
        wasted = np.clip(wasted, 0, T_NO_TOKEN)
        self._tally.poll_waste += int(wasted.sum())
        source, waited = columns.source[gone_on], columns.gap[gone_on]
        add_grouped(lambda mac: nodes[mac].poll_wait, source, waited)
        self._count("polls_unanswered", source)
        self._note(Happening.UNANSWERED, gone_on, source)
        self._note(Happening.WASTED, gone_on, source, wasted)
        self._count("polls_waited", source[waited - columns.slack[gone_on] > T_USAGE_DELAY])

    def _add_data(self, rows: Times) -> None:
        columns, nodes = self._columns, self._tally.nodes
        data = rows[columns.data[rows]]
        self._count("data_sent", columns.source[data])
        self._count("broadcasts_sent", columns.source[data[columns.to_all[data]]])
        asked = data[columns.asked[data]]
        self._count("requests_sent", columns.source[asked])
        self._count("requests_received", columns.destination[asked])
        replies = data[columns.answers[data]]
        self._count("replies", columns.source[replies])
        add_grouped(lambda mac: nodes[mac].reply, columns.source[replies], columns.gap[replies])

    def _note(self, what: Happening, places: Times, macs: Times, values: Times | None = None) -> None:
        if self._tally.journal is not None:
            self._tally.journal.note_many(what, self._columns.rows.first + places, macs, values)

    def _count(self, what: str, macs: Times) -> None:
        """One more of `what` for each time that an address stands there."""
        counts = np.bincount(macs)
        for mac in np.flatnonzero(counts).tolist():
            node = self._tally.nodes[mac]
            setattr(node, what, getattr(node, what) + int(counts[mac]))


def _before_same(keys: Times, places: Times) -> Times:
    """The place before each with the same key; -1 for the first."""
    order = np.argsort(keys, kind="stable")
    held, before = keys[order], np.full(len(keys), -1, np.int64)
    same = np.flatnonzero(held[1:] == held[:-1])
    before[order[same + 1]] = places[order[same]]
    return before


def _with(macs: Times, values: Times, more: list[tuple[int, int]]) -> tuple[Times, Times]:
    """The same and some more."""
    return (
        np.concatenate([macs, np.array([mac for mac, _ in more], np.int64)]),
        np.concatenate([values, np.array([value for _, value in more], np.int64)]),
    )


def _distinct(keys: Times) -> set[int]:
    return set(keys.tolist()) if len(keys) <= _MANY else set(np.flatnonzero(np.bincount(keys)).tolist())


def _lasts(keys: Times, values: Times) -> dict[int, int]:
    """The last value of each key."""
    if len(keys) <= _MANY:
        return dict(zip(keys.tolist(), values.tolist(), strict=True))
    last = np.full(int(keys.max()) + 1, -1, np.int64)
    last[keys] = np.arange(len(keys))
    distinct = np.flatnonzero(last >= 0)
    return dict(zip(distinct.tolist(), values[last[distinct]].tolist(), strict=True))
