"""The filter language of `show -Y` and of the terminal UI's `/`: Wireshark's grammar over our columns and fields.

    dst == 3 && kind contains "write"          src in {1, 2, 5}        latency_ms > 50
    !ok or verdict == "no answer"              func == 0x10   error matches "CRC|LRC"

Names without a dot are columns (COLUMNS below), dotted names are fields as `show -T fields` lists them. A comparison
with something that a frame does not have is false, also `!=`. A name alone is true when the frame has it and it is
neither 0 nor empty. A verdict may be written as people read it ("no answer") or as JSON has it (no-response). A
verdict, role, found or damage that there is not is an error, for nothing would ever match. Pure.
"""

from __future__ import annotations

import difflib
import operator
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from dissectors import registry
from dissectors.frame import Damage, Found, Frame, Role
from dissectors.manifest import Dissector
from dissectors.tracker import Transaction, Verdict
from sniff.analysis.wording import describe
from sniff.engine.engine import Row

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from dissectors.columns import Masks
    from sniff.analysis.filter_masks import Remembered
    from sniff.engine.closings import Closings
    from sniff.engine.table import Table

Value = int | float | str
Predicate = Callable[[Row, Transaction | None], bool]
Accepts = Callable[[Value], bool]
Getter = Callable[[Row, Transaction | None], tuple[Value, ...]]


MaskOf = Callable[["Table", "Closings | None"], "Masks"]
"""Which plain rows of a table may be accepted."""


@dataclass(frozen=True, slots=True)
class Filter:
    """A test of a row with its transaction. `columns`: the same for many rows at once, as far as a table holds what
    is asked, None where it holds none of it; `exact`: whether that is all that is asked. `of_closing`: whether what
    became of the row is asked for, which may become known later than the row.
    """

    test: Predicate
    columns: MaskOf | None = None
    exact: bool = False
    of_closing: bool = False

    def __call__(self, row: Row, transaction: Transaction | None) -> bool:
        """Whether the row is accepted."""
        return self.test(row, transaction)

    def candidates(self, table: Table) -> list[int] | None:
        """Places of rows that may be accepted: all others are not. None: that takes a look at every row."""
        if self.columns is None:
            return None
        import numpy as np

        chosen = self.columns(table, None)
        chosen[list(table.odd)] = True
        places: list[int] = np.flatnonzero(chosen).tolist()
        return places


class FilterError(ValueError):
    """A filter that cannot be read: the message says what was expected, `column` (0 …) where."""

    def __init__(self, message: str, column: int) -> None:
        super().__init__(f"{message} at column {column + 1}")
        self.column = column


def is_field(name: str, dissector: Dissector) -> bool:
    """Whether a name can be a field: of this protocol, or of another one (a filter may be for several captures)."""
    return name.startswith(dissector.prefixes) or any(name.startswith(other.prefixes) for other in registry.usable())


def _source(row: Row, _: Transaction | None) -> tuple[Value, ...]:
    place, header = row.placement, row.header
    found = place.source if place is not None else header.source if header is not None else None
    return () if found is None else (found,)


def _destination(row: Row, _: Transaction | None) -> tuple[Value, ...]:
    place, header = row.placement, row.header
    found = place.destination if place is not None else header.destination if header is not None else None
    return () if found is None else (found,)


def _of_header(name: str) -> Getter:
    def get(row: Row, _: Transaction | None) -> tuple[Value, ...]:
        found = getattr(row.header, name, None)
        return () if found is None else (found,)

    return get


def _ok(row: Row, _: Transaction | None) -> tuple[Value, ...]:
    return () if row.searched is not None else (int(isinstance(row.event, Frame) and row.event.ok),)


def _kind(row: Row, _: Transaction | None) -> tuple[Value, ...]:
    if row.header is not None:
        return (row.header.kind,)
    return ("noise" if row.searched is None else "searching",)


def _role(row: Row, _: Transaction | None) -> tuple[Value, ...]:
    if row.header is None:
        return ()
    return ((row.placement.role if row.placement is not None else row.header.role).value,)


