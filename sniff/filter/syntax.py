"""Syntax tree of a filter, as it was written. `column`: where it stands, from 0. Pure."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Word:
    """A word without quotes: a field, or a value."""

    text: str
    column: int


@dataclass(frozen=True, slots=True)
class Quoted:
    """A text in quotes, without them."""

    text: str
    column: int


@dataclass(frozen=True, slots=True)
class Span:
    """Some octets or characters: `first` … `last`, which is left out; below 0 from the end; None: to the end."""

    first: int
    last: int | None


@dataclass(frozen=True, slots=True)
class Slice:
    """Parts of a value, one after the other."""

    of: Value
    spans: tuple[Span, ...]
    column: int


@dataclass(frozen=True, slots=True)
class Call:
    """A function of values."""

    name: str
    arguments: tuple[Value, ...]
    column: int


@dataclass(frozen=True, slots=True)
class Arithmetic:
    """Two numbers, and what is done with them."""

    operator: str
    left: Value
    right: Value
    column: int


Value = Word | Quoted | Slice | Call | Arithmetic


@dataclass(frozen=True, slots=True)
class Present:
    """Whether there is such a thing."""

    value: Value
    column: int


@dataclass(frozen=True, slots=True)
class Compared:
    """`quantifier`: "any" or "all" of the left values, "" as the operator has it."""

    operator: str
    left: Value
    right: Value
    column: int
    quantifier: str = ""


@dataclass(frozen=True, slots=True)
class Among:
    """Whether a value is in a set; each item a value, or a range of values with both ends in it."""

    value: Value
    items: tuple[tuple[Value, Value | None], ...]
    column: int
    quantifier: str = ""


@dataclass(frozen=True, slots=True)
class Contains:
    """Whether a value holds another. `alike`: capitals do not matter."""

    value: Value
    part: Value
    column: int
    quantifier: str = ""
    alike: bool = False


@dataclass(frozen=True, slots=True)
class Matches:
    """Whether a regular expression finds something."""

    value: Value
    pattern: Value
    column: int
    quantifier: str = ""


@dataclass(frozen=True, slots=True)
class Not:
    """The opposite."""

    inner: Test


@dataclass(frozen=True, slots=True)
class Joined:
    """Tests joined by "&&", "||" or "^^"."""

    operator: str
    parts: tuple[Test, ...]


Test = Present | Compared | Among | Contains | Matches | Not | Joined
