"""Tests of points: which of a filter's tests speak of values that frames tell, and what each asks of one. Pure."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from dissectors.field_types import FieldType, Kind
from sniff.filter.agreeing import ORDERED, spelled
from sniff.filter.comparing import ALL_OF, COMPARE, Fitting, Holding, pattern_of
from sniff.filter.errors import FilterError
from sniff.filter.literals import is_word_of, value_of
from sniff.filter.naming import Names
from sniff.filter.plan import Leaf
from sniff.filter.syntax import (
    Among,
    Compared,
    Contains,
    Joined,
    Matches,
    Not,
    Present,
    Quoted,
    Test,
    Value,
    Word,
)
from sniff.filter.told import POINT, VALUE, Quantity, ToldTest, either, of_name, of_value, quantity, there, together

_MIRRORED = {"<": ">", "<=": ">=", ">": "<", ">=": "<="}


class Points:
    """Compiles tests of points."""

    def __init__(self, names: Names) -> None:
        self.names = names

    def test(self, parsed: Test) -> Leaf | None:
        """A single test as a question to rows; None where it is not of points, or asks for more than one value."""
        made = self._single(parsed)
        if made is None:
            return None
        return made.leaf(self.names.scope, _is_of_every(parsed))

    def together(self, parsed: Joined) -> tuple[Leaf | None, tuple[Test, ...]]:
        """Tests of `point` and `value` between && as one question of one value, and all other tests."""
        if parsed.operator != "&&":
            return None, parsed.parts
        wanted = [part for part in parsed.parts if not isinstance(part, Not) and self._speaks_of_any(part)]
        if not wanted:
            return None, parsed.parts
        refused = [part for part in parsed.parts if isinstance(part, Not) and self._speaks_of_any(part.inner)]
        if len(wanted) + len(refused) < 2:
            return None, parsed.parts
        one = self._all_of(wanted, refused)
        rest = tuple(part for part in parsed.parts if part not in wanted and part not in refused)
        return one.leaf(self.names.scope), rest

    def _all_of(self, wanted: Sequence[Test], refused: Sequence[Test]) -> ToldTest:
        yes = [self._made(part) for part in wanted]
        no = [self._made(part.inner) for part in refused if isinstance(part, Not)]
        words = " and ".join([*(one.words for one in yes), *(f"not {one.words}" for one in no)])
        return together(yes, no, f"one value: {words}")

    def _made(self, parsed: Test) -> ToldTest:
        if isinstance(parsed, Joined):
            if parsed.operator == "||":
                parts = [self._made(part) for part in parsed.parts]
                return either(parts, f"({' or '.join(part.words for part in parts)})")
            wanted = [part for part in parsed.parts if not isinstance(part, Not)]
            return self._all_of(wanted, [part for part in parsed.parts if isinstance(part, Not)])
        if isinstance(parsed, Not):
            return self._all_of([], [parsed])
        made = self._single(parsed)
        assert made is not None
        return made

    def _speaks_of_any(self, parsed: Test) -> bool:
        """Whether it speaks of nothing but `point` and `value`."""
        if isinstance(parsed, Joined):
            return parsed.operator in ("&&", "||") and all(map(self._speaks_of_any, parsed.parts))
        if isinstance(parsed, Not):
            return self._speaks_of_any(parsed.inner)
        name = self._name_of(parsed)
        return name in (POINT, VALUE) and not _is_quantified(parsed)

    # single tests

    def _name_of(self, parsed: Test) -> str | None:
        """The point that a test of written values speaks of, `point` or `value`; None for any other test."""
        if isinstance(parsed, Joined | Not):
            return None
        if isinstance(parsed, Compared):
            left, right = self._name(parsed.left), self._name(parsed.right)
            if left is not None and self._is_written(parsed.right, left):
                return left
            return right if right is not None and self._is_written(parsed.left, right) else None
        found = self._name(parsed.value)
        if found is None or not isinstance(parsed, Among):
            return found
        written = all(self._is_written(one, found) for item in parsed.items for one in item if one is not None)
        return found if written else None

    def _name(self, value: Value) -> str | None:
        if not isinstance(value, Word) or self.names.type(value.text) is None:
            return None
        return value.text if self.names.field(value).told else None

    def _is_written(self, value: Value, name: str) -> bool:
        """Whether it is no field: a quantity, a word, a text. A name beside `point` is that of a point."""
        if isinstance(value, Quoted):
            return True
        if not isinstance(value, Word):
            return False
        type = self.names.type(name)
        known = name == POINT or (type is not None and is_word_of(value.text, type))
        return known or self.names.type(value.text) is None

    def _single(self, parsed: Test) -> ToldTest | None:
        name = self._name_of(parsed)
        if name is None:
            return None
        type = self.names.type(name)
        assert type is not None
        if isinstance(parsed, Present):
            return there(name)
        if isinstance(parsed, Compared):
            operator, literal = parsed.operator, parsed.right
            if self._name(parsed.left) != name:
                operator, literal = _MIRRORED.get(operator, operator), parsed.left
            assert isinstance(literal, Word | Quoted)
            return self._compared(name, type, operator, literal, f"{name} {operator} {spelled(literal)}")
        if isinstance(parsed, Among):
            tests = [self._item(name, type, low, high) for low, high in parsed.items]
            made = either(tests, " or ".join(test.words for test in tests))
            return ToldTest(tests[0].meant, made.accepts, tests[0].any_point, made.words)
        if isinstance(parsed, Contains):
            return self._contains(name, parsed)
        assert isinstance(parsed, Matches)
        if not isinstance(parsed.pattern, Word | Quoted):
            raise FilterError("matches is followed by a regular expression", parsed.pattern.column)
        fits = Fitting(pattern_of(parsed.pattern.text, parsed.pattern.column))
        return of_name(name, fits, f"{name} matches {spelled(parsed.pattern)}")

    def _compared(self, name: str, type: FieldType, operator: str, literal: Word | Quoted, words: str) -> ToldTest:
        if name == POINT:
            if operator in ORDERED:
                raise FilterError("the names of points have no order", literal.column)
            wanted = self._point(literal, type)
            return of_name(name, lambda one: COMPARE[operator](one, wanted), words)
        asked = quantity(literal, name, type, self.names.scope.devices)
        if asked.text is not None and operator in ORDERED:
            raise FilterError(f"{name} is compared with a number, {literal.text!r} is none", literal.column)
        if asked.text is not None and operator in ("!=", "!=="):
            says = of_value(name, _never, asked, words)
            return ToldTest(says.meant, lambda one: not says.accepts(one), says.any_point, words)
        return of_value(name, lambda number: lambda value: COMPARE[operator](value, number), asked, words)

    def _point(self, literal: Word | Quoted, type: FieldType) -> str:
        try:
            (wanted,) = value_of(literal, type, POINT, {})
        except FilterError:
            if type.words:
                raise
            raise FilterError(
                f"unknown point {literal.text!r}: no station has a profile (-d STATION=PROFILE), "
                'and points without one are named like "holding/40108"',
                literal.column,
            ) from None
        assert isinstance(wanted, str)
        return wanted

    def _item(self, name: str, type: FieldType, low: Value, high: Value | None) -> ToldTest:
        assert isinstance(low, Word | Quoted)
        if high is None:
            return self._compared(name, type, "==", low, f"{name} == {spelled(low)}")
        assert isinstance(high, Word | Quoted)
        if name == POINT:
            raise FilterError("the names of points have no order", low.column)
        (least, _), (most, unit) = self._number(name, type, low), self._number(name, type, high)
        if most < least:
            raise FilterError("the range ends before it begins", high.column)
        asked = Quantity(least, unit, None)
        words = f"{name} in {spelled(low)}..{spelled(high)}"
        return of_value(name, lambda number: lambda value: number <= value <= most, asked, words)

    def _number(self, name: str, type: FieldType, written: Word | Quoted) -> tuple[int | float, str]:
        asked = quantity(written, name, type, self.names.scope.devices)
        if asked.number is None:
            raise FilterError(f"{name} is compared with a number, {written.text!r} is none", written.column)
        return asked.number, asked.unit

    def _contains(self, name: str, parsed: Contains) -> ToldTest:
        if not isinstance(parsed.part, Word | Quoted):
            raise FilterError("contains is followed by a text", parsed.part.column)
        (wanted,) = value_of(parsed.part, FieldType(Kind.TEXT, digits=True), name, {})
        assert isinstance(wanted, str)
        return of_name(name, Holding(wanted, parsed.alike), f"{name} contains {spelled(parsed.part)}")


def _never(number: int | float) -> Callable[[Any], bool]:
    return lambda value: False


def _is_quantified(parsed: Test) -> bool:
    return isinstance(parsed, Compared | Among | Contains | Matches) and parsed.quantifier == "all"


def _is_of_every(parsed: Test) -> bool:
    if _is_quantified(parsed):
        return True
    return isinstance(parsed, Compared) and not parsed.quantifier and parsed.operator in ALL_OF
