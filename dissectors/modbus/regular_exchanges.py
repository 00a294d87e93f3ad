"""Regular exchanges on a Modbus line, for the rules: good frames, each with its transaction beside it.

    a request, and its answer or an exception in the next row, which closes it
    a request, and a regular one in the next row, which closes it without an answer
    a write to all stations, closed at once

Of them the rules learn nothing but what they ask, how long the answer took and what it was. A *stretch* is regular
exchanges directly behind one another, of which the last one is answered. All else the rules look at row by row.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from dissectors.columns import NONE, ROLES, VERDICTS
from dissectors.frame import Role
from dissectors.modbus.envelope import RTU_NAME
from dissectors.modbus.exchange import is_begin_of
from dissectors.modbus.functions import EXCEPTION_BIT
from dissectors.modbus.hex_columns import DIGITS, NO_DIGIT, octets_of_pairs
from dissectors.stretches import Stretches
from dissectors.tracker import Verdict

if TYPE_CHECKING:
    from dissectors.columns import Masks, Numbers, Octets, Times
    from dissectors.row_columns import RowColumns

_REQUEST, _RESPONSE, _BROADCAST = (ROLES.index(role) for role in (Role.REQUEST, Role.RESPONSE, Role.BROADCAST))
_ANSWERED, _RETRY, _EXCEPTION, _NO_RESPONSE, _TO_ALL = (
    VERDICTS.index(verdict)
    for verdict in (Verdict.ANSWERED, Verdict.RETRY, Verdict.EXCEPTION, Verdict.NO_RESPONSE, Verdict.BROADCAST)
)
_PADDING: Final = 8
_LEAST: Final = 4  # octets of the shortest good frame
_CUT_LEAST: Final = 3  # octets of the shortest echo that was cut, see `is_begin_of`
_CR: Final = 0x0D

PLAIN, REFUSED, REPEATED, UNANSWERED, TO_ALL = range(5)
"""What became of an exchange: answered at the first try; refused likewise; answered or refused after repeats; not
answered; asked of all."""


@dataclass(frozen=True, slots=True)
class Adus:
    """Unit and PDU of every frame: `octets` from `offset` on, so many as `length`. `sound`: whether they are there."""

    octets: Octets
    offset: Times
    length: Times
    sound: Masks


@dataclass(frozen=True, slots=True)
class Regular:
    """Regular exchanges among rows, in their order, and the stretches they make.

    `transaction`: place among those that closed. `request`: row. `answered`: whether the next row is its answer;
    `refused`: whether that is an exception. `became`: PLAIN … TO_ALL.
    """

    transaction: Times
    request: Times
    answered: Masks
    refused: Masks
    became: Times
    stretches: Stretches

    def __len__(self) -> int:
        return len(self.request)


def regular(rows: RowColumns, adus: Adus) -> Regular:
    """Those among some rows."""
    frames, placed, closed, first = rows.frames, rows.placed, rows.transactions, rows.first
    count = len(rows)
    fine = _fine(rows, adus)
    request, response = closed.request - first, closed.response - first
    inside = (closed.request != NONE) & (request >= 0) & (request < count) & (closed.station != NONE)
    request = np.where(inside, request, 0)
    behind = np.minimum(request + 1, count - 1)
    unit = adus.octets[np.where(adus.sound, adus.offset, 0)].astype(np.int64)
    role = placed.role
    asks = inside & fine[request] & (frames.error[request] == 0) & (placed.tx[request] == closed.id)
    to_one = asks & (unit[request] == closed.station) & (unit[request] > 0) & (role[request] == _REQUEST)

    verdict = closed.verdict
    answered = to_one & (response == request + 1) & (response < count) & (rows.closed_by == response)
    answered &= (closed.response != NONE) & (closed.latency != NONE)
    answered &= fine[behind] & (placed.tx[behind] == closed.id) & (role[behind] == _RESPONSE)
    answered &= (unit[behind] == closed.station) & (placed.source[behind] == closed.station)
    answered &= ~_is_cut(frames.length, frames.offset, rows.octets, request, behind)
    code = adus.octets[np.where(adus.sound, adus.offset, 0) + 1]
    refusal = code[behind] & EXCEPTION_BIT != 0
    refused = (verdict == _EXCEPTION) & refusal & (frames.error[behind] != 0) & (adus.length[behind] > 2)
    right = (((verdict == _ANSWERED) & (closed.attempt == 1)) | (verdict == _RETRY)) & ~refusal & (closed.error == 0)
    answered &= (refused | right) & (code[request] & EXCEPTION_BIT == 0)

    unanswered = to_one & (verdict == _NO_RESPONSE) & (closed.response == NONE) & (rows.closed_by == request + 1)
    unanswered &= (frames.role[request] == _REQUEST) & (request + 1 < count)
    unanswered &= ~_is_cut(frames.length, frames.offset, rows.octets, request, behind)
    to_all = asks & (verdict == _TO_ALL) & (role[request] == _BROADCAST) & (unit[request] == 0)
    to_all &= (rows.closed_by == request) & ~_may_repeat(frames.length, code, request, behind)

    which = np.flatnonzero(answered | unanswered | to_all)
    became = np.full(len(closed), PLAIN)
    became[refused] = REFUSED
    became[closed.attempt > 1] = REPEATED
    became[unanswered], became[to_all] = UNANSWERED, TO_ALL
    made = Stretches.of(which, request[which], answered[which], to_all[which], rows)
    return Regular(which, request[which], answered[which], (answered & refused)[which], became[which], made)


def _fine(rows: RowColumns, adus: Adus) -> Masks:
    """Frames that are good and nothing but their columns."""
    fine = rows.good & rows.is_frame & rows.frames.ok & adus.sound
    if rows.odd:
        fine[list(rows.odd)] = False
    return fine


def _may_repeat(length: Numbers, code: Octets, request: Times, behind: Times) -> Masks:
    """Whether the frame behind a broadcast may say the same: a station's answer in the shape of a request."""
    same: Masks = (length[request] == length[behind]) & (code[request] == code[behind])
    return same


