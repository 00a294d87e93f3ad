"""Exchanges that bear a number: requests of a network, of which several are open at once, each answered under its own.

    request under a number ──► open ──► an answer under it             answered; after a repeat: retry
                                 │ ───► silence, or the number again   no answer; of a damaged request: damaged
    answer under a number that nobody waits for                        unasked

The same request again, while it is open, is a repeat. Bounded: the oldest of too many that are open is given up.
"""

from __future__ import annotations

from collections.abc import Hashable

from dissectors.frame import Frame, Header
from dissectors.plain_tracker import OpenRequest, closed_exchange
from dissectors.tracker import Transaction, Verdict


class NumberedExchanges:
    """The open exchanges of one connection or network. `patience`: ns that an answer may take. `most`: how many may be
    open."""

    def __init__(self, patience: int, most: int) -> None:
        self._patience, self._most = patience, most
        self._tx = 0
        self._open: dict[Hashable, OpenRequest] = {}

    def is_open(self, number: Hashable) -> bool:
        """Whether a request under this number waits for its answer."""
        return number in self._open

    def alone(self, no: int, frame: Frame, header: Header, verdict: Verdict) -> Transaction:
        """What is sent by somebody and asks nobody."""
        self._tx += 1
        return Transaction(self._tx, header.source, header.kind, no, None, verdict, frame.start, frame.end)

    def ask(self, number: Hashable, no: int, frame: Frame, header: Header) -> tuple[int, tuple[Transaction, ...]]:
        """A request: its transaction's id, and what it ends."""
        over: tuple[Transaction, ...] = ()
        last = self._open.get(number)
        if last is not None:
            over = (self._give_up(number),)
        elif len(self._open) >= self._most:
            over = (self._give_up(next(iter(self._open))),)
        self._tx += 1
        attempt, of = 1, None
        if last is not None and last.frame.octets == frame.octets:
            attempt, of = last.attempt + 1, last.of or last.id
        self._open[number] = OpenRequest(self._tx, no, frame, header, attempt, of)
        return self._tx, over

    def answer(
        self, number: Hashable, no: int, frame: Frame, header: Header, verdict: Verdict | None = None
    ) -> Transaction:
        """The exchange that an answer ends. `verdict`: where it is no plain answer."""
        asked = self._open.pop(number, None)
        if asked is None:
            self._tx += 1
            of_nobody = Verdict.UNSOLICITED
            return Transaction(
                self._tx, header.source, header.kind, None, no, of_nobody, frame.start, frame.end, error=header.error
            )
        plain = Verdict.ANSWERED if asked.attempt == 1 else Verdict.RETRY
        return closed_exchange(asked, verdict or plain, no, frame, header.error)

    def advance(self, now: int) -> tuple[Transaction, ...]:
        """Say that nothing came up to `now` (ns)."""
        late = []
        for number, asked in self._open.items():  # the oldest first
            if now - asked.frame.end <= self._patience:
                break
            late.append(number)
        return tuple(self._give_up(number) for number in late)

    def close(self) -> tuple[Transaction, ...]:
        """End of capture: answers could still have come."""
        waiting, self._open = list(self._open.values()), {}
        return tuple(closed_exchange(asked, Verdict.OPEN) for asked in waiting)

    def _give_up(self, number: Hashable) -> Transaction:
        """A request that is not answered any more. One that was damaged need not be."""
        asked = self._open.pop(number)
        return closed_exchange(asked, Verdict.NO_RESPONSE if asked.frame.ok else Verdict.DAMAGED_REQUEST)