COLUMNS: dict[str, Getter] = {
    "no": lambda row, _: (row.no,),
    "src": _source,
    "dst": _destination,
    "addr": lambda row, tx: _source(row, tx) + _destination(row, tx),
    "proto": lambda row, _: (row.header.protocol,) if row.header is not None else (),
    "role": _role,
    "kind": _kind,
    "func": _of_header("function"),
    "register": _of_header("address"),
    "count": _of_header("count"),
    "ok": _ok,
    "error": _of_header("error"),
    "noise": lambda row, _: (int(not isinstance(row.event, Frame) and row.searched is None),),
    "found": lambda row, _: (row.event.found.value,) if isinstance(row.event, Frame) else (),
    "damage": lambda row, _: (
        (row.event.damage.value,) if isinstance(row.event, Frame) and row.event.damage is not None else ()
    ),
    "len": lambda row, _: (len(row.event.octets),),
    "marks": lambda row, _: (len(row.event.marks),),
    "tx": lambda row, _: (row.placement.tx,) if row.placement is not None else (),
    "verdict": lambda _, tx: (tx.verdict.value,) if tx is not None else (),
    "latency_ms": lambda _, tx: (tx.latency.nominal / 1e6,) if tx is not None and tx.latency is not None else (),
    "attempt": lambda _, tx: (tx.attempt,) if tx is not None else (),
    "hex": lambda row, _: (row.event.octets.hex(),),
}
OF_CLOSING = frozenset(("verdict", "latency_ms", "attempt"))
"""What became of a row."""
IN_TABLES = frozenset(COLUMNS) - OF_CLOSING - {"hex"}
"""Those that a table holds as columns (`filter_masks.py`)."""

ALIASES = {"frame.number": "no", "frame.len": "len", "tx.verdict": "verdict", "tx.latency_ms": "latency_ms"}
FIELDS: tuple[str, ...] = (*COLUMNS, "text", *ALIASES)
"""Names for completion; the dotted fields of the protocol come on top."""

_VERDICTS = {verdict.words: verdict.value for verdict in Verdict}
_CLOSED: dict[str, tuple[str, ...]] = {
    "verdict": tuple(verdict.value for verdict in Verdict),
    "role": tuple(role.value for role in Role),
    "found": tuple(found.value for found in Found),
    "damage": tuple(damage.value for damage in Damage),
}
"""Columns that have one of these values and no other."""
_COMPARE: dict[str, Callable[[Any, Any], bool]] = {
    "==": operator.eq,
    "!=": operator.ne,
    ">=": operator.ge,
    "<=": operator.le,
    ">": operator.gt,
    "<": operator.lt,
}
_WORDS = {"eq": "==", "ne": "!=", "ge": ">=", "le": "<=", "gt": ">", "lt": "<", "and": "&&", "or": "||", "not": "!"}
_LEXER = re.compile(
    r"\s*(?:(?P<op>==|!=|>=|<=|>|<|&&|\|\||!|\(|\)|\{|\}|,|~)"
    r'|(?P<string>"(?:[^"\\]|\\.)*")'
    r"|(?P<word>[A-Za-z0-9_.:+-]+))"
)


@dataclass(frozen=True, slots=True)
class _Token:
    kind: str  # "op", "string", "word", "end"
    text: str
    column: int


def compile_filter(text: str, dissector: Dissector, with_closings: bool = False) -> Filter:
    """Turn a filter into a test of a row with its transaction. An empty filter is always true. Raises FilterError.

    `with_closings`: whoever calls `columns` gives what became of the rows too.
    """
    tokens = _lex(text)
    if len(tokens) == 1:
        return Filter(lambda row, tx: True, _every, exact=True)
    return _Parser(tokens, dissector, with_closings).parse()


def _every(table: Table, closings: Closings | None = None) -> Masks:
    import numpy as np

    every: Masks = np.ones(len(table), bool)
    return every


def _lex(text: str) -> list[_Token]:
    tokens: list[_Token] = []
    position = 0
    end = len(text.rstrip())
    while position < end:
        match = _LEXER.match(text, position)
        if match is None or match.end() == position:
            column = position + len(text[position:]) - len(text[position:].lstrip())
            raise FilterError(f"unexpected {text[column : column + 1]!r}", column)
        kind = match.lastgroup or "op"
        found = match[kind]
        if kind == "word" and found in _WORDS:
            kind, found = "op", _WORDS[found]
        tokens.append(_Token(kind, found, match.start(match.lastgroup or "op")))
        position = match.end()
    tokens.append(_Token("end", "", end))
    return tokens


