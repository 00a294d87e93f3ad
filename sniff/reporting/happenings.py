"""Happenings that no statistic holds: what happened to the line, and what troubles each station."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from dissectors.tracker import Transaction, Verdict
from sniff.engine.engine import Output
from sniff.engine.session import LineEvent, Session
from sniff.reporting.numbers import Happening, seconds_since

if TYPE_CHECKING:
    from sniff.engine.table import Table

HAPPENINGS_SHOWN = 200
GOOD = frozenset((Verdict.ANSWERED, Verdict.BROADCAST, Verdict.DATA, Verdict.OPEN, Verdict.UNDECIDED))


class Happenings:
    """`happenings`: the first of them; `left_out`: how many more; `trouble`: by station, how often what went wrong."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.happenings: list[Happening] = []
        self.left_out = 0
        self.trouble: dict[int, Counter[str]] = {}

    def add(self, output: Output) -> None:
        """Count transactions that did not go well."""
        for transaction in output.transactions:
            self._count(transaction)

    def add_table(self, table: Table) -> None:
        """The same of many."""
        import numpy as np

        from dissectors.columns import VERDICTS

        ill = np.array([verdict not in GOOD for verdict in VERDICTS])[table.transactions.verdict]
        for place in np.flatnonzero(ill).tolist():
            self._count(table.transaction(place))

    def _count(self, transaction: Transaction) -> None:
        if transaction.station is not None and transaction.verdict not in GOOD:
            self.trouble.setdefault(transaction.station, Counter())[_trouble(transaction)] += 1

    def add_line_event(self, event: LineEvent) -> None:
        """Keep the first of them."""
        if len(self.happenings) < HAPPENINGS_SHOWN:
            at = seconds_since(self._session.started, event.moment)
            self.happenings.append(Happening(at, event.kind.value, event.text, event.number))
        else:
            self.left_out += 1

    def merge(self, later: Happenings) -> Happenings:
        """Both together, as a new value; `later` is of the same capture."""
        whole = Happenings(self._session)
        both = self.happenings + later.happenings
        whole.happenings = both[:HAPPENINGS_SHOWN]
        whole.left_out = self.left_out + later.left_out + len(both) - len(whole.happenings)
        for part in (self, later):
            for station, kinds in part.trouble.items():
                whole.trouble.setdefault(station, Counter()).update(kinds)
        return whole


def _trouble(transaction: Transaction) -> str:
    """What kind of trouble: an exception by its name, else how the exchange ended."""
    if transaction.verdict is Verdict.EXCEPTION and transaction.error:
        return transaction.error
    if transaction.is_passing and transaction.verdict is Verdict.NO_RESPONSE:
        return "token unused"
    return transaction.verdict.words
