"""Matches of frames at two taps: in order, by octets, never further apart in time than a line can hold.

Frames that are good at both taps are paired first; what lies between two such pairs is then compared: a good frame
beside something damaged at the same moment was damaged, beside nothing it is missing, beside another good frame it was
changed on its way.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

import numpy as np

from dissectors.columns import Times
from sniff.taps.frames import Keys, TapFrames

REACH = 2_000_000_000
"""ns: what comes later than this is another frame."""

AHEAD = 64
"""So many frames further on a common one is looked for, where the two sides differ."""

NEARBY = 20_000_000
"""ns that a damaged frame may lie off the expected moment, beside what the adapters hold back."""

EVERYBODY = -2
"""Stands for all senders."""

_TOGETHER = 4096
"""Rows that are compared in one step."""


class CrossingOutcome(Enum):
    """What became of a frame between the taps."""

    DAMAGED = "damaged"
    MISSING = "missing"
    CHANGED = "changed"


@dataclass(frozen=True, slots=True)
class Crossing:
    """One frame. `first`, `second`: places at either tap, None where it is missing. `good_at`: 0 or 1, the tap that
    heard it as it was sent."""

    outcome: CrossingOutcome
    first: int | None
    second: int | None
    good_at: int = 0


@dataclass(frozen=True, slots=True)
class Matched:
    """All frames. `first`, `second`: places of those heard well at both taps, pair by pair; `others`: the rest."""

    first: Times
    second: Times
    others: tuple[Crossing, ...]


def matched(first: TapFrames, second: TapFrames, doubt: int) -> Matched:
    """Pair two taps. `doubt`: ns that both adapters together may hold octets back. Frames outside the time in which
    both taps listened are left out."""
    ours, theirs = _common(first, second), _common(second, first)
    pairs = _paired(first, second, ours[first.good[ours]], theirs[second.good[theirs]])
    left = np.setdiff1d(ours, pairs[0]), np.setdiff1d(theirs, pairs[1])
    others = _Comparison((first, second), left, _delays(first, second, pairs), doubt + NEARBY).crossings()
    return Matched(*pairs, tuple(others))


def _common(one: TapFrames, other: TapFrames) -> Times:
    """Places of what came while the other tap listened too, with a second at either end."""
    if not len(one) or not len(other):
        return np.arange(len(one))
    margin = REACH // 2
    inside = (one.end >= other.start[0] - margin) & (one.start <= other.end[-1] + margin)
    return np.flatnonzero(inside)


def _paired(first: TapFrames, second: TapFrames, at: Times, to: Times) -> tuple[Times, Times]:
    """Which of the good frames at these places are the same, ascending at both taps."""
    keys, others = first.key[at], second.key[to]
    ends, other_ends = first.end[at], second.end[to]
    ours: list[Times] = []
    theirs: list[Times] = []
    i = j = 0
    while i < len(keys) and j < len(others):
        count = min(_TOGETHER, len(keys) - i, len(others) - j)
        same = keys[i : i + count] == others[j : j + count]
        same &= np.abs(ends[i : i + count] - other_ends[j : j + count]) <= REACH
        run = int(np.argmin(same)) if not same.all() else count
        if run:
            ours.append(np.arange(i, i + run))
            theirs.append(np.arange(j, j + run))
            i, j = i + run, j + run
        if run == count:
            continue
        step = _next_common(keys, others, ends, other_ends, i, j)
        if step is None:
            # nothing near is common: whoever is behind in time goes on
            if ends[i] <= other_ends[j]:
                i += 1
            else:
                j += 1
        else:
            i, j = step
    nothing = np.zeros(0, np.int64)
    return at[np.concatenate([nothing, *ours])], to[np.concatenate([nothing, *theirs])]


def _next_common(keys: Keys, others: Keys, ends: Times, other_ends: Times, i: int, j: int) -> tuple[int, int] | None:
    """The nearest places further on where both sides go on alike: fewest frames passed over, then nearest in time."""
    here, there = keys[i : i + AHEAD], others[j : j + AHEAD]
    rows, columns = np.nonzero(here[:, None] == there[None, :])
    if not len(rows):
        return None
    apart = np.abs(ends[i + rows] - other_ends[j + columns])
    near = apart <= REACH
    if not near.any():
        return None
    rows, columns, apart = rows[near], columns[near], apart[near]
    passed_over = rows + columns + _goes_astray(keys, others, i + rows, j + columns)
    best = np.lexsort((apart, np.maximum(rows, columns), passed_over))
    return i + int(rows[best[0]]), j + int(columns[best[0]])


def _goes_astray(keys: Keys, others: Keys, rows: Times, columns: Times) -> Times:
    """A penalty where the frames behind a common one differ: polls are all alike, and the wrong round looks right."""
    after, after_other = np.minimum(rows + 1, len(keys) - 1), np.minimum(columns + 1, len(others) - 1)
    astray: Times = np.where(keys[after] == others[after_other], 0, 2)
    return astray


def _delays(first: TapFrames, second: TapFrames, pairs: tuple[Times, Times]) -> dict[int, int]:
    """ns from the first tap to the second, as a rule, by sender; of all together under `EVERYBODY`."""
    delays, senders = second.end[pairs[1]] - first.end[pairs[0]], first.sender[pairs[0]]
    usual = {EVERYBODY: int(np.median(delays)) if len(delays) else 0}
    for sender in np.unique(senders).tolist():
        usual[sender] = int(np.median(delays[senders == sender]))
    return usual


class _Comparison:
    """What is left at either tap, compared by the moments at which it should have come."""

    def __init__(
        self, taps: tuple[TapFrames, TapFrames], left: tuple[Times, Times], delays: dict[int, int], near: int
    ) -> None:
        self._taps = taps
        self._left = [each.tolist() for each in left]
        self._ends = [tap.end[each].tolist() for tap, each in zip(taps, left, strict=True)]
        self._good = [tap.good[each].tolist() for tap, each in zip(taps, left, strict=True)]
        self._taken = [[False] * len(each) for each in left]
        self._delays = delays
        self._near = near

    def crossings(self) -> list[Crossing]:
        """Of all that is left: damaged ones first, so that nobody else takes what is theirs."""
        found = []
        for outcome, good in ((CrossingOutcome.DAMAGED, False), (CrossingOutcome.CHANGED, True)):
            for tap in (0, 1):
                found += list(self._beside(tap, outcome, good))
        for tap in (0, 1):
            for at, place in enumerate(self._left[tap]):
                if self._good[tap][at] and not self._taken[tap][at]:
                    here = (place, None) if tap == 0 else (None, place)
                    found.append(Crossing(CrossingOutcome.MISSING, here[0], here[1], tap))
        return found

    def _beside(self, tap: int, outcome: CrossingOutcome, good: bool) -> Iterator[Crossing]:
        """Good frames of one tap that something at the other stands for."""
        frames, other = self._taps[tap], 1 - tap
        for at, place in enumerate(self._left[tap]):
            if self._taken[tap][at] or not self._good[tap][at]:
                continue
            delay = self._delays.get(int(frames.sender[place]), self._delays[EVERYBODY])
            if outcome is CrossingOutcome.CHANGED and (delay < 0) != (tap == 1):
                continue  # it is seen from where it was sent
            there = self._nearest(other, self._ends[tap][at] + (delay if tap == 0 else -delay), good)
            if there is None:
                continue
            same_length = frames.length[place] == self._taps[other].length[self._left[other][there]]
            if outcome is CrossingOutcome.CHANGED and not same_length:
                continue
            self._taken[tap][at] = self._taken[other][there] = True
            far = self._left[other][there]
            yield Crossing(outcome, place, far, tap) if tap == 0 else Crossing(outcome, far, place, tap)

    def _nearest(self, tap: int, moment: int, good: bool) -> int | None:
        ends = self._ends[tap]
        best, least = None, self._near + 1
        for at in range(bisect_left(ends, moment - self._near), len(ends)):
            if ends[at] > moment + self._near:
                break
            apart = abs(ends[at] - moment)
            if apart < least and not self._taken[tap][at] and self._good[tap][at] is good:
                best, least = at, apart
        return best