class _Parser:
    def __init__(self, tokens: list[_Token], dissector: Dissector, with_closings: bool) -> None:
        self.tokens = tokens
        self.dissector = dissector
        self.in_columns = IN_TABLES | OF_CLOSING if with_closings else IN_TABLES
        self.at = 0
        self.depth = 0

    def parse(self) -> Filter:
        found = self._either()
        if self._now.kind != "end":
            raise FilterError(f"expected && or || before {self._now.text!r}", self._now.column)
        return found

    @property
    def _now(self) -> _Token:
        return self.tokens[self.at]

    def _take(self, *texts: str) -> bool:
        if self._now.kind == "op" and self._now.text in texts:
            self.at += 1
            return True
        return False

    def _either(self) -> Filter:
        parts = [self._both()]
        while self._take("||"):
            parts.append(self._both())
        return parts[0] if len(parts) == 1 else _any_of(parts)

    def _both(self) -> Filter:
        parts = [self._not()]
        while self._take("&&"):
            parts.append(self._not())
        return parts[0] if len(parts) == 1 else _all_of(parts)

    def _not(self) -> Filter:
        self.depth += 1
        if self.depth > 200:
            raise FilterError("too deeply nested", self._now.column)
        try:
            if self._take("!"):
                inner = self._not()
                return _none_of(inner)
            if self._take("("):
                inner = self._either()
                if not self._take(")"):
                    raise FilterError("expected )", self._now.column)
                return inner
            return self._comparison()
        finally:
            self.depth -= 1

    def _comparison(self) -> Filter:
        token = self._now
        if token.kind == "string":
            self.at += 1
            return self._accepting("text", self._getter("text", token.column), _containing(_unquote(token.text)))
        if token.kind != "word":
            raise FilterError("expected a name such as dst, kind or latency_ms", token.column)
        get = self._getter(token.text, token.column)
        self.at += 1
        if self._now.kind == "op" and self._now.text in _COMPARE:
            compare = _COMPARE[self._now.text]
            self.at += 1
            wanted = self._value_of(token.text)
            return self._accepting(token.text, get, _Compared(compare, wanted))
        if (self._now.kind == "word" and self._now.text in {"contains", "matches", "in"}) or self._now.text == "~":
            how = self._now.text
            self.at += 1
            if how == "in":
                return self._among(token.text, get)
            column = self._now.column
            wanted_text = str(self._value())
            accepts = _containing(wanted_text) if how == "contains" else _matching(wanted_text, column)
            return self._accepting(token.text, get, accepts)
        return self._accepting(token.text, get, _Something())

    def _accepting(self, name: str, get: Getter, accepts: Accepts) -> Filter:
        """Rows of which any value of that name is accepted."""
        name = ALIASES.get(name, name)

        def test(row: Row, tx: Transaction | None) -> bool:
            return any(accepts(found) for found in get(row, tx))

        of_closing = name in OF_CLOSING
        if name not in self.in_columns:
            return Filter(test, of_closing=of_closing)
        remembered: Remembered = {}

        def columns(table: Table, closings: Closings | None) -> Masks:
            from sniff.analysis.filter_masks import accepted

            return accepted(table, name, accepts, remembered, closings)

        return Filter(test, columns, exact=True, of_closing=of_closing)

    def _among(self, name: str, get: Getter) -> Filter:
        if not self._take("{"):
            raise FilterError("expected { after in", self._now.column)
        values = [self._value_of(name)]
        while not self._take("}"):
            self._take(",")
            values.append(self._value_of(name))
        return self._accepting(name, get, _Among(values))

    def _value_of(self, name: str) -> Value:
        """The next value to compare a name with; a verdict may stand as people read it, "no answer"."""
        column = self._now.column
        value = self._value()
        name = ALIASES.get(name, name)
        if name == "verdict" and isinstance(value, str):
            value = _VERDICTS.get(value.lower(), value)
        known = _CLOSED.get(name)
        if known is not None and str(value).lower() not in known:
            spoken = {**{words: words for words in known}, **(_VERDICTS if name == "verdict" else {})}
            close = difflib.get_close_matches(str(value).lower(), spoken, 1, 0.5)
            hint = f"did you mean {spoken[close[0]]!r}?" if close else f"expected one of {', '.join(known)}"
            raise FilterError(f"unknown {name} {value!r} ({hint})", column)
        return value

    def _value(self) -> Value:
        token = self._now
        if token.kind not in {"word", "string"}:
            raise FilterError("expected a value", token.column)
        self.at += 1
        return _unquote(token.text) if token.kind == "string" else _literal(token.text)

    def _getter(self, name: str, column: int) -> Getter:
        dissector = self.dissector
        name = ALIASES.get(name, name)
        if name == "text":
            return lambda row, _: (describe(dissector, row),)
        if name in COLUMNS:
            return COLUMNS[name]
        if not is_field(name, dissector):
            close = difflib.get_close_matches(name, FIELDS, 1, 0.5)
            hint = f"did you mean {close[0]!r}?" if close else f"columns: {' '.join((*COLUMNS, 'text'))}"
            raise FilterError(
                f"unknown name {name!r} ({hint}; fields of this protocol begin with {', '.join(dissector.prefixes)})",
                column,
            )

        def get(row: Row, _: Transaction | None) -> tuple[Value, ...]:
            if not isinstance(row.event, Frame):
                return ()
            role = row.placement.role if row.placement is not None else Role.UNKNOWN
            found = dissector.fields(row.event, role).get(name)
            if isinstance(found, str) and "," in found:
                return tuple(_literal(part) for part in found.split(","))
            return () if found is None else (found,)

        return get


