"""Tests of single values, and of many numbers at once. Pure."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sniff.filter.errors import FilterError
from sniff.filter.literals import Instant

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from dissectors.columns import Masks

Value = int | float | str | bytes

COMPARE: dict[str, Callable[[Any, Any], bool]] = {
    "==": operator.eq,
    "!=": operator.ne,
    "===": operator.eq,
    "!==": operator.ne,
    ">=": operator.ge,
    "<=": operator.le,
    ">": operator.gt,
    "<": operator.lt,
}
ALL_OF = frozenset(("!=", "==="))
"""Operators that hold of a field only where they hold of each of its values."""


def compared(name: str, found: Value, wanted: Value) -> bool:
    """Whether two values compare so; values of two sorts never do."""
    if isinstance(found, str) and isinstance(wanted, str):
        return COMPARE[name](found, wanted)
    if isinstance(found, str) or isinstance(wanted, str) or isinstance(found, bytes) is not isinstance(wanted, bytes):
        return False
    return COMPARE[name](found, wanted)


@dataclass(frozen=True, slots=True)
class With:
    """Values that compare so with one of `wanted`; with all of them for "!=" and "!=="."""

    operator: str
    wanted: Sequence[Value]

    def __call__(self, found: Value) -> bool:
        return self._join()(compared(self.operator, found, wanted) for wanted in self.wanted)

    def _join(self) -> Callable[[Any], bool]:
        return all if self.operator in ("!=", "!==") else any

    def many(self, values: npt.NDArray[np.number[Any]]) -> Masks:
        """The same for numbers."""
        import numpy as np

        chosen: Masks | None = None
        for wanted in self.wanted:
            said = np.asarray(COMPARE[self.operator](values, wanted), bool)
            joined = chosen if chosen is None else (chosen & said if self._join() is all else chosen | said)
            chosen = said if joined is None else joined
        return np.zeros(len(values), bool) if chosen is None else chosen

    def of_all(self, least: int, most: int) -> bool | None:
        """What it says of all numbers from one to another, where that is the same."""
        said = [_of_all(self.operator, least, most, wanted) for wanted in self.wanted]
        deciding = self._join() is any
        if deciding in said:
            return deciding
        return None if None in said else not deciding


def _of_all(operator: str, least: int, most: int, wanted: Value) -> bool | None:
    if not isinstance(wanted, int | float):
        return None
    compare = COMPARE[operator]
    if operator in ("==", "===", "!=", "!=="):
        same = least == most == wanted
        return compare(least, wanted) if same or not least <= wanted <= most else None
    low, high = compare(least, wanted), compare(most, wanted)
    return low if low is high else None


@dataclass(frozen=True, slots=True)
class Between:
    """Values from one to another, both of them too."""

    low: Value
    high: Value

    def __call__(self, found: Value) -> bool:
        return compared(">=", found, self.low) and compared("<=", found, self.high)

    def many(self, values: npt.NDArray[np.number[Any]]) -> Masks:
        """The same for numbers."""
        import numpy as np

        low: Any = self.low
        high: Any = self.high
        return np.asarray((values >= low) & (values <= high), bool)

    def of_all(self, least: int, most: int) -> bool | None:
        """What it says of all numbers from one to another, where that is the same."""
        if not isinstance(self.low, int | float) or not isinstance(self.high, int | float):
            return None
        if self.low <= least and most <= self.high:
            return True
        return False if most < self.low or least > self.high else None


@dataclass(frozen=True, slots=True)
class When:
    """Times that compare so with an instant; equal is what lies within its step, before and after what does not."""

    operator: str
    wanted: Instant

    def __call__(self, found: Value) -> bool:
        return isinstance(found, int) and bool(self._of(found))

    def many(self, values: npt.NDArray[np.number[Any]]) -> Masks:
        """The same for many times."""
        import numpy as np

        return np.asarray(self._of(values), bool)

    def _of(self, time: Any) -> Any:
        wanted = self.wanted
        time = wanted.of(time)
        if self.operator in ("==", "==="):
            return (time >= wanted.time) & (time < wanted.time + wanted.step)
        if self.operator in ("!=", "!=="):
            return (time < wanted.time) | (time >= wanted.time + wanted.step)
        last = wanted.time + wanted.step - 1
        return COMPARE[self.operator](time, last if self.operator in ("<=", ">") else wanted.time)

    def of_all(self, least: int, most: int) -> bool | None:
        """What it says of all times from one to another, where that is the same."""
        shift = self.wanted.one_day(least, most)
        if shift is None:
            return None
        first, last = least - shift, most - shift
        begin, end = self.wanted.time, self.wanted.time + self.wanted.step
        if self.operator in ("==", "===", "!=", "!=="):
            if first < end and last >= begin and not (first >= begin and last < end):
                return None
        elif bool(self._of(least)) is not bool(self._of(most)):
            return None
        return bool(self._of(least))


@dataclass(frozen=True, slots=True)
class During:
    """Times from one instant to another, both of them too; over midnight where the second is the earlier one."""

    low: Instant
    high: Instant

    def __call__(self, found: Value) -> bool:
        return isinstance(found, int) and bool(self._of(found))

    def many(self, values: npt.NDArray[np.number[Any]]) -> Masks:
        """The same for many times."""
        import numpy as np

        return np.asarray(self._of(values), bool)

    def _of(self, time: Any) -> Any:
        time = self.low.of(time)
        if self.low.daily and self.high.time < self.low.time:
            return (time >= self.low.time) | (time <= self._last)
        return (time >= self.low.time) & (time <= self._last)

    @property
    def _last(self) -> int:
        """ns; the last of the times that are equal to the second."""
        return self.high.time + self.high.step - 1

    def of_all(self, least: int, most: int) -> bool | None:
        """What it says of all times from one to another, where that is the same."""
        shift = self.low.one_day(least, most)
        if shift is None or (self.low.daily and self.high.time < self.low.time):
            return None
        return Between(self.low.time, self._last).of_all(least - shift, most - shift)


@dataclass(frozen=True, slots=True)
class AnyOf:
    """Values that one of several tests accepts."""

    tests: Sequence[Any]

    def __call__(self, found: Value) -> bool:
        return any(test(found) for test in self.tests)

    def many(self, values: npt.NDArray[np.number[Any]]) -> Masks:
        """The same for numbers."""
        import numpy as np

        chosen: Masks = np.zeros(len(values), bool)
        for test in self.tests:
            chosen |= test.many(values)
        return chosen


class There:
    """Every value."""

    def of_all(self, least: int, most: int) -> bool | None:
        """All of them."""
        return True

    def __call__(self, found: Value) -> bool:
        return True

    def many(self, values: npt.NDArray[np.number[Any]]) -> Masks:
        """The same for numbers."""
        import numpy as np

        return np.ones(len(values), bool)


class NotZero:
    """Numbers but 0."""

    def __call__(self, found: Value) -> bool:
        return found != 0

    def many(self, values: npt.NDArray[np.number[Any]]) -> Masks:
        """The same for numbers."""
        chosen: Masks = values != 0
        return chosen


@dataclass(frozen=True, slots=True)
class Holding:
    """Texts and octets that hold others. `alike`: capitals do not matter."""

    wanted: str | bytes
    alike: bool = False

    def __call__(self, found: Value) -> bool:
        if isinstance(self.wanted, str) and self.alike:
            return isinstance(found, str) and self.wanted.lower() in found.lower()
        if isinstance(self.wanted, str):
            return isinstance(found, str) and self.wanted in found
        return isinstance(found, bytes) and self.wanted in found


@dataclass(frozen=True, slots=True)
class Fitting:
    """Texts in which a regular expression finds something; octets as characters of the same number.

    `spelled`: the octets as hex digits; what is found begins with an octet.
    """

    pattern: re.Pattern[str]
    spelled: bool = False

    def __call__(self, found: Value) -> bool:
        if isinstance(found, bytes):
            if self.spelled:
                text = found.hex()
                return any(self.pattern.match(text, at) is not None for at in range(0, len(text) + 1, 2))
            found = found.decode("latin-1")
        return isinstance(found, str) and self.pattern.search(found) is not None


def pattern_of(text: str, column: int) -> re.Pattern[str]:
    """A regular expression, without regard to case unless it begins with (?-i). Raises FilterError."""
    minding = text.startswith("(?-i)")
    text = text.removeprefix("(?-i)")
    if len(text) > _LONGEST:
        raise FilterError(f"a regular expression of more than {_LONGEST} characters", column)
    if posix := _POSIX.search(text):
        raise FilterError(f"regular expression: {posix[1]} is not known here: write [A-Za-z], [0-9] or such", column)
    try:
        return re.compile(text, re.DOTALL if minding else re.IGNORECASE | re.DOTALL)
    except (re.error, RecursionError, OverflowError) as error:
        raise FilterError(f"regular expression: {error}", column) from None


_LONGEST = 500
_POSIX = re.compile(r"\[[^\]]*(\[:\^?[a-z]+:\])")
