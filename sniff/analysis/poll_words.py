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


def changes(poll: Poll, begin: int, end: int) -> list[Change]:
    """When an entry came, went, or was asked oftener or more seldom. `begin`, `end`: of the whole programme, ns."""
    if poll.first is None or poll.last is None or poll.asked < _FEW:
        return []
    found, spare = [], max(2 * (poll.cycle.most or 0), SPARE)
    if poll.first - begin > spare:
        found.append(Change(ChangeKind.BEGAN, poll.first, 0, poll.interval))
    found += _turns(poll)
    if end - poll.last > spare:
        found.append(Change(ChangeKind.ENDED, poll.last, 0))
    return found


def _turns(poll: Poll) -> list[Change]:
    """Where the rate became another one for good: two stretches after each other that differ from those before. Only
    of what is asked by the clock: what comes in bursts changes all the time."""
    counts, width, interval = poll.slices.counts, poll.slices.width, poll.every.mean
    if not counts or not interval:
        return []
    step = max(1, math.ceil(_GROUP * interval / width))  # slices of a stretch
    low, high = min(counts), max(counts)
    groups = [0] * ((high - low) // step + 1)
    for place, count in counts.items():
        groups[(place - low) // step] += count
    groups = groups[1:-1]  # the outer ones may not be whole
    if len(groups) < 4 or not _is_even(groups):
        return []
    begin, long = (low + step) * width, step * width
    found: list[Change] = []
    since = 0
    for at in range(2, len(groups) - 1):
        if at - since < 2:
            continue
        mean = sum(groups[since:at]) / (at - since)
        by = groups[at] - mean, groups[at + 1] - mean
        if min(map(abs, by)) >= max(0.4 * mean, 3) and (by[0] > 0) == (by[1] > 0):
            since = at
            after = groups[at : at + _AFTER]
            rate, time = sum(after) / len(after), begin + at * long
            change = (
                Change(ChangeKind.CHANGED, time, long, round(long / rate))
                if rate
                else Change(ChangeKind.PAUSED, time, long)
            )
            found.append(change)
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
