"""Echoes of requests: whether something on the line gives them back. Pure.

A copy directly behind its request is an echo: no master repeats so soon. Where reads come so late that nobody knows how
soon it came, a master that repeats looks the same, as long as nobody answers: only requests that are answered behind
their copy tell, since no master repeats what is about to be answered, time and again.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from dissectors.findings import Finding, Severity, Tally, counted
from dissectors.line import MS
from dissectors.tracker import Passing, Transaction, Verdict
from sniff.analysis.line_rules import LINE_RULES as RULES

if TYPE_CHECKING:
    from dissectors.columns import TransactionColumns

ECHOES_LEAST = 3
"""Echoes from which on a repeater or converter is likely, where half of the requests have one."""

TIMELESS = 50 * MS
"""Where reads may come so late, their times do not tell an echo from a repeat."""

_ANSWERED = (Verdict.ANSWERED, Verdict.EXCEPTION, Verdict.RETRY)
_PENDING = 64


class EchoesHeard:
    """Counts of one bus. `latency`: ns that octets may be held back."""

    def __init__(self, latency: int) -> None:
        self._is_timed = latency < TIMELESS
        self._echoes = Tally()
        self._copies = 0  # of them those of answers
        self._asked = self._answered = 0
        self._tokens = 0  # of what asked
        self._tokens_return = False  # whether a protocol tells copies of them as echoes
        self._pending: dict[int, None] = {}  # requests with an echo that are still open, by transaction

    def settle(self, transaction: Transaction) -> None:
        """Take a transaction that closed."""
        if transaction.verdict is Verdict.ECHO:
            self._add(transaction.start, transaction.request, transaction.response, transaction.of)
            self._tokens_return |= transaction.kind == Passing.TOKEN
        elif transaction.request is not None:
            self._asked += 1
            self._tokens += transaction.kind == Passing.TOKEN
            self._close(transaction.id, transaction.verdict in _ANSWERED)

    def settle_many(self, closed: TransactionColumns) -> None:
        """Take transactions that closed, in their order."""
        import numpy as np

        from dissectors.columns import NONE, VERDICTS

        is_echo = closed.verdict == VERDICTS.index(Verdict.ECHO)
        asks = (closed.request != NONE) & ~is_echo
        is_token = np.array([name == Passing.TOKEN for name in closed.names])[closed.kind]
        self._asked += int(asks.sum())
        self._tokens += int((asks & is_token).sum())
        self._tokens_return |= bool((is_echo & is_token).any())
        if not self._pending and not is_echo.any():
            return
        is_answered = np.isin(closed.verdict, [VERDICTS.index(one) for one in _ANSWERED])
        for place in np.flatnonzero(is_echo | asks).tolist():
            if is_echo[place]:
                told = (int(each[place]) for each in (closed.request, closed.response, closed.of))
                self._add(int(closed.start[place]), *(None if no == NONE else no for no in told))
            else:
                self._close(int(closed.id[place]), bool(is_answered[place]))

    def found(self) -> Finding | None:
        """What there is to say of them."""
        count = self._echoes.count - self._copies
        asked = self._asked if self._tokens_return else self._asked - self._tokens
        if not self._echoes.count:
            return None
        words = f"{count} of {counted(asked, 'request')} came twice, the copy directly behind"
        if count > asked:  # several copies of one, or of some that are still open
            words = f"{counted(count, 'request')} came directly behind the same request"
        if self._copies:
            answers = f"{counted(self._copies, 'answer')} came twice"
            words = f"{words}; {answers}" if count else f"{answers}, the copy directly behind"
        is_told = self._is_timed or self._answered >= ECHOES_LEAST
        often = (most := max(count, self._copies)) >= ECHOES_LEAST and 2 * most >= asked
        if not is_told:
            words += "; how soon, is not known, and a master that repeats would look the same"
        return self._echoes.found(RULES["LN205"], "bus", words, Severity.WARNING if often and is_told else None)

    def _add(self, start: int, request: int | None, response: int | None, of: int | None) -> None:
        self._echoes.add(start, response if request is None else request)
        self._copies += request is None
        if of is not None and len(self._pending) < _PENDING:
            self._pending[of] = None

    def _close(self, transaction: int, is_answered: bool) -> None:
        if transaction in self._pending:
            del self._pending[transaction]
            self._answered += is_answered
