"""Two groups of response times to one and the same request: a sign of two devices with one address. Pure.

    |    ....:::..                      .:::::.        only where the longest reading of every quick answer
    +----quick------ a clear gap ---------slow----->   lies below the shortest reading of every slow one

Only answers to exactly the same request are compared, so function and length cannot make the groups, and only by the
bounds that the adapter leaves, so its delays cannot either. The two must take turns: a drift or a single change has
long runs of one kind.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from dissectors.histogram import width
from dissectors.quick_values import quickly_made
from dissectors.tracker import Interval

ANSWERS_KEPT = 96
ANSWERS_LEAST = 32
GROUP_LEAST = 8
GROUP_SHARE = 1 / 8
GAP_LEAST = 3_000_000
"""ns between the groups; what a device's main loop adds is mostly less."""

_FIRST_KEPT = 8  # response times, of which the median is taken
_FEW_VALUES = 3  # different answers of a group, up to which it says something that the two groups have none in common


@quickly_made
@dataclass(frozen=True, slots=True)
class AnsweredRequest:
    """One answer: its row, how long it took, its octets."""

    no: int
    time: int
    latency: Interval
    octets: bytes


@dataclass(frozen=True, slots=True)
class Groups:
    """Quick and slow answers to one request, each sorted by time taken. `apart`: what they say differs, too."""

    quick: tuple[AnsweredRequest, ...]
    slow: tuple[AnsweredRequest, ...]
    apart: bool

    @property
    def smaller(self) -> int:
        """How many answers the smaller group has."""
        return min(len(self.quick), len(self.slow))


@dataclass(slots=True)
class SameRequest:
    """The last answers to one and the same request, in the order they came, and how long the first of all took."""

    first: list[Interval] = field(default_factory=list)
    answers: deque[AnsweredRequest] = field(default_factory=lambda: deque(maxlen=ANSWERS_KEPT))

    def add(self, answers: Sequence[AnsweredRequest]) -> None:
        """Take the next ones."""
        self.first += [answer.latency for answer in answers[: _FIRST_KEPT - len(self.first)]]
        self.answers.extend(answers)

    def needed(self, places: Sequence[int]) -> Sequence[int]:
        """Of the places of the next ones those that are remembered: the first of all, and the last."""
        missing = _FIRST_KEPT - len(self.first)
        if missing <= 0 or len(places) <= ANSWERS_KEPT:
            return places[-ANSWERS_KEPT:]
        return [*places[:missing], *places[max(missing, len(places) - ANSWERS_KEPT) :]]

    def rose(self) -> int | None:
        """By how much the median response time rose from the first ones to the last, ns: 0 where it is not half as long
        again by the bounds that the adapter leaves; None while they are too few."""
        if len(self.first) < _FIRST_KEPT or len(self.answers) < 2 * _FIRST_KEPT:
            return None
        from statistics import median  # with fractions, decimals and random numbers

        last = [answer.latency for answer in self.answers][-_FIRST_KEPT:]
        before, after = median([one.high for one in self.first]), median([one.low for one in last])
        return round(after - before) if 2 * after > 3 * before else 0

    def groups(self) -> Groups | None:
        """The two groups that they fall into; None where they do not, or where it cannot be known."""
        answers = self.answers
        if len(answers) < ANSWERS_LEAST:
            return None
        if max(a.latency.low for a in answers) - min(a.latency.high for a in answers) < GAP_LEAST:
            return None
        ordered = sorted(answers, key=lambda answer: answer.latency.nominal)
        times = [answer.latency.nominal for answer in ordered]
        cut = max(range(1, len(times)), key=lambda at: times[at] - times[at - 1])
        quick, slow = ordered[:cut], ordered[cut:]
        if min(len(quick), len(slow)) < max(GROUP_LEAST, GROUP_SHARE * len(ordered)):
            return None
        gap = min(a.latency.low for a in slow) - max(a.latency.high for a in quick)
        if gap < max(GAP_LEAST, width(times[:cut]), width(times[cut:])):
            return None
        if not self._take_turns(frozenset(answer.no for answer in quick), len(quick), len(slow)):
            return None
        return Groups(tuple(quick), tuple(slow), _say_different_things(quick, slow))

    def _take_turns(self, quick: frozenset[int], of_quick: int, of_slow: int) -> bool:
        """Whether there are at least half as many runs of one kind as chance would make (Wald and Wolfowitz 1940)."""
        kinds = [answer.no in quick for answer in self.answers]
        runs = 1 + sum(a != b for a, b in pairwise(kinds))
        return runs >= 1 + of_quick * of_slow / (of_quick + of_slow)


def _say_different_things(quick: Sequence[AnsweredRequest], slow: Sequence[AnsweredRequest]) -> bool:
    by_quick, by_slow = {answer.octets for answer in quick}, {answer.octets for answer in slow}
    return max(len(by_quick), len(by_slow)) <= _FEW_VALUES and by_quick.isdisjoint(by_slow)