def _is_cut(length: Numbers, offset: Times, octets: Octets, request: Times, behind: Times) -> Masks:
    """Whether the frame behind a request is its begin: an echo that was cut short."""
    cut = (length[behind] < length[request]) & (length[behind] >= _CUT_LEAST)
    for at in range(_CUT_LEAST):
        which = np.flatnonzero(cut)
        cut[which] = octets[offset[request[which]] + at] == octets[offset[behind[which]] + at]
    for at in np.flatnonzero(cut).tolist():
        asked, came = int(request[at]), int(behind[at])
        whole = octets[offset[asked] : offset[asked] + length[asked]].tobytes()
        cut[at] = is_begin_of(octets[offset[came] : offset[came] + length[came]].tobytes(), whole)
    return cut


# --- unit and PDU ----------------------------------------------------------------------------------------------------


def adus_of(rows: RowColumns) -> Adus:
    """Unit and PDU of all frames, of ASCII ones as octets; sound where the frame is in the usual form."""
    frames = rows.frames
    octets = np.concatenate((rows.octets, np.zeros(_PADDING, np.uint8)))
    length = frames.length.astype(np.int64)
    if rows.protocol == RTU_NAME:
        return Adus(octets, frames.offset, length - 2, rows.is_frame & (length >= _LEAST))
    return _unpacked(octets, frames.offset, length, rows.is_frame)


def _unpacked(octets: Octets, offset: Times, length: Times, is_frame: Masks) -> Adus:
    """The octets of ASCII frames: `:`, pairs of hex digits, CR and one more."""
    pairs = (length - 3) >> 1
    sound = is_frame & (length >= 9) & (length & 1 == 1)
    at = np.where(sound, offset, 0)
    end = at + np.where(sound, length, 2)
    sound &= (octets[at] == ord(":")) & (octets[end - 2] == _CR) & (octets[end - 1] & 0x7F != _CR)
    bad = np.append(0, np.cumsum(DIGITS.take(octets) == NO_DIGIT))
    sound &= bad[np.where(sound, end - 2, 0)] == bad[np.where(sound, at + 1, 0)]
    size = np.where(sound, pairs - 1, 0)
    begin = np.cumsum(size) - size
    whole = octets_of_pairs(octets, at + 1, size)
    return Adus(np.concatenate((whole, np.zeros(_PADDING, np.uint8))), begin, size, sound)
