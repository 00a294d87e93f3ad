"""From what a filter is made of to a plan: each test becomes a question, and is checked on the way. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from dissectors import registry
from dissectors.field_types import FieldType, Kind
from dissectors.manifest import Dissector
from dissectors.tracker import Transaction
from sniff.engine.engine import Row
from sniff.filter import fields, pointing
from sniff.filter.agreeing import (
    ORDERED,
    article,
    check_alike,
    check_equal,
    check_fitting,
    check_holding,
    check_order,
    check_reach,
    refuse_size,
    spelled,
)
from sniff.filter.asking import leaf, pair_of_columns
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
from sniff.filter.errors import FilterError, OfOthers
from sniff.filter.expressions import NUMERIC, Expression
from sniff.filter.grammar import parse
from sniff.filter.literals import Instant, value_of
from sniff.filter.naming import Names
from sniff.filter.plan import Filter, Leaf, Opposite, TestNode, joined
from sniff.filter.scope import Scope
from sniff.filter.syntax import (
    Among,
    Arithmetic,
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
from sniff.filter.valuing import Values


def compile_filter(text: str, dissector: Dissector, scope: Scope | None = None, others: bool = False) -> Filter:
    """Turn a filter into a test of rows with their transactions, and of tables of them. An empty filter accepts
    everything. `others`: frames of other protocols may come too, so that it may ask for what only those have. Raises
    FilterError."""
    parsed = parse(text)
    if parsed is None:
        return Filter(text)
    names = Names(dissector, scope or Scope())
    root = _Compiler(names).test(parsed)
    error = names.of_others()
    if error is not None and root.fixed is not None and not others:
        raise error
    return Filter(
        text, root, frozenset(names.asked), names.begins, frozenset(names.points), frozenset(names.by_request)
    )


def check_filter(text: str) -> None:
    """Whether a filter can be for a capture of any protocol, and of any devices. Raises FilterError."""
    found: dict[bool, FilterError] = {}
    for dissector in registry.usable():
        try:
            compile_filter(text, dissector)
        except FilterError as error:
            found.setdefault(isinstance(error, OfOthers), error)
        else:
            return
    raise found.get(False) or found[True]


def field_of(name: str, dissector: Dissector, scope: Scope | None = None) -> Expression:
    """What rows have of a name. Raises FilterError."""
    return Names(dissector, scope or Scope()).field(Word(name, 0))


class _Compiler:
    def __init__(self, names: Names) -> None:
        self.names = names
        self.values = Values(names)
        self.points = pointing.Points(names)

    def test(self, parsed: Test) -> TestNode:
        """What asks that."""
        if isinstance(parsed, Joined):
            return self._joined(parsed)
        if isinstance(parsed, Not):
            return Opposite(self.test(parsed.inner))
        of_points = self.points.test(parsed)
        if of_points is not None:
            return of_points
        if isinstance(parsed, Present):
            return self._present(parsed.value)
        if isinstance(parsed, Compared):
            return self._compared(parsed)
        if isinstance(parsed, Among):
            return self._among(parsed)
        if isinstance(parsed, Contains):
            return self._contains(parsed)
        return self._matches(parsed)

    def _joined(self, parsed: Joined) -> TestNode:
        one, rest = self.points.together(parsed)
        parts = [self.test(part) for part in rest]
        parts += [] if one is None else [one]
        return parts[0] if len(parts) == 1 else joined(parsed.operator, parts)

    def _present(self, value: Value) -> TestNode:
        if isinstance(value, Word):
            layer = self.names.layer(value)
            if layer is not None:
                return layer
            expression = self.names.field(value)
            if expression.field in fields.FLAGS:
                return leaf(expression, NotZero(), False, f"{expression.field} is so")
            return leaf(expression, There(), False, f"{expression.words} is there")
        if isinstance(value, Slice):
            expression = self.values.of(value)
            return leaf(expression, There(), False, f"{expression.words} is there")
        if isinstance(value, Arithmetic) and value.operator == "&":
            expression = self.values.of(value)
            return leaf(expression, NotZero(), False, f"any bit of {expression.words}")
        raise FilterError("expected a comparison: this is a value alone", value.column)

    # comparisons

    def _compared(self, parsed: Compared) -> TestNode:
        left, right = self.values.field_or_none(parsed.left), self.values.field_or_none(parsed.right)
        operator, quantifier = parsed.operator, parsed.quantifier
        if left is None and right is None:
            raise self.names.no_field(parsed.left, spelled(parsed.left))
        literal, column = parsed.right, parsed.right.column
        if left is None:
            left, right = right, None
            operator = MIRRORED.get(operator, operator)
            literal = parsed.left
        assert left is not None
        words = f"{left.words} {operator} {spelled(literal)}"
        every = quantifier == "all" or (not quantifier and operator in ALL_OF)
        if right is not None and self.values.prefers_word(left, literal):
            right = None
        check_order(left, operator, parsed.column)
        if right is not None:
            return self._both_fields(left, operator, right, every, words, column)
        assert isinstance(literal, Word | Quoted)
        accepts = self._test_of(left, operator, literal)
        if operator in ("==", "===") and isinstance(accepts, With) and self._is_elsewhere(left, accepts, literal):
            return Leaf(lambda row, tx: False, None, words, fixed=False)
        return self._of_octets(leaf(left, accepts, every, words), parsed.left, left, operator, literal)

    def _is_elsewhere(self, left: Expression, accepts: With, literal: Word | Quoted) -> bool:
        return self.names.is_elsewhere(left, accepts.wanted[0], literal)

    def _of_octets(self, asked: Leaf, value: Value, left: Expression, operator: str, literal: Word | Quoted) -> Leaf:
        """Octets at a place, which tables hold."""
        if not (isinstance(value, Slice) and isinstance(value.of, Word) and len(value.spans) == 1):
            return asked
        if value.of.text not in ("hex", "frame.octets") or operator in ORDERED:
            return asked
        from sniff.filter.octets import slice_is

        (wanted,) = self.values.literal(left, literal)
        return Leaf(asked.ask, slice_is(value.spans[0], wanted, operator in ("!=", "!==")), asked.words)

    def _both_fields(
        self, left: Expression, operator: str, right: Expression, every: bool, words: str, column: int
    ) -> TestNode:
        check_alike(left, right, column)
        compare, wanted = COMPARE[operator], all if every else any
        get_left, get_right = left.get, right.get

        def ask(row: Row, tx: Transaction | None) -> bool:
            ours, theirs = get_left(row, tx), get_right(row, tx)
            return bool(ours and theirs) and wanted(compared(operator, a, b) for a in ours for b in theirs)

        columns = None
        if left.columns is not None and right.columns is not None and left.type.kind in NUMERIC:
            columns = pair_of_columns(left.columns, right.columns, compare)
        fixed = False if left.nowhere or right.nowhere else None
        return Leaf(ask, columns, words, left.of_closing or right.of_closing, fixed)

    def _among(self, parsed: Among) -> TestNode:
        left = self.values.field_of(parsed.value)
        tests: list[Any] = []
        others: list[TestNode] = []
        elsewhere = 0
        for low, high in parsed.items:
            if high is not None:
                tests.append(self._range(left, low, high))
                continue
            field = None if self.values.prefers_word(left, low) else self.values.field_or_none(low)
            if field is not None:
                words = f"{left.words} == {field.words}"
                others.append(self._both_fields(left, "==", field, False, words, low.column))
                continue
            assert isinstance(low, Word | Quoted)
            test = self._test_of(left, "==", low)
            elsewhere += isinstance(test, With) and self._is_elsewhere(left, test, low)
            tests.append(test)
        words = f"{left.words} in {{{_items(parsed)}}}"
        if elsewhere == len(parsed.items):
            return Leaf(lambda row, tx: False, None, words, fixed=False)
        among = leaf(left, _together(tests), parsed.quantifier == "all", words)
        return joined("||", [among, *others]) if others else among

    def _range(self, left: Expression, low: Value, high: Value) -> Any:
        check_order(left, "..", low.column)
        ends = []
        for one in (low, high):
            if not isinstance(one, Word | Quoted):
                raise FilterError("a range goes from one written value to another", one.column)
            ends.append(self.values.literal(left, one))
        if len(ends[0]) != 1 or len(ends[1]) != 1:
            raise FilterError("a range goes from one value to one", low.column)
        return range_of(ends[0][0], ends[1][0], high.column)

    def _test_of(self, left: Expression, operator: str, written: Word | Quoted) -> Any:
        wanted = self.values.literal(left, written)
        if isinstance(wanted[0], Instant):
            return When(operator, wanted[0])
        if operator not in ORDERED:
            check_equal(left, wanted[0], written)
        if operator in ORDERED:
            check_reach(left, operator, wanted[0], written)
        if operator in ORDERED and len(wanted) > 1:
            raise FilterError(f"{written.text!r} is {len(wanted)} stations: they have no order", written.column)
        return With(operator, wanted)

    # searches

    def _contains(self, parsed: Contains) -> TestNode:
        left = self._searched(parsed, "contains")
        part = parsed.part
        if not isinstance(part, Word | Quoted):
            raise FilterError("contains is followed by a text or octets", part.column)
        text = FieldType(Kind.TEXT, digits=True) if left.type.kind is not Kind.OCTETS else left.type
        (wanted,) = value_of(part, text, left.words, self.names.stations, left.spelled)
        assert isinstance(wanted, str | bytes)
        if left.size is not None and len(wanted) > left.size:
            refuse_size(left, wanted, part)
        if isinstance(wanted, str) and not parsed.alike:
            check_holding(left, wanted, part)
        words = f"{left.words} contains {spelled(part)}"
        node = leaf(left, Holding(wanted, parsed.alike), parsed.quantifier == "all", words)
        if left.field in ("hex", "frame.octets") and isinstance(wanted, bytes) and wanted:
            from sniff.filter.octets import holding

            return Leaf(node.ask, holding(wanted), words)
        return node

    def _searched(self, parsed: Contains | Matches, word: str) -> Expression:
        """The text or octets in which something is looked for."""
        left = self.values.field_of(parsed.value)
        if left.type.kind not in (Kind.TEXT, Kind.OCTETS, Kind.ANY):
            raise FilterError(
                f"{word} asks texts and octets; {left.words} is {article(left.type)}, string({left.words}) a text",
                parsed.column,
            )
        return left

    def _matches(self, parsed: Matches) -> TestNode:
        left = self._searched(parsed, "matches")
        if not isinstance(parsed.pattern, Word | Quoted):
            raise FilterError("matches is followed by a regular expression", parsed.pattern.column)
        pattern = pattern_of(parsed.pattern.text, parsed.pattern.column)
        check_fitting(left, pattern, parsed.pattern)
        words = f"{left.words} matches {spelled(parsed.pattern)}"
        return leaf(left, Fitting(pattern, left.spelled), parsed.quantifier == "all", words)


MIRRORED = {"<": ">", "<=": ">=", ">": "<", ">=": "<="}
"""Operators from the other side."""


def range_of(first: Any, last: Any, column: int) -> Any:
    """A test of values from one to another. Raises FilterError."""
    if isinstance(first, Instant) and isinstance(last, Instant):
        if first.daily is not last.daily:
            raise FilterError("a range of times has two dates or none", column)
        if not first.daily and last.time < first.time:
            raise FilterError("the range ends before it begins", column)
        return During(first, last)
    if compared("<", last, first):
        raise FilterError("the range ends before it begins", column)
    return Between(first, last)


def _items(parsed: Among) -> str:
    return ", ".join(f"{spelled(low)}..{spelled(high)}" if high else spelled(low) for low, high in parsed.items)


def _together(tests: Sequence[Any]) -> Any:
    """Tests of which one must accept, those for equal values as one."""
    equal = [test for test in tests if isinstance(test, With)]
    rest = [test for test in tests if not isinstance(test, With)]
    one = [With("==", tuple(value for test in equal for value in test.wanted))] if equal else []
    every = [*one, *rest]
    return every[0] if len(every) == 1 else AnyOf(every)
