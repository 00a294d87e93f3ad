"""Tests of single values, and of many numbers at once. Pure."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sniff.filter.errors import FilterError
from sniff.filter.literals import DAY, Instant

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


@dataclass(frozen=True, slots=True)
class When:
    """Times that compare so with an instant; equal is what lies within its step."""

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
        time = time % DAY if wanted.daily else time
        if self.operator in ("==", "==="):
            return (time >= wanted.time) & (time < wanted.time + wanted.step)
        if self.operator in ("!=", "!=="):
            return (time < wanted.time) | (time >= wanted.time + wanted.step)
        return COMPARE[self.operator](time, wanted.time)


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
        time = time % DAY if self.low.daily else time
        if self.low.daily and self.high.time < self.low.time:
            return (time >= self.low.time) | (time <= self.high.time)
        return (time >= self.low.time) & (time <= self.high.time)


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
