"""Pairing by columns: regular exchanges of a Modbus line, for all frames of a capture at once.

Regular is what `ModbusTracker` decides by the octets of neighbouring frames, as long as it waits for nothing:

    a request, and its answer or an exception directly behind it     reads, writes of several: shape tells which is what
    a request, and another one directly behind it                    of the same: no answer, perhaps repeated
    a write of one register or coil, and its copy or an exception    by turns, behind a regular exchange
    a write to all stations                                          behind a regular exchange
    a request, its damaged answer, and another request directly behind   where the damage left unit and function
    a damaged request and its answer directly behind it                  the same, and behind an answer

Regular exchanges directly behind one another are a *run*. The contract, held by a property test: if the tracker is at
rest where an exchange of a run begins (nothing is open, waits or is doubted, and what closed last was answered), it
gives that exchange and those behind it, as far as `exchange_memory.holding` says, exactly as `placed` has them. All
else goes through the tracker: what is damaged in another way, late, said twice the same, and functions that few use.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Final, NamedTuple

import numpy as np

from dissectors.columns import (
    CHECKS,
    DAMAGES,
    NONE,
    ROLES,
    VERDICTS,
    FrameColumns,
    Masks,
    Names,
    Octets,
    PlacementColumns,
    Times,
    TransactionColumns,
)
from dissectors.frame import Check, Damage, Role
from dissectors.line import NS_PER_S, Timing
from dissectors.modbus.exchange import damaged_request
from dissectors.modbus.functions import EXCEPTION_BIT, ITEMS_ASKED
from dissectors.modbus.layout import MAX_READ_REGISTERS
from dissectors.modbus.learned_timing import LearnedTiming
from dissectors.modbus.length_columns import PADDING, answer_lengths, of_codes
from dissectors.modbus.notation import CHECK, HEAD
from dissectors.modbus.ranges import RANGES_REPEATED, SINGLE_WRITES
from dissectors.tracker import Verdict

SAMPLES: Final = 16
"""Response times that the tracker keeps of each station and pace."""

GIVE_UP: Final = 5 * NS_PER_S
_AT_ONCE: Final = 1 << 14  # copies looked at together
_REQUEST, _RESPONSE, _EITHER, TO_ALL = (
    ROLES.index(role) for role in (Role.REQUEST, Role.RESPONSE, Role.EITHER, Role.BROADCAST)
)
_ANSWERED, _RETRY, _EXCEPTION, _BROADCAST, _NO_RESPONSE, _DAMAGED_ANSWER = (
    VERDICTS.index(verdict)
    for verdict in (
        Verdict.ANSWERED,
        Verdict.RETRY,
        Verdict.EXCEPTION,
        Verdict.BROADCAST,
        Verdict.NO_RESPONSE,
        Verdict.DAMAGED_ANSWER,
    )
)
_WRONG_CHECK: Final = DAMAGES.index(Damage.CHECK), CHECKS.index(Check.BAD)
_SHORT: Final = 8
_PAIRED: Final = frozenset((*ITEMS_ASKED, *RANGES_REPEATED))


@dataclass(frozen=True, slots=True)
class ExchangeColumns:
    """Regular exchanges in order, one entry an exchange.

    `request`: its first row. `answered`: whether the next row is its answer. `garbled`: the next row is its damaged
    answer, and the one behind that another request. `unanswered`: the next row is another request. What is none of
    these is a write to all stations; this and what is unanswered has one row. `faulty`: the request is damaged, and
    answered. `repeat`: it says what the one directly before it said, to which no good answer came. `run`: number of its
    run. `unit`: station asked. `gap`: ns from request to answer, or to the next request of one unanswered or garbled.
    `sure`: its frames can be nothing else. `copy`: answered by the
    copy of its request. `writes`: whether it stores something. `at_once`: its copy comes so soon that it could be an
    echo. `samples`: of a copy, response times of writes of its station in this run before.
    """

    request: Times
    answered: Masks
    garbled: Masks
    unanswered: Masks
    faulty: Masks
    repeat: Masks
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
        return self.request + (self.answered | self.garbled)

    @property
    def goes_on(self) -> Masks:
        """Which close with the request behind them."""
        return self.unanswered | self.garbled

    def take(self, which: Masks) -> ExchangeColumns:
        """Some of them."""
        return ExchangeColumns(*(getattr(self, one.name)[which] for one in fields(self)))


def exchanges(
    frames: FrameColumns, octets: Octets, timing: Timing, slack: Times | None = None, damaged: bool = True
) -> ExchangeColumns:
    """The regular exchanges among frames. `octets`: of all reads. `slack`: of each frame, ns; the latency if None.
    `damaged`: whether those of which a frame is damaged may be among them."""
    octets = np.concatenate((octets, np.zeros(PADDING, np.uint8)))
    found = _candidates(frames, octets, damaged)
    run = _runs(frames, octets, found)
    left = run >= 0
    request, run = found.request[left], run[left]
    answered, unanswered, garbled, faulty = (
        column[left] for column in (found.answered, found.unanswered, found.garbled, found.faulty)
    )
    last = request + (answered | garbled)
    unit = octets[frames.offset[request]].astype(np.int64)
    ends_at = last + (unanswered | garbled)  # the row at which the wait is over
    gap = np.where(ends_at > request, np.maximum(frames.start[ends_at] - frames.end[request], 0), 0)
    repeat = np.zeros(len(run), bool)
    said = _word(octets, frames.offset[request])
    repeat[1:] = (unanswered | garbled)[:-1] & (run[1:] == run[:-1]) & (said[1:] == said[:-1])
    sure = (frames.role[request] == _REQUEST) & ~faulty
    copy = answered & ~sure & (frames.role[last] == _EITHER)
    writes = of_codes(SINGLE_WRITES | RANGES_REPEATED, False)[frames.function[request]]
    limit = max(7 * timing.char // 2, timing.char + timing.latency)
    at_once = copy & (np.maximum(gap - _slack(frames, timing, slack)[last], 0) <= limit)
    none = np.zeros(len(run), np.int64)
    made = ExchangeColumns(
        request, answered, garbled, unanswered, faulty, repeat, run, unit, gap, sure, copy, writes, at_once, none
    )
    too_soon = repeat & answered & (gap < 7 * timing.char // 2)  # the answer of an attempt before
    return _in_time(_cut(made, too_soon), LearnedTiming(timing).tolerance)


def _slack(frames: FrameColumns, timing: Timing, slack: Times | None) -> Times:
    return np.full(len(frames), timing.latency) if slack is None else slack


class _Candidates(NamedTuple):
    """First rows of what is an exchange if nothing is open before it, and what becomes of it."""

    request: Times
    answered: Masks
    unanswered: Masks
    garbled: Masks
    faulty: Masks


def _candidates(frames: FrameColumns, octets: Octets, damaged: bool) -> _Candidates:
    count = len(frames)
    chained = frames.chained
    fine = (frames.damage == 0) & frames.ok
    place, code = frames.offset, frames.function
    paired = of_codes(_PAIRED, False)[code] & fine
    copied = of_codes(SINGLE_WRITES, False)[code] & fine
    asks = paired & (frames.role == _REQUEST) & (frames.destination > 0) & (frames.error == 0)
    asks &= ~_may_be_odd_answer(frames, octets)
    either = copied & (frames.role == _EITHER) & (frames.error == 0)
    to_all = (paired | copied) & (frames.role == TO_ALL) & (frames.error == 0)
    answers = np.zeros(count, bool)
    copies = np.zeros(count, bool)
    at = np.flatnonzero((asks | either)[:-1] & chained[1:] & fine[1:])
    behind = at + 1
    same = (octets[place[at]] == octets[place[behind]]) & (code[at] == code[behind])
    refused = octets[place[behind] + 1] & EXCEPTION_BIT != 0
    length = answer_lengths(octets, place[at], octets[place[at] + 1])
    right = (frames.length[behind] == length) & (frames.error[behind] == 0)
    ranged = of_codes(RANGES_REPEATED, False)[code[at]]
    right &= ~ranged | ((frames.address[at] == frames.address[behind]) & (frames.count[at] == frames.count[behind]))
    soon = frames.start[behind] - frames.end[at] < GIVE_UP
    answers[at] = same & soon & (frames.role[behind] == _RESPONSE) & (refused | (asks[at] & right))
    eights = np.zeros(len(at), bool)
    both = np.flatnonzero(either[at] & either[behind] & same & soon)
    eights[both] = _word(octets, place[at[both]]) == _word(octets, place[behind[both]])
    copies[at] = eights
    number = np.arange(count)
    begins = either & ~np.append(False, either[:-1] & chained[1:])
    turn = number - np.maximum.accumulate(np.where(begins, number, 0))
    whole = (asks & answers) | (either & (answers | copies) & (turn & 1 == 0))
    unanswered = np.zeros(count, bool)
    at = np.flatnonzero(asks[:-1] & asks[1:] & chained[1:])
    unanswered[at] = _is_told_apart(frames, octets, at, at + 1)
    garbled, faulty = np.zeros(count, bool), np.zeros(count, bool)
    if damaged:
        garbled, faulty = _damaged(frames, octets, asks)
    first = np.flatnonzero(whole | to_all | unanswered | garbled | faulty)
    answered = whole | faulty
    return _Candidates(first, answered[first], unanswered[first], garbled[first], faulty[first])


def _may_be_odd_answer(frames: FrameColumns, octets: Octets) -> Masks:
    """Reads of registers that ask for more than there is and whose octets would count themselves as an answer."""
    words = of_codes(frozenset((0x03, 0x04)), False)[frames.function] & (frames.length == _SHORT)
    counted = octets[frames.offset + HEAD] == _SHORT - HEAD - 1 - CHECK
    odd: Masks = words & counted & ((frames.count < 1) | (frames.count > MAX_READ_REGISTERS))
    return odd


def _is_told_apart(frames: FrameColumns, octets: Octets, at: Times, following: Times) -> Masks:
    """Whether eight octets tell if two requests say the same."""
    long = (frames.length[at] > _SHORT) | (frames.length[following] > _SHORT)
    apart: Masks = ~long | (_word(octets, frames.offset[at]) != _word(octets, frames.offset[following]))
    return apart


def _damaged(frames: FrameColumns, octets: Octets, asks: Masks) -> tuple[Masks, Masks]:
    """First rows of requests to which a damaged answer came, and another request follows; of damaged ones with their
    answer. Unit and function are what they were in both frames, so that it does not matter when they came."""
    garbled, faulty = np.zeros(len(frames), bool), np.zeros(len(frames), bool)
    damage, check = _WRONG_CHECK
    wrong = np.flatnonzero((frames.damage == damage) & (frames.check == check) & ~frames.ok & (frames.error != 0))
    wrong = wrong[(wrong > 0) & (wrong + 1 < len(frames))]
    wrong = wrong[frames.chained[wrong] & frames.chained[wrong + 1]]
    place = frames.offset
    asked, following = wrong - 1, wrong + 1
    right = asks[asked] & asks[following] & (frames.role[wrong] != _REQUEST)
    right &= _same_unit_and_code(octets, place, asked, wrong)
    right &= (frames.length[wrong] >= frames.length[asked]) | (  # else it may be the begin of an echo
        octets[place[wrong] + 2] != octets[place[asked] + 2]
    )
    right &= (frames.start[following] - frames.end[asked] < GIVE_UP) & _is_told_apart(frames, octets, asked, following)
    garbled[asked[right]] = True
    right = of_codes(_PAIRED, False)[frames.function[wrong]] & (frames.role[wrong] == _REQUEST)
    right &= (octets[place[wrong]] > 0) & _same_unit_and_code(octets, place, wrong, following)
    right &= (frames.damage[following] == 0) & frames.ok[following] & (frames.role[following] == _RESPONSE)
    right &= (frames.error[following] == 0) | (octets[place[following] + 1] & EXCEPTION_BIT != 0)
    right &= _word(octets, place[wrong]) != _word(octets, place[following])
    right &= frames.start[following] - frames.end[wrong] < GIVE_UP
    faulty[wrong[right]] = True
    return garbled, faulty


def _same_unit_and_code(octets: Octets, place: Times, asks: Times, answers: Times) -> Masks:
    same = octets[place[asks]] == octets[place[answers]]
    fits: Masks = same & (octets[place[asks] + 1] == octets[place[answers] + 1] & ~np.uint8(EXCEPTION_BIT))
    return fits


def _word(octets: Octets, place: Times) -> Times:
    """Eight octets as a number, to be compared."""
    word: Times = octets[place[:, None] + np.arange(8)].view(np.int64).ravel()
    return word


def _runs(frames: FrameColumns, octets: Octets, found: _Candidates) -> Times:
    """The run that each candidate belongs to; NONE where it is not regular. A run begins with what is sure."""
    request, answered, faulty = found.request, found.answered, found.faulty
    sure = (frames.role[request] == _REQUEST) & ~faulty
    follows = np.zeros(len(request), bool)
    last = request + (answered | found.garbled)
    follows[1:] = (request[1:] == last[:-1] + 1) & frames.chained[request[1:]]
    said = _word(octets, frames.offset[request])
    follows[1:] &= sure[1:] | np.where(faulty[1:], answered[:-1], said[1:] != said[:-1])
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


def _in_time(found: ExchangeColumns, tolerance: int) -> ExchangeColumns:
    """Without the copies that come later than the last 16 writes of their station allow; samples counted."""
    told = found.answered & found.writes & (found.sure | found.copy)  # these teach how long a write takes
    late = np.zeros(len(found), bool)
    order, rank = _by_station(found, told)
    gaps = found.gap[order]
    full = np.flatnonzero((rank >= SAMPLES) & found.copy[order])
    for begin in range(0, len(full), _AT_ONCE):
        at = full[begin : begin + _AT_ONCE]
        window = gaps[at[:, None] - np.arange(1, SAMPLES + 1)]
        slowest = np.partition(window, SAMPLES - 2, axis=1)[:, SAMPLES - 2]
        late[order[at]] = gaps[at] > slowest + slowest // 2 + tolerance
    if late.any():
        found = _cut(found, late)
        told = found.answered & found.writes & (found.sure | found.copy)
        order, rank = _by_station(found, told)
    found.samples[order] = rank
    return found


def _by_station(found: ExchangeColumns, told: Masks) -> tuple[Times, Times]:
    """Places of exchanges by run and station, in order, and how many of the same stand before each."""
    at = np.flatnonzero(told)
    key = found.run[at] << 8 | found.unit[at]
    order = np.argsort(key, kind="stable")
    key = key[order]
    number = np.arange(len(at))
    first = np.append(True, key[1:] != key[:-1])[: len(at)]
    return at[order], number - np.maximum.accumulate(np.where(first, number, 0))


def _cut(found: ExchangeColumns, late: Masks) -> ExchangeColumns:
    """Without some of them: a run ends there, and the next begins with what is sure."""
    if not late.any():
        return found
    follows = np.append(False, found.run[1:] == found.run[:-1])[: len(found)]
    run = _numbered(found.sure & ~late, follows & ~late)
    left = run >= 0
    return replace(found.take(left), run=run[left])


# --- as the tracker gives them ---------------------------------------------------------------------------------------


def placed(
    found: ExchangeColumns,
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
    garbled, faulty = found.garbled[which], found.faulty[which]
    last, count = request + (answered | garbled), len(request)
    held_back = _slack(frames, timing, slack)
    gap = found.gap[which]
    place = np.arange(count)
    first = np.maximum.accumulate(np.where(found.repeat[which] & (place > 0), 0, place))
    attempt = 1 + place - first
    verdict = np.where(found.unanswered[which], _NO_RESPONSE, _BROADCAST)
    verdict[answered] = np.where(attempt > 1, _RETRY, _ANSWERED)[answered]
    verdict[answered & (frames.error[last] != 0)] = _EXCEPTION
    verdict[garbled] = _DAMAGED_ANSWER
    error, names = _errors(frames, np.where(answered | garbled, frames.error[last], 0), faulty, request)
    number = tx + place
    transactions = TransactionColumns(
        number,
        unit.astype(np.int16),
        frames.kind[np.where(faulty, last, request)],
        numbers[request],
        np.where(answered | garbled, numbers[last], NONE),
        verdict.astype(np.uint8),
        frames.start[request],
        np.maximum(frames.end[request], frames.end[last]),
        np.where(answered, gap, NONE),
        np.where(answered, np.maximum(gap - held_back[last], 0), NONE),
        np.where(answered, gap + held_back[request], NONE),
        attempt.astype(np.int32),
        np.where(attempt > 1, tx + first, NONE),
        error.astype(np.uint16),
        names,
    )
    rows = 1 + (answered | garbled).astype(np.int64)
    exchange = np.repeat(place, rows)
    is_answer = np.arange(len(exchange)) != (np.cumsum(rows) - rows)[exchange]
    station = unit[exchange].astype(np.int16)
    asked = np.where(answered | garbled | found.unanswered[which], _REQUEST, TO_ALL)[exchange]
    placements = PlacementColumns(
        number[exchange],
        np.where(is_answer, _RESPONSE, asked).astype(np.uint8),
        np.where(is_answer, station, NONE).astype(np.int16),
        np.where(is_answer, NONE, station).astype(np.int16),
    )
    return placements, transactions


def _errors(frames: FrameColumns, error: Names, faulty: Masks, request: Times) -> tuple[Names, tuple[str, ...]]:
    """What is wrong with each exchange, where that of a damaged request is not what its answer says; the texts."""
    said = np.flatnonzero(faulty & (error == 0))
    if not len(said):
        return error, frames.names
    faults, which = np.unique(frames.error[request[said]], return_inverse=True)
    error[said] = len(frames.names) + which
    return error, (*frames.names, *(damaged_request(frames.names[fault]) for fault in faults.tolist()))
