"""A filter as it is carried out: what columns say of many rows first, and rows only where they must be looked at.

Of each row a test says yes, no, or that the row has to be asked. `masks` gives two masks: rows that are surely
accepted, and those that may be. Where both agree nobody makes a row.
"""

from __future__ import annotations

import operator
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

from dissectors.tracker import Transaction
from sniff.engine.engine import Row

if TYPE_CHECKING:
    from dissectors.columns import Masks
    from sniff.engine.table import Table
    from sniff.filter.columns import Closed


class TestNode(Protocol):
    """A test of rows."""

    def test(self, row: Row, transaction: Transaction | None) -> bool:
        """Whether a row is accepted."""
        ...

    def masks(self, table: Table, closed: Closed | None) -> tuple[Masks, Masks] | None:
        """The same of many."""
        ...

    def lines(self, indent: str) -> Iterator[str]:
        """How it is carried out, in words."""
        ...

    @property
    def in_columns(self) -> bool:
        """Whether columns say anything of it."""
        ...

    @property
    def of_closing(self) -> bool:
        """Whether it asks what became of the row."""
        ...

    @property
    def fixed(self) -> bool | None:
        """The answer, where it is the same of every row."""
        ...


@dataclass(frozen=True, slots=True)
class Leaf:
    """One question. `columns`: what columns say of it; `words`: as it was understood; `fixed`: the answer, where it is
    the same of every row."""

    ask: Callable[[Row, Transaction | None], bool]
    columns: Callable[[Table, Closed | None], tuple[Masks, Masks] | None] | None
    words: str
    of_closing: bool = False
    fixed: bool | None = None

    def test(self, row: Row, transaction: Transaction | None) -> bool:
        """Ask the row."""
        return self.ask(row, transaction)

    def masks(self, table: Table, closed: Closed | None) -> tuple[Masks, Masks] | None:
        """Ask the columns."""
        return None if self.columns is None else self.columns(table, closed)

    @property
    def in_columns(self) -> bool:
        """Whether columns say anything of it."""
        return self.columns is not None

    def lines(self, indent: str) -> Iterator[str]:
        """One line."""
        where = "row by row" if self.columns is None else "columns of exchanges" if self.of_closing else "columns"
        yield f"{indent}{self.words}    [{where}]"


@dataclass(frozen=True, slots=True)
class Opposite:
    """Not that."""

    inner: TestNode

    def test(self, row: Row, transaction: Transaction | None) -> bool:
        """Ask the row."""
        return not self.inner.test(row, transaction)

    def masks(self, table: Table, closed: Closed | None) -> tuple[Masks, Masks] | None:
        """Surely, where the other may not be."""
        said = self.inner.masks(table, closed)
        if said is None:
            return None
        sure = ~said[1]
        return sure, sure if said[0] is said[1] else ~said[0]

    @property
    def in_columns(self) -> bool:
        """As the other."""
        return self.inner.in_columns

    @property
    def of_closing(self) -> bool:
        """As the other."""
        return self.inner.of_closing

    @property
    def fixed(self) -> bool | None:
        """The other answer."""
        return None if self.inner.fixed is None else not self.inner.fixed

    def lines(self, indent: str) -> Iterator[str]:
        """What is not to be."""
        yield f"{indent}not"
        yield from self.inner.lines(f"{indent}  ")


@dataclass(frozen=True, slots=True)
class Several:
    """Tests joined; the cheap ones first. `operator`: "&&", "||", "^^"."""

    operator: str
    parts: Sequence[TestNode]

    def test(self, row: Row, transaction: Transaction | None) -> bool:
        """Ask the row."""
        said = (part.test(row, transaction) for part in self.parts)
        if self.operator == "&&":
            return all(said)
        return any(said) if self.operator == "||" else sum(said) % 2 == 1

    def masks(self, table: Table, closed: Closed | None) -> tuple[Masks, Masks] | None:
        """What the parts say together, as far as columns say it."""
        whole: tuple[Masks, Masks] | None = None
        unsaid = False
        for part in self.parts:
            said = part.masks(table, closed)
            if said is None:
                unsaid = True
            elif whole is None:
                whole = said
            elif self.operator in ("&&", "||"):
                join = operator.and_ if self.operator == "&&" else operator.or_
                sure = join(whole[0], said[0])
                exact = whole[0] is whole[1] and said[0] is said[1]
                whole = sure, sure if exact else join(whole[1], said[1])
            else:
                (sure, may), (also_sure, also_may) = whole, said
                whole = (sure & ~also_may) | (also_sure & ~may), (may & ~also_sure) | (also_may & ~sure)
        if whole is None or not unsaid:
            return whole
        if self.operator == "&&":  # of what was not said anything may be
            return whole[0] & False, whole[1]
        return (whole[0], whole[1] | True) if self.operator == "||" else None

    @property
    def in_columns(self) -> bool:
        """Whether columns say anything of any part."""
        if self.operator == "^^":
            return all(part.in_columns for part in self.parts)
        return any(part.in_columns for part in self.parts)

    @property
    def of_closing(self) -> bool:
        """Whether any part asks for it."""
        return any(part.of_closing for part in self.parts)

    @property
    def fixed(self) -> bool | None:
        """What the parts say that are the same of every row, where that decides."""
        said = [part.fixed for part in self.parts]
        deciding = {"&&": False, "||": True}.get(self.operator)
        if deciding is not None and deciding in said:
            return deciding
        return None if None in said else not deciding if deciding is not None else sum(map(bool, said)) % 2 == 1

    def lines(self, indent: str) -> Iterator[str]:
        """The parts."""
        yield f"{indent}{ {'&&': 'all of', '||': 'any of', '^^': 'an odd number of'}[self.operator] }"
        for part in self.parts:
            yield from part.lines(f"{indent}  ")


