"""Values of points in filters: `output-frequency > 30 Hz`, `point == "output frequency" && value > 30 Hz`. Pure.

What frames tell of points is handed in by `Scope.told`. Tests of `point` and `value` that stand together between && are
asked of one and the same value of a frame.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from dissectors.field_types import FieldType, Kind, plain_word
from dissectors.profiles import Devices
from dissectors.profiles.decoding import Value as Decoded
from dissectors.profiles.decoding import digits
from dissectors.profiles.model import Kind as EntryKind
from dissectors.tracker import Transaction
from sniff.engine.engine import Row
from sniff.filter.errors import FilterError, nearest
from sniff.filter.expressions import Expression
from sniff.filter.literals import number_of
from sniff.filter.plan import Leaf
from sniff.filter.scope import Scope, ToldPoint
from sniff.filter.syntax import Quoted, Word

if TYPE_CHECKING:
    from dissectors.columns import Masks
    from sniff.engine.table import Table
    from sniff.filter.columns import Closed, Columns

POINT, VALUE = "point", "value"
TYPES = {
    POINT: FieldType(Kind.TEXT, "name of a point whose value it carries"),
    VALUE: FieldType(Kind.NUMBER, "value of a point, with its unit or in words"),
}
"""The names that speak of all points."""

_PLAIN = re.compile(r"[A-Za-z][\w-]*/\d+(?:/.+)?")
"""How points without a profile are named."""
_NUMBER_AND_UNIT = re.compile(r"(?P<number>[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?)\s*(?P<unit>[^\d\s].*)")


def told(value: Decoded) -> ToldPoint:
    """A decoded value, as filters see it."""
    return ToldPoint(value.name, value.value, value.unit, value.words)


@dataclass(slots=True)
class _Known:
    """What profiles say of the points of one name."""

    units: list[str] = field(default_factory=list)
    words: dict[str, int | str] = field(default_factory=dict)
    titles: list[str] = field(default_factory=list)
    text: bool = False


def _known(devices: Devices) -> dict[str, _Known]:
    found: dict[str, _Known] = {}
    for profile in devices.profiles:
        for entry in profile.entries:
            if entry.reserved:
                continue
            one = found.setdefault(entry.name, _Known())
            one.units.append(entry.unit)
            one.titles.append(entry.title)
            one.text = one.text or entry.kind is EntryKind.TEXT
            one.words.update({words: number for number, words in entry.states.items()})
            for bit in entry.bits:
                switch = found.setdefault(f"{entry.name}.{bit.name}", _Known())
                switch.words.update({words: number for number, words in ((1, bit.on), (0, bit.off)) if words})
            for part in entry.parts:
                some = found.setdefault(f"{entry.name}.{part.name}", _Known())
                some.words.update({words: number for number, words in part.states.items()})
    return found


def names(devices: Devices) -> list[str]:
    """The points that profiles know."""
    return list(_known(devices))


def type_of(name: str, devices: Devices) -> FieldType:
    """`point` with the names and titles that profiles know; `value`."""
    if name == VALUE:
        return TYPES[VALUE]
    words: dict[str, int | str] = {}
    for point, known in _known(devices).items():
        words.setdefault(point, point)
        for title in known.titles:
            words.setdefault(title, point)
    return FieldType(Kind.TEXT, TYPES[POINT].says, words, closed=True, also=_PLAIN.pattern)


def type_of_point(name: str, devices: Devices) -> FieldType | None:
    """A point by its name; None where no profile has it."""
    known = _known(devices).get(name)
    if known is None:
        return None
    unit = next((unit for unit in known.units if unit), "")
    return FieldType(Kind.TEXT if known.text else Kind.NUMBER, "value of a point", known.words, unit=unit)


def expression(name: str, type: FieldType, scope: Scope) -> Expression:
    """Its values, or of `point` the names."""
    of = scope.told or _nothing

    def get(row: Row, _: Transaction | None) -> tuple[Any, ...]:
        some = of(row.no)
        if name == POINT:
            return tuple(one.name for one in some)
        return tuple(one.value for one in some if name in (VALUE, one.name))

    def columns(table: Table, closed: Closed | None) -> Columns | None:
        said = masks_of(scope)(table, closed)
        if said is None:
            return None
        import numpy as np

        from sniff.filter.columns import Numbers

        nothing = np.zeros(len(table), bool)
        return (Numbers(nothing.view(np.int8), nothing, said[1]),)

    return Expression(name, type, get, columns if scope.telling is not None else None, field=name, told=True)


def _nothing(no: int) -> Sequence[ToldPoint]:
    return ()


def masks_of(scope: Scope) -> Callable[[Table, Closed | None], tuple[Masks, Masks] | None]:
    """Rows of a table that tell something may be accepted; no other."""

    def columns(table: Table, closed: Closed | None) -> tuple[Masks, Masks] | None:
        if scope.telling is None:
            return None
        may = scope.telling(table.first, len(table))
        return may & False, may

    return columns


# --- tests of one value ---------------------------------------------------------------------------------------------

Accepts = Callable[[ToldPoint], bool]


@dataclass(frozen=True, slots=True)
class ToldTest:
    """A question to single values: those that are `meant`, and whether one is accepted. `any_point`: it speaks of all
    points, and may be joined with others of the kind."""

    meant: Accepts
    accepts: Accepts
    any_point: bool
    words: str

    def leaf(self, scope: Scope, every: bool = False) -> Leaf:
        """Rows that tell such a value; `every`: that tell some, and only such."""
        of, meant, accepts = scope.told or _nothing, self.meant, self.accepts

        def ask(row: Row, _: Transaction | None) -> bool:
            if every:
                some = [one for one in of(row.no) if meant(one)]
                return bool(some) and all(map(accepts, some))
            return any(meant(one) and accepts(one) for one in of(row.no))

        return Leaf(ask, masks_of(scope) if scope.telling is not None else None, self.words)


def together(tests: Iterable[ToldTest], refused: Iterable[ToldTest], words: str) -> ToldTest:
    """One value that all tests accept, and none of `refused`."""
    wanted, unwanted = tuple(tests), tuple(refused)

    def accepts(one: ToldPoint) -> bool:
        return all(test.accepts(one) for test in wanted) and not any(test.accepts(one) for test in unwanted)

    return ToldTest(_all, accepts, True, words)


def either(tests: Iterable[ToldTest], words: str) -> ToldTest:
    """One value that any test accepts."""
    wanted = tuple(tests)
    return ToldTest(_all, lambda one: any(test.accepts(one) for test in wanted), True, words)


def _all(one: ToldPoint) -> bool:
    return True


def of_name(name: str, accepts: Callable[[Any], bool], words: str) -> ToldTest:
    """A test of names (`point`), or of what the values of one point or of all of them are in words."""
    if name == POINT:
        return ToldTest(_all, lambda one: accepts(one.name), True, words)
    return ToldTest(_meant(name), lambda one: accepts(_text(one)), name == VALUE, words)


def _meant(name: str) -> Accepts:
    return _all if name == VALUE else lambda one: one.name == name


def _text(one: ToldPoint) -> str:
    return one.value if isinstance(one.value, str) else one.words or digits(one.value)


def there(name: str) -> ToldTest:
    """Whether there is any."""
    return ToldTest(_all if name in TYPES else _meant(name), _all, name in TYPES, f"{name} is there")


def of_value(name: str, make: Callable[[int | float], Callable[[Any], bool]], wanted: Quantity, words: str) -> ToldTest:
    """A test of numbers, of one unit where that was written; of words where those were."""
    if wanted.text is not None:
        text = plain_word(wanted.text) or wanted.text
        return ToldTest(_meant(name), lambda one: _says(one, text), name == VALUE, words)
    assert wanted.number is not None
    test, unit = make(wanted.number), wanted.unit

    def accepts(one: ToldPoint) -> bool:
        return not isinstance(one.value, str) and (not unit or one.unit == unit) and test(one.value)

    return ToldTest(_meant(name), accepts, name == VALUE, words)


def _says(one: ToldPoint, text: str) -> bool:
    said = one.value if isinstance(one.value, str) else one.words
    return (plain_word(said) or said) == text


@dataclass(frozen=True, slots=True)
class Quantity:
    """What was written as a value: a number with its unit ("" for none), or a text."""

    number: int | float | None
    unit: str
    text: str | None


def quantity(written: Word | Quoted, name: str, type: FieldType, devices: Devices) -> Quantity:
    """A value as it was written, checked against what profiles know. Raises FilterError."""
    text = written.text.strip()
    number = None if isinstance(written, Quoted) else number_of(text)
    if number is not None:
        return Quantity(number, "", None)
    match = _NUMBER_AND_UNIT.fullmatch(text)
    if match is not None:
        found = number_of(match["number"].lstrip("+"))
        assert found is not None
        return Quantity(found, _unit(match["unit"], name, devices, written.column), None)
    known = _known(devices)
    if name == VALUE:
        words = {word: word for one in known.values() for word in one.words}
        open_ended = not known or any(one.text for one in known.values())
    else:
        words = {word: word for word in type.words}
        open_ended = type.kind is Kind.TEXT
    if not open_ended and plain_word(text) not in {plain_word(word) for word in words}:
        said = f"unknown {name} {text!r} ({nearest(text, words)})" if words else f"{name} is a number, {text!r} is not"
        raise FilterError(said, written.column)
    return Quantity(None, "", text)


def _unit(unit: str, name: str, devices: Devices, column: int) -> str:
    known = _known(devices)
    units = dict.fromkeys(one for each in known.values() for one in each.units if one)
    if name != VALUE:
        units = dict.fromkeys(one for one in known[name].units if one) if name in known else {}
        if not units:
            raise FilterError(f"{name} has no unit, not {unit!r}", column)
    found = next((one for one in units if one == unit), None) or next(
        (one for one in units if one.lower() == unit.lower()), None
    )
    if found is None and not units:
        raise FilterError("no point has a unit here: -d STATION=PROFILE says what stations are", column)
    if found is None:
        raise FilterError(f"{name} is in {', '.join(units)}, not in {unit!r}", column)
    return found
