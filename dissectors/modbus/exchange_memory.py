"""The tracker's memory, as far as regular exchanges need it and change it.

What the tracker learns decides a few things of a regular exchange. No answer may come later than 4/5 of the master's
timeout; a copy that comes at once must not be an echo; the copy of a write must come in time by the station's last 16
writes; and what is unanswered must have been waited for longer than an answer and a pause may take, and about as long
as others. `holding` says how far a run stands from what is known where it is taken up (`Known`), as far as the run
itself has not shown more; `passed` what the tracker would remember of exchanges that went by without it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from dissectors.columns import FrameColumns, Masks, Times
from dissectors.line import Timing
from dissectors.modbus.exchange_columns import GIVE_UP, SAMPLES, TO_ALL, ExchangeColumns
from dissectors.modbus.learned_timing import READ, UNLEARNT_LIMIT, WRITE, LearnedTiming

ANSWERED: Final = 4
"""Exchanges that the tracker keeps of those that were answered."""

GIVEN_UP: Final = 8
"""And of those that were not."""

PAUSES: Final = 32
"""Pauses that it keeps of the master."""

VOTES: Final = 5
"""So many sure answers without an echo before them, and the bus has none, whatever was thought before."""

HORIZON: Final = 1 << 14
"""Exchanges looked at in one go: a run that goes on is taken up again."""

_ANSWER_CHARS: Final = 32  # as in learned_timing.py
_REPEATED_AT_ONCE: Final = 50_000_000  # ns, as in the tracker: no master repeats a request sooner
_NEVER: Final = 1 << 62
_UNITS: Final = 256


@dataclass(frozen=True, slots=True)
class Known:
    """What the tracker has learnt where a run begins.

    `timeout`: the master's, ns, or None. `echoing`: whether the bus repeats requests at once; None while unlearnt.
    `writes`: the newest response times of writes, ns, by station; that of a copy which closed last among them.
    `unanswered`: how long the master waited for the last unanswered requests, ns. `slowest`: the longest of all
    response times kept. `pause`: the longest pause of the master kept, that before the first request among them.
    """

    timeout: int | None
    echoing: bool | None
    writes: Mapping[int, Sequence[int]]
    unanswered: Sequence[int] = ()
    slowest: int = 0
    pause: int = 0


@dataclass(frozen=True, slots=True)
class Passed:
    """What the tracker would remember of exchanges that went by without it, beside the first request's pause.

    `times`: the newest response times of each station and pace, ns, in order. `pauses`: the master's newest, ns, each
    with the time since the request before. `sure`: by station, answers that had no echo before them. `answered`:
    places of the newest exchanges that were answered, in order; `given_up`: of those that were not, `unanswered`: how
    long the master waited for them, ns. `units`: stations that answered; `heard`: each of them with the place of its
    last answer.
    """

    times: Mapping[tuple[int, int], Sequence[int]]
    pauses: Sequence[tuple[int, int]]
    sure: Mapping[int, int]
    answered: Sequence[int]
    units: frozenset[int]
    given_up: Sequence[int]
    unanswered: Sequence[int]
    heard: Sequence[tuple[int, int]]


def holding(
    found: ExchangeColumns, frames: FrameColumns, place: int, known: Known, timing: Timing, since: int | None = None
) -> int:
    """Place behind the last exchange that stands, where the tracker is at rest before the one at `place`.

    `known`: what it has learnt. `since`: from which exchange of the run on all has gone by or was tracked; `place` if
    not given. At most HORIZON exchanges are looked at.
    """
    end = min(int(np.searchsorted(found.run, found.run[place], side="right")), place + HORIZON)
    end = _first(_impatient(found, frames, place, end, known, timing), place, end)
    if known.echoing is not False:
        sure = np.cumsum(found.sure[place:end] & found.answered[place:end])
        copies = found.copy if known.echoing else found.at_once  # an echo comes when it usually does
        end = _first(copies[place:end] & (sure < (VOTES if known.echoing else 1)), place, end)
    begin = int(np.searchsorted(found.run, found.run[place]))
    warm = SAMPLES + (place if since is None else since) - begin
    end = _first_late(found, place, end, warm, known, LearnedTiming(timing).tolerance)
    while end > place and (found.unanswered[end - 1] or found.garbled[end - 1]):  # it closes with the next request
        end -= 1
    return end


def _impatient(
    found: ExchangeColumns, frames: FrameColumns, place: int, end: int, known: Known, timing: Timing
) -> Masks:
    """Which exchanges [place, end) do not surely stand by what is known of the master's timeout there."""
    part = slice(place, end)
    gap, answered, unanswered = found.gap[part], found.answered[part], found.unanswered[part]
    low, high = (known.timeout, known.timeout) if known.timeout is not None else (_NEVER, 0)
    limit = max(7 * timing.char // 2, timing.char + timing.latency, _REPEATED_AT_ONCE)
    if not unanswered.any():
        late: Masks = answered & (gap // 4 + 1 > low // 5)
        return late | _impatient_of_damage(found, place, end, limit, low, high)
    so_far = np.cumsum(unanswered) > unanswered  # a request before it was unanswered
    least = min(known.unanswered, default=_NEVER)
    most = max(known.unanswered, default=0)
    least_so_far = np.minimum(_before(np.minimum.accumulate(np.where(unanswered, gap, _NEVER)), _NEVER), least)
    most_so_far = np.maximum(_before(np.maximum.accumulate(np.where(unanswered, gap, 0)), 0), most)
    lows, highs = np.where(so_far, least_so_far, low), np.maximum(most_so_far, high)
    slowest = np.maximum(_before(np.maximum.accumulate(np.where(answered, gap, 0)), 0), known.slowest)
    request = found.request[part]
    pause = np.zeros(len(gap), np.int64)
    pause[1:] = frames.start[request[1:]] - frames.end[request[:-1] + answered[:-1]]
    pause[1:] *= answered[:-1]
    pauses = np.maximum(np.maximum.accumulate(pause), known.pause)
    enough = slowest + _ANSWER_CHARS * timing.char + pauses * 11 // 10
    usual = (gap > enough) & (gap < GIVE_UP) & (gap // 3 < lows // 2) & (2 * gap >= highs) & (gap >= limit)
    doubtful: Masks = (answered & (gap // 4 + 1 > lows // 5)) | (unanswered & ~usual)
    return doubtful | _impatient_of_damage(found, place, end, limit, lows, highs)


def _impatient_of_damage(
    found: ExchangeColumns, place: int, end: int, limit: int, low: Times | int, high: Times | int
) -> Masks:
    """Which exchanges with a damaged answer do not surely wait for the next request: given up before it, or it may be
    an echo of theirs. `low`, `high`: the master's timeout at least and at most."""
    garbled = found.garbled[place:end]
    if not garbled.any():
        return garbled
    gap = found.gap[place:end]
    again = np.append(found.repeat[place + 1 : end + 1], np.zeros(max(0, end + 1 - len(found)), bool))
    waits = (gap // 3 < low // 2) & (~again | ((gap >= limit) & (8 * gap >= high)))
    doubtful: Masks = garbled & ~waits
    return doubtful


def _before(values: Times, first: int) -> Times:
    """Each value moved one place on."""
    moved: Times = np.append(first, values[:-1])
    return moved


def _first(which: Masks, place: int, end: int) -> int:
    """Place of the first of them, counted from `place`; `end` if there is none."""
    at = int(np.argmax(which)) if len(which) else 0
    return place + at if len(which) and which[at] else end


def _first_late(found: ExchangeColumns, place: int, end: int, warm: int, known: Known, tolerance: int) -> int:
    """Place of the first copy that does not surely come in time; looks one by one at those with few before them."""
    part = slice(place, end)
    doubtful = found.copy[part] & (found.samples[part] < warm)
    if not doubtful.any():
        return end
    last = place + int(np.flatnonzero(doubtful)[-1])
    times: dict[int, deque[int]] = {}
    for at in (place + np.flatnonzero(found.writes[part] & found.answered[part])).tolist():
        if at > last:
            break
        unit, gap = int(found.unit[at]), int(found.gap[at])
        if unit not in times:
            times[unit] = deque(known.writes.get(unit, ()), maxlen=SAMPLES)
        if found.copy[at]:
            limit = _limit(times[unit], tolerance)
            if gap > (UNLEARNT_LIMIT if limit is None and known.timeout is None else limit or gap):
                return at
        elif not found.sure[at]:
            continue
        times[unit].append(gap)
    return end


def _limit(times: Sequence[int], tolerance: int) -> int | None:
    """As `LearnedTiming.response_limit`, less what the master's timeout does to it."""
    if len(times) < 2:
        return None
    ordered = sorted(times)
    slowest = ordered[-2] if len(ordered) > 3 else ordered[-1]
    return slowest + slowest // 2 + tolerance


def passed(found: ExchangeColumns, frames: FrameColumns, place: int, end: int) -> Passed:
    """What the tracker would remember of exchanges [place, end)."""
    part = slice(place, end)
    answered, unit = found.answered[part], found.unit[part]
    told = answered & (found.sure[part] | found.copy[part])
    if end > place and found.copy[end - 1]:
        told[-1] = False  # a copy teaches when the next request has come
    at = told.nonzero()[0]
    key = unit[at] << 1 | found.writes[part][at]
    order = np.argsort(key, kind="stable")
    gaps, key = found.gap[part][at[order]].tolist(), key[order]
    ends = [*((key[1:] != key[:-1]).nonzero()[0] + 1).tolist(), len(key)]
    times, begin = {}, 0
    for behind in ends if gaps else ():
        one = int(key[begin])
        times[one >> 1, WRITE if one & 1 else READ] = gaps[max(begin, behind - SAMPLES) : behind]
        begin = behind
    asks = answered[:-1] & (found.sure[part][1:] | (frames.role[found.request[part][1:]] == TO_ALL))
    asks |= answered[:-1] & (unit[1:] != unit[:-1])
    at = place + 1 + asks.nonzero()[0][-PAUSES:]
    start = frames.start[found.request[at]]
    pause = np.maximum(start - frames.end[found.request[at - 1] + found.answered[at - 1]], 0)
    cycle = start - frames.start[found.request[at - 1]]
    answers = answered.nonzero()[0]
    newest = np.full(_UNITS, -1)
    newest[unit[answers]] = answers  # of several the last stays
    units = (newest >= 0).nonzero()[0]
    unanswered = found.unanswered[part].nonzero()[0]
    return Passed(
        times,
        list(zip(pause.tolist(), cycle.tolist(), strict=True)),
        {one: count for one, count in enumerate(np.bincount(unit[found.sure[part] & answered]).tolist()) if count},
        (place + answers[-ANSWERED:]).tolist(),
        frozenset(units.tolist()),
        (place + unanswered[-GIVEN_UP:]).tolist(),
        found.gap[part][unanswered[-SAMPLES:]].tolist(),
        list(zip(units.tolist(), (place + newest[units]).tolist(), strict=True)),
    )


def heard(went: Passed, place: int, tx: int) -> dict[int, int]:
    """Of each unit the transaction that it answered last, where the exchanges from `place` on go by as `tx` and on."""
    return {unit: tx + at - place for unit, at in went.heard}


def outlives(found: ExchangeColumns, at: int, end: int) -> bool:
    """Whether an exchange before `end` was not answered, and one directly behind it with the same unit was."""
    unit = found.unit[at]
    while (found.unanswered[at] or found.garbled[at]) and at + 1 < end and found.unit[at + 1] == unit:
        at += 1
        if found.answered[at]:
            return True
    return False