def joined(operator: str, parts: Sequence[TestNode]) -> TestNode:
    """Parts that columns answer come first: where they decide, no row is decoded."""
    ordered = sorted(parts, key=lambda part: not part.in_columns)
    return Several(operator, ordered)


MOST_BEGINS = 100_000
"""Rows whose begins are remembered."""


@dataclass(slots=True)
class Begins:
    """When rows began, for the time since the row before. `look`: whoever knows it of any row."""

    look: Callable[[int], int | None] | None = None
    _tables: deque[tuple[int, Any]] = field(default_factory=deque)
    _held: int = 0
    _last: tuple[int, int] = (0, 0)

    def take(self, first: int, begins: Any) -> int | None:
        """Remember those of a table; give when the row before it began."""
        before = self.of(first - 1)
        if not self._tables or self._tables[-1][0] != first:
            self._tables.append((first, begins))
            self._held += len(begins)
            while self._held > MOST_BEGINS and len(self._tables) > 2:
                self._held -= len(self._tables.popleft()[1])
        return before

    def note(self, row: Row) -> None:
        """Remember that of a row."""
        if row.no > self._last[0] or row.no == 1:
            self._last = row.no, row.event.start

    def of(self, no: int) -> int | None:
        """Of the row with that number."""
        if self.look is not None:
            return self.look(no)
        for first, begins in reversed(self._tables):
            if first <= no < first + len(begins):
                return int(begins[no - first])
        return self._last[1] if no == self._last[0] and no > 0 else None


@dataclass(frozen=True, slots=True)
class Filter:
    """A test of rows with their transactions, made of a text. `names`: fields that it asks for; `points`: those that
    frames tell, of which `Scope.told` must know; `by_request`: those that answers have by their request, which
    `Scope.answered` must know. `begins`: kept where it asks for the time since the row before."""

    text: str
    root: TestNode | None = None
    names: frozenset[str] = frozenset()
    begins: Begins | None = None
    points: frozenset[str] = frozenset()
    by_request: frozenset[str] = frozenset()

    def __call__(self, row: Row, transaction: Transaction | None) -> bool:
        """Whether a row is accepted."""
        if self.root is None:
            return True
        accepted = self.root.test(row, transaction)
        if self.begins is not None:
            self.begins.note(row)
        return accepted

    @property
    def of_closing(self) -> bool:
        """Whether it asks what became of rows, which may become known later than they do."""
        return self.root is not None and self.root.of_closing

    @property
    def in_columns(self) -> bool:
        """Whether columns say anything of it."""
        return self.root is None or self.root.in_columns

    def masks(self, table: Table, closed: Closed | None = None) -> tuple[Masks, Masks] | None:
        """Rows of a table that are surely accepted, and those that may be; the odd ones may all be. None: each has to
        be asked."""
        if self.root is None:
            import numpy as np

            return np.ones(len(table), bool), np.ones(len(table), bool)
        said = self.root.masks(table, closed)
        if said is None or not table.odd:
            return said
        odd = list(table.odd)
        sure, may = said[0].copy(), said[1].copy()
        sure[odd] = False
        may[odd] = True
        return sure, may

    def candidates(self, table: Table) -> list[int] | None:
        """Places of rows that may be accepted: all others are not. None: that takes a look at every row."""
        import numpy as np

        said = self.masks(table)
        if said is None:
            return None
        places: list[int] = np.flatnonzero(said[1]).tolist()
        return places

    def explain(self) -> str:
        """How it is carried out, a line each step."""
        if self.root is None:
            return "everything is accepted"
        how = (
            "columns decide which rows are looked at"
            if self.root.in_columns
            else "every row is decoded: no column holds what is asked"
        )
        return "\n".join((*self.root.lines(""), f"→ {how}"))
