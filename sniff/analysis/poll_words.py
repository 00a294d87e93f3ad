"""The words of the master's programme: what an entry asks, and when it changed, for people and programs. Pure."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise

from dissectors.line import NS_PER_S
from dissectors.profiles import Devices
from dissectors.profiles.decoding import plain_name
from dissectors.profiles.model import Profile
from dissectors.questions import Span
from dissectors.words import duration
from sniff.analysis.holes import Holes
from sniff.analysis.poll import Poll

MOST_NAMES = 3
"""Names of one span that are told."""

MOST_PARTS = 4
"""Spans of one request that are told."""

SPARE = 10 * NS_PER_S
"""So long after the programme began, or before it ended, an entry may still be one of all of it."""

_GROUP = 8  # requests that a stretch holds at least, so that one more or less tells nothing
_AFTER = 8  # stretches after a turn whose rate is told
_FEW = 3  # requests of which coming and going are told
_UNEVEN = 0.15  # part of the usual number by which one stretch may differ from the next


def asked(poll: Poll, devices: Devices, room: int = 0) -> str:
    """ "output-frequency, output-current (holding/49505 ×2)"; empty where it names nothing. `room`: cells; where that
    is too long for them, names stand without their place."""
    question, profile = poll.key.question, devices.at(poll.key.station)
    spans = question.spans[:MOST_PARTS]
    said = [_said(span, None if question.behind else profile) for span in spans]
    if room and len("; ".join(said)) > room:
        said = [_said(span, None if question.behind else profile, with_place=False) for span in spans]
    left = len(question.spans) - MOST_PARTS
    said += [f"and {left} more"] if left > 0 else []
    words = "; ".join(said)
    return f"{question.behind}: {words}".removesuffix(": ") if question.behind else words


def _said(span: Span, profile: Profile | None, with_place: bool = True) -> str:
    place = plain_name(span.space, span.address) + (f" ×{span.count}" if span.count > 1 else "")
    part = f"/{span.part}" if span.part else ""
    place = f"write {place}{part}" if span.writes else f"{place}{part}"
    names = [] if profile is None else _names(span, profile)
    if not names:
        return place
    more = "…" if len(names) > MOST_NAMES else ""
    named = f"{', '.join(names[:MOST_NAMES])}{more}{part}"
    if not with_place:
        return f"write {named}" if span.writes else named
    return f"{named} ({place})"


def _names(span: Span, profile: Profile) -> list[str]:
    """Names of what the profile knows of it, each once; one more than are told."""
    found: dict[str, None] = {}
    for address in range(span.address, span.address + min(span.count, 256)):
        entry = profile.at(span.space, address)
        if entry is not None and not entry.reserved:
            found[entry.name] = None
        if len(found) > MOST_NAMES:
            break
    return list(found)


class ChangeKind(Enum):
    """What became of an entry."""

    BEGAN = "began"
    ENDED = "ended"
    PAUSED = "paused"
    CHANGED = "every"


@dataclass(frozen=True, slots=True)
class Change:
    """When an entry changed: `time`, ns, right to `within`. `interval`: ns, from then on; None: not asked."""

    what: ChangeKind
    time: int
    within: int
    interval: int | None = None


def changes(poll: Poll, begin: int, end: int, holes: Holes | None = None) -> list[Change]:
    """When an entry came, went, or was asked oftener or more seldom. `begin`, `end`: of the whole programme, ns; what
    was asked in its `holes` nobody knows."""
    if poll.first is None or poll.last is None or poll.asked < _FEW:
        return []
    holes = holes or Holes()
    found, spare, near = [], max(2 * (poll.cycle.most or 0), SPARE), 2 * (poll.interval or 0)
    if poll.first - begin - holes.within(begin, poll.first) > spare:
        found.append(Change(ChangeKind.BEGAN, poll.first, holes.before(poll.first, near), poll.interval))
    found += _turns(poll, holes)
    if end - poll.last - holes.within(poll.last, end) > spare:
        found.append(Change(ChangeKind.ENDED, poll.last, holes.after(poll.last, near)))
    return found


def _turns(poll: Poll, holes: Holes) -> list[Change]:
    """Where the rate became another one for good: two stretches after each other that differ from those before. Only
    of what is asked by the clock: what comes in bursts changes all the time."""
    counts, width, interval = poll.slices.counts, poll.slices.width, poll.every.mean
    if not counts or not interval:
        return []
    step = max(1, math.ceil(_GROUP * interval / width))  # slices of a stretch
    low, high, long = min(counts), max(counts), step * width
    groups = [0] * ((high - low) // step + 1)
    for place, count in counts.items():
        groups[(place - low) // step] += count
    whole = range(1, len(groups) - 1)  # the outer ones may not be whole
    heard = [at for at in whole if not holes.within(low * width + at * long, low * width + (at + 1) * long)]
    groups = [groups[at] for at in heard]
    if len(groups) < 4 or not _is_even(groups):
        return []
    turns = _turning(groups)
    found: list[Change] = []
    for at, until in pairwise([*turns, len(groups)]):
        after = groups[at + 1 : min(until, at + 1 + _AFTER)]  # the first is partly as it was before
        rate, time = sum(after) / len(after), low * width + heard[at] * long
        within = (heard[at] - heard[at - 1]) * long
        found.append(
            Change(ChangeKind.CHANGED, time, within, round(long / rate))
            if rate
            else Change(ChangeKind.PAUSED, time, within)
        )
    return found


def _turning(groups: Sequence[int]) -> list[int]:
    """The stretches from which on there are more or fewer."""
    found: list[int] = []
    since = 0
    for at in range(2, len(groups) - 1):
        if at - since < 2:
            continue
        mean = sum(groups[since:at]) / (at - since)
        by = groups[at] - mean, groups[at + 1] - mean
        if min(map(abs, by)) >= max(0.4 * mean, 3) and (by[0] > 0) == (by[1] > 0):
            since = at + 1
            found.append(at)
    return found


def _is_even(groups: Sequence[int]) -> bool:
    """Whether one stretch mostly holds as many as the next."""
    steps = sorted(abs(one - other) for one, other in pairwise(groups))
    return steps[len(steps) * 4 // 5] <= max(1, _UNEVEN * sum(groups) / len(groups))


def told(found: Iterable[Change], clock: Callable[[int], str]) -> str:
    """ "every 5.00 s from 10:02:03 on; ended 10:09:00"; `clock` writes a time. "~": right to some seconds."""
    said = []
    for one in found:
        when = f"{'~' if one.within else ''}{clock(one.time)}"
        if one.what is ChangeKind.CHANGED and one.interval is not None:
            said.append(f"every {duration(one.interval)} from {when} on")
        else:
            said.append(f"{one.what.value} {when}")
    return "; ".join(said)
