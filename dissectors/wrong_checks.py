"""Checks that a sender makes wrongly, each time in the same way, in frames that are right otherwise. Pure.

Noise changes other bits each time; a program that computes another check differs alike in all frames of a length (a
CRC with another start value), or makes it by a rule of its own (a sum that is not negated). A protocol names the ways
in which a check may be wrong; what says the same each time may be spoilt alike, so two different right checks belong
to a way at least.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final

from dissectors.findings import Tally, together

_LEAST = 5  # frames
_GROUP_LEAST = 3  # of one length, before it is a system
_KEPT = 64  # ways that a value belongs to


@dataclass(frozen=True, slots=True)
class Mistake:
    """How checks are wrong. `words`: behind "right but for the check". `means`: what makes them so; empty where nobody
    knows more. `by_chance`: whether it makes a check right now and then."""

    words: str
    means: str = ""
    by_chance: bool = True


ALIKE: Final = Mistake("which always differs alike", by_chance=False)
NOT_MADE: Final = Mistake(
    "which is all zeros or all ones, whatever the frame says", "the sender's program does not compute the check"
)
SAME: Final = Mistake(
    "octet for octet the same each time",
    "no noise, which is never the same twice: the device makes its check wrongly, or another one always speaks into it "
    "at the same moment",
)
BY_ANOTHER_RULE: Final = "the sender's program makes the check by another rule than this protocol's"


@dataclass(frozen=True, slots=True)
class Way:
    """A mistake; with the value that is always the same, and the length of the frame, where they belong to it.
    `is_certain`: one frame of it shows that it is no damage."""

    mistake: Mistake
    value: int | None = None
    octets: int = 0
    is_certain: bool = False


@dataclass(slots=True)
class _WrongCheck:
    """Frames whose check is wrong in one way. `right`: two of the checks that would have been right."""

    tally: Tally = field(default_factory=Tally)
    right: set[int] = field(default_factory=set)


def _together(one: _WrongCheck, other: _WrongCheck) -> _WrongCheck:
    return _WrongCheck(together((one.tally, other.tally)), set(sorted(one.right | other.right)[:2]))


@dataclass(frozen=True, slots=True)
class Habit:
    """What a sender does with its checks: how often, and the frames of one length in which it shows best."""

    mistake: Mistake
    count: int
    tally: Tally

    def told(self, check: str) -> str:
        """What is wrong with them, in words. `check`: what the protocol calls it."""
        if self.mistake == SAME:  # what they say may be spoilt, too
            return f"damaged, {self.mistake.words}"
        return f"right but for the {check}, {self.mistake.words}"


@dataclass(slots=True)
class WrongChecks:
    """The damaged frames of one sender."""

    _ways: dict[Way, _WrongCheck] = field(default_factory=dict)

    def see(self, no: int, time: int, ways: Iterable[tuple[Way, int]]) -> None:
        """Take the next one, in that row: the ways in which its check is wrong, each with the one that is right."""
        for way, right in ways:
            if way not in self._ways and way.value is not None and len(self._ways) >= _KEPT:
                continue
            wrong = self._ways.setdefault(way, _WrongCheck())
            wrong.tally.add(time, no)
            if len(wrong.right) < 2:
                wrong.right.add(right)

    def copy(self) -> WrongChecks:
        """The same, to go on with on its own."""
        return WrongChecks({way: _together(wrong, _WrongCheck()) for way, wrong in self._ways.items()})

    def merge(self, later: WrongChecks) -> WrongChecks:
        """Both together, as a new value."""
        merged = self.copy()
        for way, wrong in later._ways.items():
            if way not in merged._ways and way.value is not None and len(merged._ways) >= _KEPT:
                continue
            merged._ways[way] = _together(merged._ways.get(way, _WrongCheck()), wrong)
        return merged

    def habit(self, damaged: int, good: int) -> Habit | None:
        """What most of the `damaged` frames of the sender have in common, `good` others of which were heard; None
        where it is not the sender's own doing."""
        if damaged < _LEAST or not self._ways:
            return None
        made = [habit for mistake in self._mistakes() if (habit := self._of(mistake)) is not None]
        best = max(made, key=lambda habit: habit.count, default=None)
        if best is None or best.count < _LEAST or 4 * best.count < 3 * damaged:
            return None
        allowed = best.count // 4 if best.mistake.by_chance else 0
        return best if good <= allowed else None

    def same(self, damaged: int) -> Habit | None:
        """What most of the `damaged` frames of the sender are where all of those say the same: spoilt alike by whoever
        spoils them."""
        ways = [wrong for way, wrong in self._ways.items() if way.mistake == ALIKE and len(wrong.right) == 1]
        tally = max((wrong.tally for wrong in ways), key=lambda tally: tally.count, default=Tally())
        is_so = tally.count >= _LEAST and 4 * tally.count >= 3 * damaged
        return Habit(SAME, tally.count, tally) if is_so else None

    def _mistakes(self) -> list[Mistake]:
        """Those that were seen; last those that say least."""
        seen = dict.fromkeys(way.mistake for way in self._ways)
        return sorted(seen, key=lambda mistake: (mistake == ALIKE, mistake == NOT_MADE))

    def _of(self, mistake: Mistake) -> Habit | None:
        always: dict[int, Tally] = {}  # the commonest way among frames of one length
        for way, wrong in self._ways.items():
            if way.mistake != mistake or not (way.is_certain or len(wrong.right) > 1):
                continue
            if way.octets not in always or wrong.tally.count > always[way.octets].count:
                always[way.octets] = wrong.tally
        same = [tally for tally in always.values() if tally.count >= _GROUP_LEAST]
        if not same:
            return None
        return Habit(mistake, sum(tally.count for tally in same), max(same, key=lambda tally: tally.count))
