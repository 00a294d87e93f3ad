"""Values of rows: fields, parts of them, what functions and arithmetic make of them. Pure."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Any

from dissectors.field_types import FieldType, Kind
from dissectors.tracker import Transaction
from sniff.engine.engine import Row
from sniff.filter.fields import Getter, Value, Values
from sniff.filter.syntax import Span

if TYPE_CHECKING:
    from sniff.engine.table import Table
    from sniff.filter.columns import Closed, Columns, ColumnsOf

NUMERIC = frozenset((Kind.NUMBER, Kind.STATION, Kind.TRUTH, Kind.DURATION, Kind.TIME))


@dataclass(frozen=True, slots=True)
class Expression:
    """What a row has of something: no value, one or several. `columns`: as tables hold it; `words`: as written.
    `fixed`: the same of every row; `size`: how many octets or characters it always has. `nowhere`: no frame of this
    protocol has it; `told`: what frames tell of points; `letters`: "lower" or "upper" where all are such."""

    words: str
    type: FieldType
    get: Getter
    columns: ColumnsOf | None = None
    of_closing: bool = False
    spelled: bool = False
    field: str = ""
    fixed: bool = False
    size: int | None = None
    nowhere: bool = False
    told: bool = False
    letters: str = ""


def sliced(of: Expression, spans: Sequence[Span], words: str) -> Expression:
    """Parts of texts or octets; nothing of those that are too short."""

    def get(row: Row, tx: Transaction | None) -> Values:
        return tuple(part for value in of.get(row, tx) if (part := _parts(value, spans)) is not None)

    sizes = [_size(span) for span in spans]
    size = None if None in sizes else sum(one for one in sizes if one is not None)
    made = Expression(words, FieldType(of.type.kind, several=False), get, None, of.of_closing, of.spelled)
    return replace(made, size=size, nowhere=of.nowhere)


def _size(span: Span) -> int | None:
    """How long it is, wherever that is always the same."""
    if span.last is None:
        return -span.first if span.first < 0 else None
    return span.last - span.first if (span.first < 0) is (span.last < 0) else None


def _parts(value: Value, spans: Sequence[Span]) -> Value | None:
    if not isinstance(value, str | bytes):
        return None
    found: Any = value[:0]
    for span in spans:
        first = span.first + len(value) if span.first < 0 else span.first
        last = len(value) if span.last is None else span.last + len(value) if span.last < 0 else span.last
        if first < 0 or first >= len(value) or last > len(value) or last <= first:
            return None
        found += value[first:last]
    return found  # type: ignore[no-any-return]


def counted(of: Expression, words: str) -> Expression:
    """How many values."""
    several = of.type.kind is Kind.TEXT and of.type.several

    def get(row: Row, tx: Transaction | None) -> Values:
        count = len(of.get(row, tx))
        return (count - 1 if several and count > 1 else count,)  # a text with commas is there as a whole too

    return Expression(words, FieldType(Kind.NUMBER), get, None, of.of_closing)


def each(of: Expression, words: str, type: FieldType, make: Callable[[Any], Value]) -> Expression:
    """Something of every value."""

    def get(row: Row, tx: Transaction | None) -> Values:
        return tuple(make(value) for value in of.get(row, tx))

    return Expression(words, type, get, None, of.of_closing, nowhere=of.nowhere)


def extreme(parts: Sequence[Expression], words: str, choose: Callable[[Any], Any]) -> Expression:
    """The least or the greatest of all values."""

    def get(row: Row, tx: Transaction | None) -> Values:
        values = [value for part in parts for value in part.get(row, tx)]
        return (choose(values),) if values else ()

    return Expression(
        words,
        replace(parts[0].type, words={}),
        get,
        None,
        any(part.of_closing for part in parts),
        nowhere=all(part.nowhere for part in parts),
    )


def constant(value: Value, words: str, type: FieldType) -> Expression:
    """The same of every row."""
    return Expression(words, type, lambda row, tx: (value,))


def reckoned(operator: str, left: Expression, right: Expression, type: FieldType, fixed: Sequence[Any]) -> Expression:
    """Two numbers and what is done with them. `fixed`: left and right as numbers where they are the same everywhere."""

    def get(row: Row, tx: Transaction | None) -> Values:
        made = (_reckon(operator, a, b) for a, b in product(left.get(row, tx), right.get(row, tx)))
        return tuple(value for value in made if value is not None)

    def columns(table: Table, closed: Closed | None) -> Columns | None:
        from sniff.filter.columns import combined

        sides: list[Any] = []
        for one, number in zip((left, right), fixed, strict=True):
            if isinstance(number, int):
                sides.append(number)
                continue
            held = one.columns(table, closed) if one.columns is not None else None
            if held is None or len(held) != 1:
                return None
            sides.append(held[0])
        made = combined(operator, *sides)
        return None if made is None else (made,)

    there = all(
        one.columns is not None or isinstance(number, int) for one, number in zip((left, right), fixed, strict=True)
    )
    words = f"{_one(left.words)} {operator} {_one(right.words)}"
    closing = left.of_closing or right.of_closing
    whole = all(isinstance(number, int) for number in fixed)
    nowhere = left.nowhere or right.nowhere
    return Expression(words, type, get, columns if there and not whole else None, closing, nowhere=nowhere)


def _one(words: str) -> str:
    """In parentheses where it is reckoned itself."""
    is_whole = words.startswith(("len(", "count(", "abs(", "min(", "max(")) or " " not in words
    return words if is_whole else f"({words})"


def _reckon(operator: str, left: Any, right: Any) -> int | float | None:
    if not isinstance(left, int | float) or not isinstance(right, int | float):
        return None
    whole = isinstance(left, int) and isinstance(right, int)
    try:
        if operator == "+":
            return left + right
        if operator == "-":
            return left - right
        if operator == "*":
            return left * right
        if operator == "/":
            return left // right if whole else left / right
        if operator == "%":
            return left % right
        return int(left) & int(right) if whole else None
    except (ZeroDivisionError, OverflowError):
        return None
