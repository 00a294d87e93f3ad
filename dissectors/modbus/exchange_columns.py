"""Pairing by columns: regular exchanges of a Modbus line, for all frames of a capture at once.

Regular is what `ModbusTracker` decides by the octets of two neighbouring frames, as long as it waits for nothing:

    a request, and its answer or an exception directly behind it     reads, writes of several: shape tells which is what
    a write of one register or coil, and its copy or an exception    by turns, behind a regular exchange
    a write to all stations                                          behind a regular exchange

Regular exchanges directly behind one another are a *run*. The contract, held by a property test: if the tracker is at
rest where an exchange of a run begins (nothing is open, waits or is doubted, and what closed last was answered), it
gives that exchange and those behind it, as far as `holding` says, exactly as `placed` has them. All else goes through
the tracker: what is unanswered, damaged, late, repeated, said twice the same, and functions that few use.

What the tracker learns decides three things of a regular exchange, so `holding` asks for it (`Known`): no answer may
come later than 4/5 of the master's timeout; a copy that comes at once is no echo; and the copy of a write comes in time
by the station's last 16 writes. As soon as the run itself has shown enough, that is known here. `passed` says what the
tracker would remember of exchanges that went by without it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Final

import numpy as np

from dissectors.columns import (
    NONE,
    ROLES,
    VERDICTS,
    FrameColumns,
    Masks,
    Octets,
    PlacementColumns,
    Times,
    TransactionColumns,
)
from dissectors.frame import Role
from dissectors.line import NS_PER_S, Timing
from dissectors.modbus.functions import EXCEPTION_BIT
from dissectors.modbus.learnt import READ, UNLEARNT_LIMIT, WRITE, Learnt
from dissectors.modbus.length_columns import PADDING, answer_lengths, of_codes
from dissectors.tracker import Verdict

SAMPLES: Final = 16
"""Response times that the tracker keeps of each station and pace."""

ANSWERED: Final = 4
"""Exchanges that it keeps of those that were answered."""

PAUSES: Final = 32
"""Pauses that it keeps of the master."""

VOTES: Final = 5
"""So many sure answers without an echo before them, and the bus has none, whatever was thought before."""

HORIZON: Final = 1 << 14
"""Exchanges looked at in one go: a run that goes on is taken up again."""

_GIVE_UP: Final = 5 * NS_PER_S
_REQUEST, _RESPONSE, _EITHER, _TO_ALL = (
    ROLES.index(role) for role in (Role.REQUEST, Role.RESPONSE, Role.EITHER, Role.BROADCAST)
)
_ANSWERED, _EXCEPTION, _BROADCAST = (
    VERDICTS.index(verdict) for verdict in (Verdict.ANSWERED, Verdict.EXCEPTION, Verdict.BROADCAST)
)
_PAIRED: Final = frozenset((0x01, 0x02, 0x03, 0x04, 0x0F, 0x10, 0x17))
_COPIED: Final = frozenset((0x05, 0x06))
_RANGES: Final = frozenset((0x0F, 0x10))


@dataclass(frozen=True, slots=True)
class Known:
    """What the tracker has learnt where a run begins.

    `timeout`: the master's, ns, or None. `echoing`: whether the bus repeats requests at once; None while unlearnt.
    `writes`: the newest response times of writes, ns, by station; that of a copy which closed last among them.
    """

    timeout: int | None
    echoing: bool | None
    writes: Mapping[int, Sequence[int]]


@dataclass(frozen=True, slots=True)
class Passed:
    """What the tracker would remember of exchanges that went by without it, beside the first request's pause.

    `times`: the newest response times of each station and pace, ns, in order. `pauses`: the master's newest, ns, each
    with the time since the request before. `sure`: answers that had no echo before them. `answered`: places of the
    newest exchanges that were answered, in order. `units`: stations that answered.
    """

    times: Mapping[tuple[int, int], Sequence[int]]
    pauses: Sequence[tuple[int, int]]
    sure: int
    answered: Sequence[int]
    units: frozenset[int]


@dataclass(frozen=True, slots=True)
class Exchanges:
    """Regular exchanges in order, one entry an exchange.

    `request`: its first row. `answered`: False of a write to all stations, which has but one row. `run`: number of its
    run. `unit`: station asked. `gap`: ns from request to answer, 0 where none is. `sure`: its frames can be nothing
    else. `copy`: answered by the copy of its request. `writes`: whether it stores something. `at_once`: its copy comes
    so soon that it could be an echo. `samples`: of a copy, response times of writes of its station in this run before.
    """

    request: Times
    answered: Masks
    run: Times
    unit: Times
    gap: Times
    sure: Masks
    copy: Masks
    writes: Masks
    at_once: Masks
    samples: Times

    def __len__(self) -> int:
        return len(self.request)

    @property
    def last(self) -> Times:
        """Last row of each."""
        return self.request + self.answered

    def take(self, which: Masks) -> Exchanges:
        """Some of them."""
        return Exchanges(*(getattr(self, one.name)[which] for one in fields(self)))


def exchanges(frames: FrameColumns, octets: Octets, timing: Timing, slack: Times | None = None) -> Exchanges:
    """The regular exchanges among frames. `octets`: of all reads. `slack`: of each frame, ns; the latency if None."""
    octets = np.concatenate((octets, np.zeros(PADDING, np.uint8)))
    request, answered = _candidates(frames, octets)
    run = _runs(frames, octets, request, answered)
    request, answered, run = request[run >= 0], answered[run >= 0], run[run >= 0]
    last = request + answered
    unit = octets[frames.offset[request]].astype(np.int64)
    gap = np.where(answered, np.maximum(frames.start[last] - frames.end[request], 0), 0)
    sure = frames.role[request] == _REQUEST
    copy = answered & ~sure & (frames.role[last] == _EITHER)
    writes = of_codes(_COPIED | _RANGES, False)[frames.function[request]]
    limit = max(7 * timing.char // 2, timing.char + timing.latency)
    at_once = copy & (np.maximum(gap - _slack(frames, timing, slack)[last], 0) <= limit)
    found = Exchanges(request, answered, run, unit, gap, sure, copy, writes, at_once, np.zeros(len(run), np.int64))
    return _in_time(found, Learnt(timing).tolerance)


def _slack(frames: FrameColumns, timing: Timing, slack: Times | None) -> Times:
    return np.full(len(frames), timing.latency) if slack is None else slack


def _candidates(frames: FrameColumns, octets: Octets) -> tuple[Times, Masks]:
    """First rows of what is an exchange if nothing is open before it, and whether it has an answer."""
    count = len(frames)
    chained = frames.chained
    fine = (frames.damage == 0) & frames.ok
    place, code = frames.offset, frames.function
    paired = of_codes(_PAIRED, False)[code] & fine
    copied = of_codes(_COPIED, False)[code] & fine
    asks = paired & (frames.role == _REQUEST) & (frames.destination > 0) & (frames.error == 0)
    either = copied & (frames.role == _EITHER) & (frames.error == 0)
    to_all = (paired | copied) & (frames.role == _TO_ALL) & (frames.error == 0)
    answers = np.zeros(count, bool)
    copies = np.zeros(count, bool)
    at = np.flatnonzero((asks | either)[:-1] & chained[1:] & fine[1:])
    behind = at + 1
    same = (octets[place[at]] == octets[place[behind]]) & (code[at] == code[behind])
    refused = octets[place[behind] + 1] & EXCEPTION_BIT != 0
    length = answer_lengths(octets, place[at], octets[place[at] + 1])
    right = (frames.length[behind] == length) & (frames.error[behind] == 0)
    ranged = of_codes(_RANGES, False)[code[at]]
    right &= ~ranged | ((frames.address[at] == frames.address[behind]) & (frames.count[at] == frames.count[behind]))
    soon = frames.start[behind] - frames.end[at] < _GIVE_UP
    answers[at] = same & soon & (frames.role[behind] == _RESPONSE) & (refused | (asks[at] & right))
    eights = np.zeros(len(at), bool)
    both = np.flatnonzero(either[at] & either[behind] & same & soon)
    eights[both] = _word(octets, place[at[both]]) == _word(octets, place[behind[both]])
    copies[at] = eights
    number = np.arange(count)
    begins = either & ~np.append(False, either[:-1] & chained[1:])
    turn = number - np.maximum.accumulate(np.where(begins, number, 0))
    whole = (asks & answers) | (either & (answers | copies) & (turn & 1 == 0))
    first = np.flatnonzero(whole | to_all)
    return first, whole[first]


def _word(octets: Octets, place: Times) -> Times:
    """Eight octets as a number, to be compared."""
    word: Times = octets[place[:, None] + np.arange(8)].view(np.int64).ravel()
    return word


def _runs(frames: FrameColumns, octets: Octets, request: Times, answered: Masks) -> Times:
    """The run that each candidate belongs to; NONE where it is not regular. A run begins with what is sure."""
    sure = frames.role[request] == _REQUEST
    follows = np.zeros(len(request), bool)
    follows[1:] = (request[1:] == (request + answered)[:-1] + 1) & frames.chained[request[1:]]
    said = _word(octets, frames.offset[request])
    follows[1:] &= sure[1:] | (said[1:] != said[:-1])
    return _numbered(sure, follows)


def _numbered(sure: Masks, follows: Masks) -> Times:
    """Numbers of runs, which begin with what is sure and go on with what follows; NONE of what is in none."""
    number = np.arange(len(sure))
    newest_sure = np.maximum.accumulate(np.where(sure, number, -1))
    newest_break = np.maximum.accumulate(np.where(sure | follows, -1, number))
    regular = newest_sure > newest_break
    begins = sure & ~(follows & np.append(False, regular[:-1])[: len(sure)])
    return np.where(regular, np.cumsum(begins) - 1, NONE)


# --- copies of writes ------------------------------------------------------------------------------------------------


def _in_time(found: Exchanges, tolerance: int) -> Exchanges:
    """Without the copies that come later than the last 16 writes of their station allow; samples counted."""
    told = found.answered & found.writes & (found.sure | found.copy)  # these teach how long a write takes
    late = np.zeros(len(found), bool)
    order, rank = _by_station(found, told)
    gaps = found.gap[order]
    full = np.flatnonzero((rank >= SAMPLES) & found.copy[order])
    for begin in range(0, len(full), HORIZON):
        at = full[begin : begin + HORIZON]
        window = gaps[at[:, None] - np.arange(1, SAMPLES + 1)]
        slowest = np.partition(window, SAMPLES - 2, axis=1)[:, SAMPLES - 2]
        late[order[at]] = gaps[at] > slowest + slowest // 2 + tolerance
    if late.any():
        found = _cut(found, late)
        told = found.answered & found.writes & (found.sure | found.copy)
        order, rank = _by_station(found, told)
    found.samples[order] = rank
    return found


def _by_station(found: Exchanges, told: Masks) -> tuple[Times, Times]:
    """Places of exchanges by run and station, in order, and how many of the same stand before each."""
    at = np.flatnonzero(told)
    key = found.run[at] << 8 | found.unit[at]
    order = np.argsort(key, kind="stable")
    key = key[order]
    number = np.arange(len(at))
    first = np.append(True, key[1:] != key[:-1])[: len(at)]
    return at[order], number - np.maximum.accumulate(np.where(first, number, 0))


def _cut(found: Exchanges, late: Masks) -> Exchanges:
    """Without some of them: a run ends there, and the next begins with what is sure."""
    follows = np.append(False, found.run[1:] == found.run[:-1])[: len(found)]
    run = _numbered(found.sure & ~late, follows & ~late)
    left = run >= 0
    return replace(found.take(left), run=run[left])


# --- from a state that is known --------------------------------------------------------------------------------------


def holding(found: Exchanges, place: int, known: Known, tolerance: int, since: int | None = None) -> int:
    """Place behind the last exchange that stands, where the tracker is at rest before the one at `place`.

    `known`: what it has learnt. `tolerance`: `Learnt.tolerance`. `since`: from which exchange of the run on it has
    gone by or tracked all; `place` if not given. At most HORIZON exchanges are looked at.
    """
    end = min(int(np.searchsorted(found.run, found.run[place], side="right")), place + HORIZON)
    if known.timeout is not None:
        end = _first(5 * found.gap[place:end] > 4 * known.timeout, place, end)
    if known.echoing is not False:
        sure = np.cumsum(found.sure[place:end] & found.answered[place:end])
        end = _first(found.at_once[place:end] & (sure < (VOTES if known.echoing else 1)), place, end)
    begin = int(np.searchsorted(found.run, found.run[place]))
    warm = SAMPLES + (place if since is None else since) - begin
    return _first_late(found, place, end, warm, known, tolerance)


def _first(which: Masks, place: int, end: int) -> int:
    """Place of the first of them, counted from `place`; `end` if there is none."""
    at = int(np.argmax(which)) if len(which) else 0
    return place + at if len(which) and which[at] else end


def _first_late(found: Exchanges, place: int, end: int, warm: int, known: Known, tolerance: int) -> int:
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
    """As `Learnt.response_limit`, less what the master's timeout does to it."""
    if len(times) < 2:
        return None
    ordered = sorted(times)
    slowest = ordered[-2] if len(ordered) > 3 else ordered[-1]
    return slowest + slowest // 2 + tolerance


