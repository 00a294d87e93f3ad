"""The open exchanges of an MS/TP bus: the memory of the tracker, and what time alone ends (tracker.py)."""

from __future__ import annotations

from collections import OrderedDict

from dissectors.bacnet.exchange import Exchange, Key
from dissectors.bacnet.limits import MS, T_NO_TOKEN
from dissectors.frame import Frame, Header
from dissectors.line import Timing
from dissectors.tracker import Transaction, Verdict

POSTPONED_FOR = 10_000 * MS
"""How long a postponed answer may come (APDU timeouts are 3 s and more)."""

SEGMENTS_FOR = 30_000 * MS
"""How long a further segment may come: it is sent again several times when its acknowledgement was lost."""

REMEMBERED = 256
"""Exchanges of the past that late and double answers are known by."""


class OpenExchanges:
    """One exchange may hold the bus; others wait for an answer that comes later; the last that are over are known."""

    def __init__(self, timing: Timing) -> None:
        unmeasured = 0 if timing.has_times else timing.latency  # a line of a log takes longer than its octets did
        self._gives_up_after = T_NO_TOKEN + unmeasured
        self._next = 1  # id of the next transaction
        self._waiting: Exchange | None = None  # holds the bus: an answer must come now
        self._postponed: OrderedDict[Key, Exchange] = OrderedDict()
        self._past: OrderedDict[Key, tuple[Exchange, Verdict, int]] = OrderedDict()

    def close(self) -> tuple[Transaction, ...]:
        """End of capture: what is open could still have been answered."""
        closed = []
        if self._waiting is not None:
            closed.append(self._waiting.close(Verdict.OPEN))
        closed += [exchange.close(exchange.becomes or Verdict.OPEN) for exchange in self._postponed.values()]
        self._waiting = None
        self._postponed.clear()
        return tuple(sorted(closed, key=lambda transaction: transaction.id))

    def _open(self, no: int, frame: Frame, header: Header, key: Key | None = None) -> Exchange:
        source = -1 if header.source is None else header.source
        destination = -1 if header.destination is None else header.destination
        exchange = Exchange(
            self._next,
            no,
            header.kind,
            source,
            destination,
            frame.start,
            frame.end,
            frame.slack,
            frame.octets,
            key,
            last=frame.end,
        )
        self._next += 1
        return exchange

    def _keep(self, exchange: Exchange, closed: list[Transaction]) -> None:
        assert exchange.key is not None
        older = self._postponed.pop(exchange.key, None)
        if older is not None and older is not exchange:
            closed.append(older.stopped())
        self._postponed[exchange.key] = exchange
        while len(self._postponed) > REMEMBERED:
            _, oldest = self._postponed.popitem(last=False)
            closed.append(self._stop(oldest))

    def _note_spoilt(self, source: int | None, destination: int | None) -> None:
        """A damaged frame may be the answer that its sender had postponed; where none is known, anybody's."""
        for exchange in self._postponed.values():
            if source in (None, exchange.destination) and destination in (None, exchange.source):
                exchange.spoilt = True

    # What time alone ends

    def _expire(self, now: int) -> list[Transaction]:
        """What is over by `now`, in the order in which its time was up: whoever asks in between gets the same order."""
        closed: list[Transaction] = []
        waiting, wait = self._waiting, self._gives_up_after
        over = [
            (exchange.last + (SEGMENTS_FOR if exchange.segmented else POSTPONED_FOR), key)
            for key, exchange in self._postponed.items()
            if now - exchange.last >= (SEGMENTS_FOR if exchange.segmented else POSTPONED_FOR)
        ]
        until = None if waiting is None or now - waiting.last < wait else waiting.last + wait
        if len(over) > 1:
            over.sort(key=lambda one: one[0])
        for due, key in over:
            if until is not None and waiting is not None and until <= due:
                self._let_go(waiting, closed)
                until = None
            if key in self._postponed:
                closed.append(self._stop(self._postponed.pop(key)))
        if until is not None and waiting is not None:
            self._let_go(waiting, closed)
        return closed

    def _let_go(self, waiting: Exchange, closed: list[Transaction]) -> None:
        """No answer came at once: that is no answer, but to a segment that more follow it is nothing yet."""
        if waiting.more_follows and waiting.key is not None:
            self._waiting = None
            self._keep(waiting, closed)
        else:
            closed.append(self._give_up(waiting))

    def _give_up(self, waiting: Exchange) -> Transaction:
        """Nobody answered what held the bus."""
        self._waiting = None
        if waiting.damaged:
            return self._end(waiting, Verdict.DAMAGED_REQUEST)
        silent = waiting.may_be_silent or waiting.unconfirmed
        return self._end(waiting, Verdict.DATA if silent else Verdict.NO_RESPONSE)

    def _end(self, exchange: Exchange, verdict: Verdict) -> Transaction:
        self._remember(exchange, verdict)
        return exchange.close(verdict)

    def _stop(self, exchange: Exchange) -> Transaction:
        """Nobody went on with what was postponed, or with segments."""
        transaction = exchange.stopped()
        self._remember(exchange, transaction.verdict)
        return transaction

    def _remember(self, exchange: Exchange, verdict: Verdict) -> None:
        if exchange.key is not None:
            self._past[exchange.key] = (exchange, verdict, exchange.last)
            self._past.move_to_end(exchange.key)
            while len(self._past) > REMEMBERED:
                self._past.popitem(last=False)
