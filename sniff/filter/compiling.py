"""From what a filter is made of to a plan: names become fields, words become values, types are checked. Pure."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from dissectors.field_types import FieldType, Kind
from dissectors.line import NS_PER_S
from dissectors.manifest import Dissector
from dissectors.tracker import Transaction
from sniff.engine.engine import Row
from sniff.filter import fields
from sniff.filter.asking import delta, leaf, nowhere, pair_of_columns
from sniff.filter.comparing import (
    ALL_OF,
    COMPARE,
    AnyOf,
    Between,
    During,
    Fitting,
    Holding,
    NotZero,
    There,
    When,
    With,
    compared,
    pattern_of,
)
from sniff.filter.errors import FilterError, nearest
from sniff.filter.expressions import NUMERIC, Expression, constant, counted, each, extreme, reckoned, sliced
from sniff.filter.grammar import parse
from sniff.filter.literals import Instant, is_word_of, number_of, value_of
from sniff.filter.plan import Begins, Filter, Leaf, Node, Opposite, joined
from sniff.filter.scope import Scope
from sniff.filter.syntax import (
    Among,
    Arithmetic,
    Call,
    Compared,
    Contains,
    Joined,
    Matches,
    Not,
    Present,
    Quoted,
    Slice,
    Test,
    Value,
    Word,
)

ORDERED = frozenset(("<", "<=", ">", ">="))
_ARTICLES = {Kind.OCTETS: "octets", Kind.ANY: "anything", Kind.TRUTH: "true or false", Kind.STATION: "a station"}


def compile_filter(text: str, dissector: Dissector, scope: Scope | None = None) -> Filter:
    """Turn a filter into a test of rows with their transactions, and of tables of them. An empty filter accepts
    everything. Raises FilterError."""
    parsed = parse(text)
    if parsed is None:
        return Filter(text)
    compiler = _Compiler(dissector, scope or Scope())
    root = compiler.test(parsed)
    return Filter(text, root, frozenset(compiler.names), compiler.begins)


def field_of(name: str, dissector: Dissector, scope: Scope | None = None) -> Expression:
    """What rows have of a name. Raises FilterError."""
    return _Compiler(dissector, scope or Scope()).field(name)


class _Compiler:
    def __init__(self, dissector: Dissector, scope: Scope) -> None:
        self.dissector = dissector
        self.scope = scope
        self.stations = scope.stations()
        self.names: set[str] = set()
        self.begins: Begins | None = None
        self.layers = fields.layers(dissector)
        self._decoded: dict[str, fields.Decoded] = {}
        self._types: dict[str, FieldType | None] = {}

    # tests

    def test(self, parsed: Test) -> Node:
        """What asks that."""
        if isinstance(parsed, Joined):
            return joined(parsed.operator, [self.test(part) for part in parsed.parts])
        if isinstance(parsed, Not):
            return Opposite(self.test(parsed.inner))
        if isinstance(parsed, Present):
            return self._present(parsed.value)
        if isinstance(parsed, Compared):
            return self._compared(parsed)
        if isinstance(parsed, Among):
            return self._among(parsed)
        if isinstance(parsed, Contains):
            return self._contains(parsed)
        return self._matches(parsed)

    def _present(self, value: Value) -> Node:
        if isinstance(value, Word):
            name = fields.ALIASES.get(value.text, value.text)
            layer = None if self._type(name) is not None else self._layer(name)
            if layer is not None:
                return layer
            expression = self._field(value)
            if name in fields.FLAGS or name in fields.COUNTS:
                return leaf(expression, NotZero(), False, f"{name} is so" if name in fields.FLAGS else f"any {name}")
            return leaf(expression, There(), False, f"{name} is there")
        if isinstance(value, Slice):
            expression = self._value(value)
            return leaf(expression, There(), False, f"{expression.words} is there")
        if isinstance(value, Arithmetic) and value.operator == "&":
            expression = self._value(value)
            return leaf(expression, NotZero(), False, f"any bit of {expression.words}")
        column = value.column
        raise FilterError("expected a comparison: this is a value alone", column)

    def _layer(self, name: str) -> Node | None:
        """A protocol by its name, or what frames of one carry."""
        known = {one.name for one in fields.protocols(self.dissector)}
        if name in known:
            proto = self._column("proto")
            return leaf(proto, With("==", (name,)), False, f"protocol {name}")
        prefix = self.layers.get(name)
        if prefix is None:
            return None
        holding = [one for one in fields.protocols(self.dissector) if prefix in one.prefixes]
        if all(one.name != self.dissector.name for one in holding):
            return Leaf(lambda row, tx: False, None, f"{name}: carried by other protocols")
        decoded = self._of(self.dissector)
        proto = self._column("proto")
        own = leaf(proto, With("==", (self.dissector.name,)), False, f"protocol {self.dissector.name}")
        inside = Leaf(
            lambda row, tx: any(one.startswith(prefix) for one in decoded.of(row)), None, f"has fields {prefix}*"
        )
        return joined("&&", [own, inside])

    def _compared(self, parsed: Compared) -> Node:
        left, right = self._is_value(parsed.left), self._is_value(parsed.right)
        operator, quantifier = parsed.operator, parsed.quantifier
        if left is None and right is None:
            self._no_field(parsed.left)
        if left is None:
            left, right = right, None
            operator = {"<": ">", "<=": ">=", ">": "<", ">=": "<="}.get(operator, operator)
            literal, column = parsed.left, parsed.right.column
        else:
            literal, column = parsed.right, parsed.right.column
        assert left is not None
        words = f"{left.words} {operator} {_written(literal)}"
        every = quantifier == "all" or (not quantifier and operator in ALL_OF)
        if right is not None and self._prefers_word(left, literal):
            right = None
        self._ordered(left, operator, parsed.column)
        if right is None:
            assert isinstance(literal, Word | Quoted)
            asked = leaf(left, self._test_of(left, operator, literal), every, words)
            return self._of_octets(asked, parsed.left, left, operator, literal)
        return self._both_fields(left, operator, right, every, words, column)

    def _of_octets(self, asked: Leaf, value: Value, left: Expression, operator: str, literal: Word | Quoted) -> Leaf:
        """Octets at a place, which tables hold."""
        if not (isinstance(value, Slice) and isinstance(value.of, Word) and len(value.spans) == 1):
            return asked
        if value.of.text not in ("hex", "frame.octets") or operator in ORDERED:
            return asked
        from sniff.filter.octets import slice_is

        (wanted,) = self._literal(left, literal)
        return Leaf(asked.ask, slice_is(value.spans[0], wanted, operator in ("!=", "!==")), asked.words)

    def _both_fields(
        self, left: Expression, operator: str, right: Expression, every: bool, words: str, column: int
    ) -> Node:
        self._alike(left, right, column)
        compare, wanted = COMPARE[operator], all if every else any
        get_left, get_right = left.get, right.get

        def ask(row: Row, tx: Transaction | None) -> bool:
            ours, theirs = get_left(row, tx), get_right(row, tx)
            return bool(ours and theirs) and wanted(compared(operator, a, b) for a in ours for b in theirs)

        columns = None
        if left.columns is not None and right.columns is not None and left.type.kind in NUMERIC:
            columns = pair_of_columns(left.columns, right.columns, compare)
        return Leaf(ask, columns, words, left.of_closing or right.of_closing)

    def _among(self, parsed: Among) -> Node:
        left = self._is_value(parsed.value)
        if left is None:
            self._no_field(parsed.value)
            raise AssertionError
        tests: list[Any] = []
        others: list[Node] = []
        for low, high in parsed.items:
            if high is not None:
                tests.append(self._range(left, low, high))
            else:
                field = None if self._prefers_word(left, low) else self._is_value(low)
                if field is None:
                    assert isinstance(low, Word | Quoted)
                    tests.append(self._test_of(left, "==", low))
                else:
                    words = f"{left.words} == {field.words}"
                    others.append(self._both_fields(left, "==", field, False, words, low.column))
        items = ", ".join(f"{_written(low)}..{_written(high)}" if high else _written(low) for low, high in parsed.items)
        every = parsed.quantifier == "all"
        among = leaf(left, _together(tests), every, f"{left.words} in {{{items}}}")
        return joined("||", [among, *others]) if others else among

    def _range(self, left: Expression, low: Value, high: Value) -> Any:
        self._ordered(left, "..", low.column)
        ends = []
        for one in (low, high):
            if not isinstance(one, Word | Quoted):
                raise FilterError("a range goes from one written value to another", one.column)
            ends.append(self._literal(left, one))
        if len(ends[0]) != 1 or len(ends[1]) != 1:
            raise FilterError("a range goes from one value to one", low.column)
        first, last = ends[0][0], ends[1][0]
        if isinstance(first, Instant) and isinstance(last, Instant):
            if first.daily is not last.daily:
                raise FilterError("a range of times has two dates or none", high.column)
            if not first.daily and last.time < first.time:
                raise FilterError("the range ends before it begins", high.column)
            return During(first, last)
        if compared("<", last, first):
            raise FilterError("the range ends before it begins", high.column)
        return Between(first, last)

    def _contains(self, parsed: Contains) -> Node:
        left = self._searched(parsed, "contains")
        if not isinstance(parsed.part, Word | Quoted):
            raise FilterError("contains is followed by a text or octets", parsed.part.column)
        text = FieldType(Kind.TEXT, digits=True) if left.type.kind is not Kind.OCTETS else left.type
        (wanted,) = value_of(parsed.part, text, left.words, self.stations, left.spelled)
        assert isinstance(wanted, str | bytes)
        if left.size is not None and len(wanted) > left.size:
            self._possible(left, wanted, parsed.part)
        words = f"{left.words} contains {_written(parsed.part)}"
        node = leaf(left, Holding(wanted), parsed.quantifier == "all", words)
        if left.field in ("hex", "frame.octets") and isinstance(wanted, bytes) and wanted:
            from sniff.filter.octets import holding

            return Leaf(node.ask, holding(wanted), words)
        return node

    def _searched(self, parsed: Contains | Matches, word: str) -> Expression:
        """The text or octets in which something is looked for."""
        left = self._is_value(parsed.value)
        if left is None:
            self._no_field(parsed.value)
            raise AssertionError
        if left.type.kind not in (Kind.TEXT, Kind.OCTETS, Kind.ANY):
            raise FilterError(
                f"{word} asks texts and octets; {left.words} is {_article(left.type)}, string({left.words}) a text",
                parsed.column,
            )
        return left

    def _matches(self, parsed: Matches) -> Node:
        left = self._searched(parsed, "matches")
        if not isinstance(parsed.pattern, Word | Quoted):
            raise FilterError("matches is followed by a regular expression", parsed.pattern.column)
        pattern = pattern_of(parsed.pattern.text, parsed.pattern.column)
        words = f"{left.words} matches {_written(parsed.pattern)}"
        return leaf(left, Fitting(pattern, left.spelled), parsed.quantifier == "all", words)

    # values

    def _is_value(self, value: Value) -> Expression | None:
        """What a row has; None for what is only written. A word that is no field is a value."""
        if isinstance(value, Quoted):
            return None
        if isinstance(value, Word):
            name = fields.ALIASES.get(value.text, value.text)
            return self._field(value) if self._type(name) is not None else None
        return self._value(value)

    def _value(self, value: Value) -> Expression:
        if isinstance(value, Slice):
            return self._slice(value)
        if isinstance(value, Call):
            return self._call(value)
        if isinstance(value, Arithmetic):
            return self._arithmetic(value)
        if isinstance(value, Word):
            return self._field(value)
        raise FilterError(f"expected a field, not {value.text!r}", value.column)

    def _slice(self, value: Slice) -> Expression:
        of = self._value(value.of)
        if of.type.kind not in (Kind.OCTETS, Kind.TEXT, Kind.ANY):
            raise FilterError(f"{of.words} is {_article(of.type)} and has no octets (frame.octets has)", value.column)
        return sliced(of, value.spans, f"{of.words}[…]")

    def _call(self, call: Call) -> Expression:
        parts = self._arguments(call)
        words = f"{call.name}({', '.join(part.words for part in parts)})"
        parts.sort(key=lambda part: part.fixed)  # the type is that of a field
        of = parts[0]
        kind = of.type.kind
        if call.name == "count":
            return counted(of, words)
        if call.name in ("min", "max"):
            for part in parts[1:]:
                self._alike(of, part, call.column)
            self._numeric(of, call, words)
            return extreme(parts, words, min if call.name == "min" else max)
        if call.name == "abs":
            self._numeric(of, call, words)
            return each(of, words, FieldType(kind, unit=of.type.unit), abs)
        if call.name == "string":
            return each(of, words, FieldType(Kind.TEXT, digits=True), lambda found: _as_text(found, kind))
        if kind not in (Kind.TEXT, Kind.OCTETS, Kind.ANY) or (kind is Kind.OCTETS and call.name != "len"):
            raise FilterError(f"{call.name}() takes a text; {of.words} is {_article(of.type)}", call.column)
        if call.name == "len":
            return each(of, words, FieldType(Kind.NUMBER), lambda found: len(found) if hasattr(found, "__len__") else 0)
        make: Callable[[Any], Any] = str.lower if call.name == "lower" else str.upper
        return each(of, words, FieldType(Kind.TEXT, digits=True), lambda found: make(str(found)))

    def _arguments(self, call: Call) -> list[Expression]:
        """What a function is of; min and max also of written values, as the first field among them has them."""
        found = [self._is_value(one) if call.name in ("min", "max") else self._value(one) for one in call.arguments]
        field = next((one for one in found if one is not None), None)
        parts: list[Expression] = []
        for one, written in zip(found, call.arguments, strict=True):
            if one is None:
                assert isinstance(written, Word | Quoted)
                if field is None or (
                    isinstance(written, Word) and not written.text[0].isdigit() and written.text[0] != "-"
                ):
                    self._no_field(written)
                    raise AssertionError
                made = self._literal(field, written)[0]
                if isinstance(made, Instant | str | bytes):
                    raise FilterError(f"expected a number, not {written.text!r}", written.column)
                one = replace(constant(made, written.text, field.type), fixed=True)
            parts.append(one)
        return parts

    def _numeric(self, of: Expression, call: Call, words: str) -> None:
        if of.type.kind not in NUMERIC and of.type.kind is not Kind.ANY:
            raise FilterError(f"{call.name}() takes a number; {of.words} is {_article(of.type)}", call.column)

    def _arithmetic(self, value: Arithmetic) -> Expression:
        left, right = self._is_value(value.left), self._is_value(value.right)
        scaling = value.operator in ("*", "/", "%", "&")
        known = left or right
        number = FieldType(Kind.NUMBER)
        sides: list[Expression] = []
        fixed: list[Any] = []
        for one, written in ((left, value.left), (right, value.right)):
            if one is None:
                assert isinstance(written, Word | Quoted)
                type = number if known is None or scaling else _difference(known.type)
                (made,) = value_of(written, type, "a number", self.stations)[:1]
                if isinstance(made, Instant | str | bytes):
                    raise FilterError(f"expected a number, not {written.text!r}", written.column)
                one = constant(made, written.text, type)
                fixed.append(made)
            else:
                fixed.append(None)
            if one.type.kind not in NUMERIC and one.type.kind is not Kind.ANY:
                raise FilterError(
                    f"{value.operator} takes numbers; {one.words} is {_article(one.type)}", written.column
                )
            sides.append(one)
        if value.operator in ("/", "%") and fixed[1] == 0:
            raise FilterError(f"nothing is divided by 0: {value.operator} 0 has no value", value.right.column)
        kind = self._kind_of(value, sides)
        unit = next((one.type.unit for one in sides if one.type.unit), "s")
        return reckoned(value.operator, sides[0], sides[1], FieldType(kind, unit=unit), fixed)

    def _kind_of(self, value: Arithmetic, sides: Sequence[Expression]) -> Kind:
        """What comes of it: times and durations stay what they are."""
        kinds = [one.type.kind for one in sides]
        timed = [kind in (Kind.TIME, Kind.DURATION) for kind in kinds]
        if not any(timed):
            return Kind.NUMBER
        if all(timed):
            if value.operator == "-" and kinds[0] is kinds[1]:
                return Kind.DURATION
            if value.operator in ("+", "-") and (kinds[0] is Kind.TIME or value.operator == "+"):
                if kinds == [Kind.TIME, Kind.TIME]:
                    raise FilterError("two times have no sum", value.column)
                return Kind.TIME if Kind.TIME in kinds else Kind.DURATION
            if value.operator == "/" and kinds == [Kind.DURATION, Kind.DURATION]:
                return Kind.NUMBER
        elif (value.operator in ("*", "/", "%") and kinds[0] is Kind.DURATION) or (
            value.operator == "*" and kinds[1] is Kind.DURATION
        ):
            return Kind.DURATION
        said = " and ".join(f"{one.words} ({one.type.kind.value})" for one in sides)
        raise FilterError(f"{value.operator} does not go with {said}", value.column)

    # fields

    def _type(self, name: str) -> FieldType | None:
        if name not in self._types:
            self._types[name] = self._type_of(name)
        return self._types[name]

    def _type_of(self, name: str) -> FieldType | None:
        if name in fields.COLUMN_TYPES:
            return fields.column_type(name, self.dissector)
        for one in fields.protocols(self.dissector):
            types = fields.types_of(one)
            if name in types:
                return types[name]
            if not types and name.startswith(one.prefixes):
                return FieldType(Kind.ANY)
        return None

    def field(self, name: str) -> Expression:
        """A field by its name."""
        return self._field(Word(name, 0))

    def _field(self, word: Word) -> Expression:
        name = fields.ALIASES.get(word.text, word.text)
        type = self._type(name)
        if type is None and number_of(word.text) is not None:
            raise FilterError(f"expected a field, not {word.text}", word.column)
        if type is None:
            raise FilterError(self._unknown(word.text), word.column)
        return self._column(name) if name in fields.COLUMN_TYPES else self._of_protocol(name, type)

    def _column(self, name: str) -> Expression:
        from sniff.filter.columns import held

        self.names.add(name)
        type = self._type(name)
        assert type is not None
        started, closing = self.scope.started or 0, name in fields.OF_CLOSING
        columns = held(name, started)
        get = fields.GETTERS.get(name)
        if name == "text":
            get = fields.row_text(self.dissector)
        elif name == "finding":
            get = fields.of_findings(self.scope)
        elif name in ("start_ns", "end_ns"):
            end = name[:-3]
            get = lambda row, _: (max(0, getattr(row.event, end) - started),)  # noqa: E731  one of several
        elif name == "frame.time_relative":
            get = lambda row, _: (row.event.start - started,)  # noqa: E731
        elif name == "frame.time_delta":
            begins = self.begins = self.begins or Begins(self.scope.begin_of)
            get, columns = delta(begins)
        assert get is not None
        return Expression(name, type, get, columns, closing, name in fields.SPELLED, name)

    def _of(self, dissector: Dissector) -> fields.Decoded:
        return self._decoded.setdefault(dissector.name, fields.Decoded(dissector))

    def _of_protocol(self, name: str, type: FieldType) -> Expression:
        self.names.add(name)
        own = fields.types_of(self.dissector)
        if own and name not in own:
            return Expression(name, type, lambda row, tx: (), nowhere)
        columns = None
        if type.octet is not None:
            from sniff.filter.columns import octet_of_frames

            columns = octet_of_frames(type.octet, type.mask, self.dissector.name)
        return Expression(name, type, fields.of_protocol(name, type, self._of(self.dissector)), columns)

    def _unknown(self, name: str) -> str:
        own = fields.known_names(self.dissector)
        others = [one for each in fields.protocols(self.dissector)[1:] for one in fields.types_of(each)]
        close = nearest(name, [*own, *self.layers, *others], most=12)
        return f"unknown name {name!r} ({close}; show --help-fields lists them)"

    def _no_field(self, value: Value) -> None:
        """Neither side of a comparison is a field."""
        if isinstance(value, Word) and number_of(value.text) is None:
            raise FilterError(self._unknown(value.text), value.column)
        raise FilterError(f"expected a field, not {_written(value)}", value.column)

    # types

    def _literal(self, left: Expression, written: Word | Quoted) -> tuple[Any, ...]:
        if left.field == "tx.of" or written.text != "":
            return value_of(written, left.type, left.words, self.stations, left.spelled)
        return ("",) if left.type.kind is Kind.TEXT else value_of(written, left.type, left.words, self.stations)

    def _test_of(self, left: Expression, operator: str, written: Word | Quoted) -> Any:
        wanted = self._literal(left, written)
        if isinstance(wanted[0], Instant):
            return When(operator, wanted[0])
        if operator not in ORDERED:
            self._possible(left, wanted[0], written)
        if operator in ORDERED and len(wanted) > 1:
            raise FilterError(f"{written.text!r} is {len(wanted)} stations: they have no order", written.column)
        return With(operator, wanted)

    def _possible(self, left: Expression, wanted: int | float | str | bytes, written: Word | Quoted) -> None:
        """Refuse what is equal to nothing that there can be."""
        if isinstance(wanted, str | bytes) and left.size is not None and len(wanted) != left.size:
            unit = "octets" if isinstance(wanted, bytes) else "characters"
            raise FilterError(f"{left.words} has {left.size} {unit}, {_written(written)} {len(wanted)}", written.column)
        whole = left.type.kind is Kind.STATION or (left.type.kind is Kind.NUMBER and left.field in fields.COLUMN_TYPES)
        if whole and isinstance(wanted, float):
            raise FilterError(f"{left.words} is a whole number, {written.text} is none", written.column)

    def _prefers_word(self, left: Expression, written: Value) -> bool:
        """Whether a word is meant as one of the values of what it is compared with, though there is such a field."""
        if not isinstance(written, Word):
            return isinstance(written, Quoted)
        if is_word_of(written.text, left.type):
            return True
        if left.type.kind is Kind.STATION and written.text.lower() in self.stations:
            return True
        other = self._type(fields.ALIASES.get(written.text, written.text))
        return other is not None and left.type.kind is Kind.TEXT and other.kind is not Kind.TEXT

    def _alike(self, left: Expression, right: Expression, column: int) -> None:
        one, other = left.type.kind, right.type.kind
        numbers = (Kind.NUMBER, Kind.STATION)
        if one is other or Kind.ANY in (one, other) or (one in numbers and other in numbers):
            return
        raise FilterError(
            f"{left.words} is {_article(left.type)}, {right.words} is {_article(right.type)}: they do not compare",
            column,
        )

    def _ordered(self, left: Expression, operator: str, column: int) -> None:
        if operator not in ORDERED and operator != "..":
            return
        if left.type.kind is Kind.TRUTH:
            raise FilterError(f"{left.words} is true or false: it has no order", column)
        if left.type.kind is Kind.TEXT and left.type.closed:
            raise FilterError(f"the words of {left.words} have no order", column)


def _difference(type: FieldType) -> FieldType:
    """What is added to, or taken from, something of that type."""
    if type.kind is Kind.TIME:
        return FieldType(Kind.DURATION, unit="s")
    return type if type.kind is Kind.DURATION else FieldType(Kind.NUMBER)


def _together(tests: Sequence[Any]) -> Any:
    """Tests of which one must accept, those for equal values as one."""
    equal = [test for test in tests if isinstance(test, With)]
    rest = [test for test in tests if not isinstance(test, With)]
    one = [With("==", tuple(value for test in equal for value in test.wanted))] if equal else []
    every = [*one, *rest]
    return every[0] if len(every) == 1 else AnyOf(every)


def _as_text(found: Any, kind: Kind) -> str:
    if isinstance(found, bytes):
        return found.hex()
    if kind is Kind.DURATION:
        return f"{found / NS_PER_S:g}"
    return str(found)


def _written(value: Value | None) -> str:
    if isinstance(value, Quoted):
        return f'"{value.text}"'
    if isinstance(value, Word):
        return value.text
    if isinstance(value, Arithmetic):
        return f"{_written(value.left)} {value.operator} {_written(value.right)}"
    if isinstance(value, Call):
        return f"{value.name}({', '.join(map(_written, value.arguments))})"
    return f"{_written(value.of)}[…]" if isinstance(value, Slice) else ""


def _article(type: FieldType) -> str:
    return _ARTICLES.get(type.kind, f"a {type.kind.value}")