def passed(found: Exchanges, frames: FrameColumns, place: int, end: int) -> Passed:
    """What the tracker would remember of exchanges [place, end)."""
    part = slice(place, end)
    answered, unit = found.answered[part], found.unit[part]
    told = answered & (found.sure[part] | found.copy[part])
    if end > place and found.copy[end - 1]:
        told[-1] = False  # a copy teaches when the next request has come
    at = np.flatnonzero(told)
    key = unit[at] << 1 | found.writes[part][at]
    order = np.argsort(key, kind="stable")
    gaps, key = found.gap[part][at[order]].tolist(), key[order]
    ends = np.append(np.flatnonzero(key[1:] != key[:-1]) + 1, len(key)).tolist()
    times, begin = {}, 0
    for behind in ends if gaps else ():
        one = int(key[begin])
        times[one >> 1, WRITE if one & 1 else READ] = gaps[max(begin, behind - SAMPLES) : behind]
        begin = behind
    asks = answered[:-1] & (found.sure[part][1:] | (frames.role[found.request[part][1:]] == _TO_ALL))
    asks |= answered[:-1] & (unit[1:] != unit[:-1])
    at = place + 1 + np.flatnonzero(asks)[-PAUSES:]
    start = frames.start[found.request[at]]
    pause = np.maximum(start - frames.end[found.request[at - 1] + found.answered[at - 1]], 0)
    cycle = start - frames.start[found.request[at - 1]]
    return Passed(
        times,
        list(zip(pause.tolist(), cycle.tolist(), strict=True)),
        int((found.sure[part] & answered).sum()),
        (place + np.flatnonzero(answered)[-ANSWERED:]).tolist(),
        frozenset(np.flatnonzero(np.bincount(unit[answered])).tolist()),
    )


