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
import numpy.typing as npt

from dissectors.columns import Times
from sniff.analysis.holes import Holes
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

_MOST_ALIKE = 256
"""Frames of one tap that one of the other may be; of more it tells nothing."""


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


def matched(first: TapFrames, second: TapFrames, doubt: int, holes: tuple[Holes, Holes] | None = None) -> Matched:
    """Pair two taps. `doubt`: ns that both adapters together may hold octets back. `holes`: of each tap. Frames outside
    the time in which both taps listened are left out."""
    ours, theirs = _common(first, second), _common(second, first)
    pairs = _best_paired(first, second, ours[first.good[ours]], theirs[second.good[theirs]], doubt)
    delays = _delays(first, second, pairs)
    listened = holes or (Holes(), Holes())
    left = (
        _listened_to(first, np.setdiff1d(ours, pairs[0]), delays[EVERYBODY], second, listened[1], doubt),
        _listened_to(second, np.setdiff1d(theirs, pairs[1]), -delays[EVERYBODY], first, listened[0], doubt),
    )
    others = _Comparison((first, second), left, delays, doubt + NEARBY).crossings()
    return Matched(*pairs, tuple(others))


def _common(one: TapFrames, other: TapFrames) -> Times:
    """Places of what came while the other tap listened too, with a second at either end."""
    if not len(one) or not len(other):
        return np.arange(len(one))
    margin = REACH // 2
    inside = (one.end >= other.start[0] - margin) & (one.start <= other.end[-1] + margin)
    return np.flatnonzero(inside)


def _listened_to(one: TapFrames, places: Times, delay: int, other: TapFrames, holes: Holes, doubt: int) -> Times:
    """Those of some frames that are no good frame at the other tap but came while it listened for certain: between its
    first octet and its last, and in no hole. A frame that is damaged itself tells what befell another one."""
    if not len(other):
        return places
    start, end = one.start[places] + delay, one.end[places] + delay
    inside = (start >= other.start[0] + doubt) & (end <= other.end.max() - doubt)
    if holes.ends:
        near, begins, ends = doubt + NEARBY, np.array(holes.begins, np.int64), np.array(holes.ends, np.int64)
        next_hole = np.searchsorted(ends, start - near)  # the first that is not over by then
        begins = np.append(begins, np.iinfo(np.int64).max)
        inside &= end + near < begins[next_hole]
    kept: Times = places[inside | ~one.good[places]]
    return kept


def _best_paired(first: TapFrames, second: TapFrames, at: Times, to: Times, doubt: int) -> tuple[Times, Times]:
    """Which of the good frames at these places are the same. Polls are alike in each round: where one tap began later,
    those of one round look like those of another. So times decide as far as more frames are found the same with them.
    """
    nearly = [near + abs(_usual_delay(first, second, at, to, near)) for near in (doubt, doubt + NEARBY)]
    found = [_paired(first, second, at, to, min(reach, REACH)) for reach in (*nearly, REACH)]
    return max(found, key=lambda pairs: len(pairs[0]))


def _usual_delay(first: TapFrames, second: TapFrames, at: Times, to: Times, near: int) -> int:
    """ns from the first tap to the second that most frames have, told by those that stand out."""
    at = at[:_TOGETHER]
    order = np.lexsort((second.end[to], second.key[to]))
    keys, ends = second.key[to][order], second.end[to][order]
    delays: list[Times] = []
    weights: list[npt.NDArray[np.float64]] = []
    for key, end in zip(first.key[at].tolist(), first.end[at].tolist(), strict=True):
        begin, over = (int(np.searchsorted(keys, np.uint64(key), side)) for side in ("left", "right"))
        alike = ends[begin:over]
        low, high = np.searchsorted(alike, [end - REACH, end + REACH + 1]).tolist()
        if low < high <= low + _MOST_ALIKE:
            delays.append(alike[low:high] - end)
            weights.append(np.full(high - low, 1 / (high - low)))
    if not delays:
        return 0
    apart, weight = np.concatenate(delays), np.concatenate(weights)
    order = np.argsort(apart, kind="stable")
    apart, summed = apart[order], np.append(0.0, np.cumsum(weight[order]))
    last = np.searchsorted(apart, apart + near, "right")
    within = summed[last] - summed[:-1]
    best = np.flatnonzero(within >= 0.999 * within.max())
    halves = np.searchsorted(summed, (summed[best] + summed[last[best]]) / 2)
    middles = apart[np.clip(halves - 1, best, last[best] - 1)]
    return int(middles[np.argmin(np.abs(middles))])


def _paired(first: TapFrames, second: TapFrames, at: Times, to: Times, reach: int) -> tuple[Times, Times]:
    """The same by frames that are never more than `reach` apart, ns; ascending at both taps."""
    keys, others = first.key[at], second.key[to]
    ends, other_ends = first.end[at], second.end[to]
    ours: list[Times] = []
    theirs: list[Times] = []
    i = j = 0
    while i < len(keys) and j < len(others):
        count = min(_TOGETHER, len(keys) - i, len(others) - j)
        same = keys[i : i + count] == others[j : j + count]
        same &= np.abs(ends[i : i + count] - other_ends[j : j + count]) <= reach
        run = int(np.argmin(same)) if not same.all() else count
        if run:
            ours.append(np.arange(i, i + run))
            theirs.append(np.arange(j, j + run))
            i, j = i + run, j + run
        if run == count:
            continue
        step = _next_common(keys, others, ends, other_ends, i, j, reach)
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


def _next_common(
    keys: Keys, others: Keys, ends: Times, other_ends: Times, i: int, j: int, reach: int
) -> tuple[int, int] | None:
    """The nearest places further on where both sides go on alike: fewest frames passed over, then nearest in time."""
    here, there = keys[i : i + AHEAD], others[j : j + AHEAD]
    rows, columns = np.nonzero(here[:, None] == there[None, :])
    if not len(rows):
        return None
    apart = np.abs(ends[i + rows] - other_ends[j + columns])
    near = apart <= reach
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