def _unquote(text: str) -> str:
    return re.sub(r"\\(.)", r"\1", text[1:-1])


def _literal(text: str) -> Value:
    for read in (lambda: int(text, 0), lambda: int(text), lambda: float(text)):
        try:
            return read()
        except ValueError:
            continue
    return {"true": 1, "false": 0}.get(text.lower(), text)


def _compare(compare: Callable[[Any, Any], bool], found: Value, wanted: Value) -> bool:
    if isinstance(found, str) and not isinstance(wanted, str):
        number = _literal(found)
        if isinstance(number, str):
            return compare(found.lower(), str(wanted))
        return compare(number, wanted)
    if isinstance(found, str) and isinstance(wanted, str):
        return compare(found.lower(), wanted.lower())
    if isinstance(wanted, str):
        return compare is operator.ne
    return compare(found, wanted)


@dataclass(frozen=True, slots=True)
class _Compared:
    """Values that compare so with `wanted`."""

    compare: Callable[[Any, Any], bool]
    wanted: Value

    def __call__(self, found: Value) -> bool:
        return _compare(self.compare, found, self.wanted)

    def many(self, values: npt.NDArray[np.number[Any]]) -> Masks:
        """The same for numbers."""
        import numpy as np

        if isinstance(self.wanted, str):
            return np.full(len(values), self.compare is operator.ne)
        chosen = self.compare(values, self.wanted)
        return np.asarray(chosen, bool)


class _Something:
    """Values that are neither 0 nor empty."""

    def __call__(self, found: Value) -> bool:
        return found not in (0, "")

    def many(self, values: npt.NDArray[np.number[Any]]) -> Masks:
        """The same for numbers."""
        chosen: Masks = values != 0
        return chosen


@dataclass(frozen=True, slots=True)
class _Among:
    """Values that equal one of `wanted`."""

    wanted: Sequence[Value]

    def __call__(self, found: Value) -> bool:
        return any(_compare(operator.eq, found, wanted) for wanted in self.wanted)

    def many(self, values: npt.NDArray[np.number[Any]]) -> Masks:
        """The same for numbers."""
        import numpy as np

        chosen = np.zeros(len(values), bool)
        for wanted in self.wanted:
            chosen |= _Compared(operator.eq, wanted).many(values)
        return chosen


def _any_of(parts: Sequence[Filter]) -> Filter:
    masks = [part.columns for part in parts if part.columns is not None]

    def test(row: Row, tx: Transaction | None) -> bool:
        return any(part(row, tx) for part in parts)

    def columns(table: Table, closings: Closings | None) -> Masks:
        chosen = masks[0](table, closings)
        for mask in masks[1:]:
            chosen |= mask(table, closings)
        return chosen

    whole = len(masks) == len(parts)
    exact = whole and all(part.exact for part in parts)
    return Filter(test, columns if whole else None, exact, any(part.of_closing for part in parts))


def _all_of(parts: Sequence[Filter]) -> Filter:
    masks = [part.columns for part in parts if part.columns is not None]

    def test(row: Row, tx: Transaction | None) -> bool:
        return all(part(row, tx) for part in parts)

    def columns(table: Table, closings: Closings | None) -> Masks:
        chosen = masks[0](table, closings)
        for mask in masks[1:]:
            chosen &= mask(table, closings)
        return chosen

    exact = len(masks) == len(parts) and all(part.exact for part in parts)
    return Filter(test, columns if masks else None, exact, any(part.of_closing for part in parts))


def _none_of(inner: Filter) -> Filter:
    mask = inner.columns

    def test(row: Row, tx: Transaction | None) -> bool:
        return not inner(row, tx)

    def columns(table: Table, closings: Closings | None) -> Masks:
        assert mask is not None
        chosen: Masks = ~mask(table, closings)
        return chosen

    exact = mask is not None and inner.exact
    return Filter(test, columns if exact else None, exact, inner.of_closing)


def _containing(wanted: str) -> Accepts:
    lowered = wanted.lower()
    return lambda found: lowered in str(found).lower()


def _matching(pattern: str, column: int) -> Accepts:
    try:
        compiled = re.compile(pattern, re.IGNORECASE)
    except re.error as error:
        raise FilterError(f"regular expression: {error}", column) from None
    return lambda found: compiled.search(str(found)) is not None