def placed(
    found: Exchanges,
    frames: FrameColumns,
    which: slice,
    numbers: Times,
    tx: int,
    timing: Timing,
    slack: Times | None = None,
) -> tuple[PlacementColumns, TransactionColumns]:
    """Placements of the rows of some exchanges, in order, and their transactions.

    `numbers`: of all frames, as the tracker would be told. `tx`: number of the first of the transactions.
    """
    request, answered, unit = found.request[which], found.answered[which], found.unit[which]
    last, count = request + answered, len(request)
    held_back = _slack(frames, timing, slack)
    gap = found.gap[which]
    refused = answered & (frames.error[last] != 0)
    number = np.arange(tx, tx + count)
    transactions = TransactionColumns(
        number,
        unit.astype(np.int16),
        frames.kind[request],
        numbers[request],
        np.where(answered, numbers[last], NONE),
        np.where(answered, np.where(refused, _EXCEPTION, _ANSWERED), _BROADCAST).astype(np.uint8),
        frames.start[request],
        np.maximum(frames.end[request], frames.end[last]),
        np.where(answered, gap, NONE),
        np.where(answered, np.maximum(gap - held_back[last], 0), NONE),
        np.where(answered, gap + held_back[request], NONE),
        np.ones(count, np.int32),
        np.full(count, NONE, np.int64),
        np.where(answered, frames.error[last], 0).astype(np.uint16),
        frames.names,
    )
    rows = 1 + answered.astype(np.int64)
    exchange = np.repeat(np.arange(count), rows)
    is_answer = np.arange(len(exchange)) != (np.cumsum(rows) - rows)[exchange]
    station = unit[exchange].astype(np.int16)
    asked = np.where(answered, _REQUEST, _TO_ALL)[exchange]
    placements = PlacementColumns(
        number[exchange],
        np.where(is_answer, _RESPONSE, asked).astype(np.uint8),
        np.where(is_answer, station, NONE).astype(np.int16),
        np.where(is_answer, NONE, station).astype(np.int16),
    )
    return placements, transactions
