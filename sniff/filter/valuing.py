"""Values of a filter: fields, their parts, what functions and arithmetic make of them, what is written. Pure."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from dissectors.field_types import FieldType, Kind
from dissectors.line import MS, NS_PER_S
from dissectors.words import exact_duration
from sniff.analysis.json_text import iso
from sniff.filter.agreeing import article, check_alike, check_range, spelled
from sniff.filter.errors import FilterError
from sniff.filter.expressions import NUMERIC, Expression, constant, counted, each, extreme, reckoned, sliced
from sniff.filter.literals import Instant, is_word_of, value_of
from sniff.filter.naming import Names
from sniff.filter.syntax import Arithmetic, Call, Quoted, Slice, Value, Word


class Values:
    """What is written between operators, as something that rows have."""

    def __init__(self, names: Names) -> None:
        self.names = names

    def field_or_none(self, value: Value) -> Expression | None:
        """What a row has; None for what is only written. A word that is no field is a value."""
        if isinstance(value, Quoted):
            return None
        if isinstance(value, Word):
            return self.names.field(value) if self.names.type(value.text) is not None else None
        return self.of(value)

    def field_of(self, value: Value) -> Expression:
        """The same, where a field must be. Raises FilterError."""
        found = self.field_or_none(value)
        if found is None:
            raise self.names.no_field(value, spelled(value))
        return found

    def of(self, value: Value) -> Expression:
        """What a row has of it. Raises FilterError."""
        if isinstance(value, Slice):
            return self._slice(value)
        if isinstance(value, Call):
            return self._call(value)
        if isinstance(value, Arithmetic):
            return self._arithmetic(value)
        if isinstance(value, Word):
            return self.names.field(value)
        raise FilterError(f"expected a field, not {value.text!r}", value.column)

    def literal(self, left: Expression, written: Word | Quoted) -> tuple[Any, ...]:
        """What was written, as values of what it is compared with. Raises FilterError."""
        found: tuple[Any, ...]
        if written.text == "" and left.type.kind is Kind.TEXT:
            return ("",)
        found = value_of(written, left.type, left.words, self.names.stations, left.spelled)
        for one in found:
            check_range(left, one, written)
        zone, started = self.names.scope.zone, self.names.scope.started or 0
        if zone is not None:
            return tuple(one.local(zone, started) if isinstance(one, Instant) else one for one in found)
        return found

    def prefers_word(self, left: Expression, written: Value) -> bool:
        """Whether a word is meant as one of the values of what it is compared with, though there is such a field."""
        if not isinstance(written, Word):
            return isinstance(written, Quoted)
        if is_word_of(written.text, left.type):
            return True
        if left.type.kind is Kind.STATION and written.text.lower() in self.names.stations:
            return True
        other = self.names.type(written.text)
        return other is not None and left.type.kind is Kind.TEXT and other.kind is not Kind.TEXT

    # parts and functions

    def _slice(self, value: Slice) -> Expression:
        of = self.of(value.of)
        if of.type.kind not in (Kind.OCTETS, Kind.TEXT, Kind.ANY):
            raise FilterError(f"{of.words} is {article(of.type)} and has no octets (frame.octets has)", value.column)
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
                check_alike(of, part, call.column)
            self._numeric(of, call)
            return extreme(parts, words, min if call.name == "min" else max)
        if call.name == "abs":
            self._numeric(of, call)
            return each(of, words, FieldType(kind, unit=of.type.unit), abs)
        if call.name == "string":
            return each(of, words, FieldType(Kind.TEXT, digits=True), lambda found: _as_text(found, of.type))
        if kind not in (Kind.TEXT, Kind.OCTETS, Kind.ANY) or (kind is Kind.OCTETS and call.name != "len"):
            raise FilterError(f"{call.name}() takes a text; {of.words} is {article(of.type)}", call.column)
        if call.name == "len":
            type = FieldType(Kind.NUMBER, least=0)
            return each(of, words, type, lambda found: len(found) if hasattr(found, "__len__") else 0)
        make: Callable[[Any], Any] = str.lower if call.name == "lower" else str.upper
        made = each(of, words, FieldType(Kind.TEXT, digits=True), lambda found: make(str(found)))
        return replace(made, letters=call.name)

    def _arguments(self, call: Call) -> list[Expression]:
        """What a function is of; min and max also of written values, as the first field among them has them."""
        found = [self.field_or_none(one) if call.name in ("min", "max") else self.of(one) for one in call.arguments]
        field = next((one for one in found if one is not None), None)
        parts: list[Expression] = []
        for one, written in zip(found, call.arguments, strict=True):
            if one is None:
                assert isinstance(written, Word | Quoted)
                if field is None or (
                    isinstance(written, Word) and not written.text[0].isdigit() and written.text[0] != "-"
                ):
                    raise self.names.no_field(written, spelled(written))
                made = self.literal(field, written)[0]
                if isinstance(made, Instant | str | bytes):
                    raise FilterError(f"expected a number, not {written.text!r}", written.column)
                one = replace(constant(made, written.text, field.type), fixed=True)
            parts.append(one)
        return parts

    def _numeric(self, of: Expression, call: Call) -> None:
        if of.type.kind not in NUMERIC and of.type.kind is not Kind.ANY:
            raise FilterError(f"{call.name}() takes a number; {of.words} is {article(of.type)}", call.column)

    # arithmetic

    def _arithmetic(self, value: Arithmetic) -> Expression:
        left, right = self.field_or_none(value.left), self.field_or_none(value.right)
        scaling = value.operator in ("*", "/", "%", "&")
        known = left or right
        number = FieldType(Kind.NUMBER)
        sides: list[Expression] = []
        fixed: list[Any] = []
        for one, written in ((left, value.left), (right, value.right)):
            if one is None:
                assert isinstance(written, Word | Quoted)
                type = number if known is None or scaling else _difference(known.type)
                (made,) = value_of(written, type, "a number", self.names.stations)[:1]
                if isinstance(made, Instant | str | bytes):
                    raise FilterError(f"expected a number, not {written.text!r}", written.column)
                if value.operator == "&" and known is not None:
                    check_range(known, made, written)
                one = constant(made, written.text, type)
                fixed.append(made)
            else:
                fixed.append(None)
            if one.type.kind not in NUMERIC and one.type.kind is not Kind.ANY:
                raise FilterError(f"{value.operator} takes numbers; {one.words} is {article(one.type)}", written.column)
            sides.append(one)
        if value.operator in ("/", "%") and fixed[1] == 0:
            raise FilterError(f"nothing is divided by 0: {value.operator} 0 has no value", value.right.column)
        kind = self._kind_of(value, sides)
        unit = next((one.type.unit for one in sides if one.type.unit), "s")
        least, most = _reach(value.operator, sides, fixed) if kind is Kind.NUMBER else (None, None)
        return reckoned(value.operator, sides[0], sides[1], FieldType(kind, unit=unit, least=least, most=most), fixed)

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


def _difference(type: FieldType) -> FieldType:
    """What is added to, or taken from, something of that type."""
    if type.kind is Kind.TIME:
        return FieldType(Kind.DURATION, unit="s")
    return FieldType(Kind.DURATION, unit=type.unit) if type.kind is Kind.DURATION else FieldType(Kind.NUMBER)


def _reach(operator: str, sides: Sequence[Expression], fixed: Sequence[Any]) -> tuple[int | None, int | None]:
    """The least and the most that comes of whole numbers; None: nobody can tell."""
    ends = [
        (number, number) if isinstance(number, int) else (one.type.least, one.type.most)
        for one, number in zip(sides, fixed, strict=True)
    ]
    (low, high), (least, most) = ends
    if low is None or least is None:
        return None, None
    if operator == "+":
        return low + least, None if high is None or most is None else high + most
    if operator == "-":
        return (None, None) if most is None else (low - most, None if high is None else high - least)
    if operator == "*" and low >= 0 and least >= 0:
        return low * least, None if high is None or most is None else high * most
    if operator == "%" and low >= 0 and isinstance(fixed[1], int) and fixed[1] > 0:
        return 0, fixed[1] - 1 if high is None else min(high, fixed[1] - 1)
    if operator == "&" and low >= 0 and isinstance(fixed[1], int) and fixed[1] >= 0:
        return 0, fixed[1] if high is None else min(high, fixed[1])
    return None, None


def _as_text(found: Any, type: FieldType) -> str:
    if isinstance(found, bytes):
        return found.hex()
    if type.kind is Kind.DURATION:
        return exact_duration(found, MS if type.unit == "ms" else NS_PER_S)
    return iso(found) if type.kind is Kind.TIME else str(found)
