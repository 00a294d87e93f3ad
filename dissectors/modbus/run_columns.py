"""Several frames without silence between them: each where the one before it ends.

All stretches of a predicted length with a good CRC are candidates. Those that overlap are doubtful, all of them. The
reference takes the frame that its window begins with (`RtuFramer._take_head`) when its worth is not negative and the
other direction's reading of the same octets is wrong, or hopes for less. Its rules are followed here with what is known
for sure of its memory: which request is open, and that a station was heard, as far as the frame before tells; where
nothing tells, the least that could speak for the frame and the most that could speak for the other reading.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dissectors.modbus.best_split import HEARD, PROVED, SCALE
from dissectors.modbus.candidates import CRC_BITS, WHOLE_STRETCH
from dissectors.modbus.functions import EXCEPTION_BIT
from dissectors.modbus.length_columns import (
    NOT_WEIGHED,
    answer_lengths,
    frame_bits,
    lengths,
    predicting,
    shapes,
    unit_bits,
)
from dissectors.modbus.lengths import MIN_FRAME, MORE, NEVER
from dissectors.modbus.open_request import EXACT, ODD
from dissectors.modbus.past import KNOWN_LENGTH
from dissectors.modbus.stretch_rows import Rows, StretchRows
from dissectors.modbus.whole_columns import FIRST_LOOK, Told

if TYPE_CHECKING:
    from dissectors.columns import Codes, Masks, Octets, Times
    from dissectors.modbus.stretch_crc import StretchCrc

_HOPED_SHAPE = 4  # of a short reading that is not complete

_AT_ONCE = 1 << 16  # rows looked at together
_PLAIN = WHOLE_STRETCH - CRC_BITS
"""Bits of a whole stretch from which on it is its function's frame even if octets are held before it; others are so
where it is sure that none are."""


def candidates(octets: Octets, begin: int, end: int, crc: StretchCrc, stretches: StretchRows, told: Codes) -> Rows:
    """Stretches with a good CRC that begin in [begin, end) where a look at the whole stretch did not settle it.

    `octets`, `crc`: of the part from place `begin` on, with some more at the end.
    """
    place, stretch = _places(begin, end, stretches, told, octets)
    code = octets[place + 1]
    room = stretches.end[stretch] - begin - place
    request, response = lengths(octets, place, code, room)
    found = []
    for length, other, is_request in ((request, response, True), (response, request, False)):
        at = np.flatnonzero((length >= MIN_FRAME) & (length <= room) & (is_request | (length != other)))
        at = at[crc.good(place[at], length[at].astype(np.int64))]
        both = length[at] == other[at]
        yes = np.ones(len(at), bool)
        found.append(
            Rows(
                place[at] + begin,
                length[at],
                yes if is_request else ~yes,
                both if is_request else yes,
                np.where(both, NEVER, other[at]).astype(np.int16),
                stretch[at],
                ~yes,
                ~yes,
            )
        )
    return Rows.joined(found).ordered()


def _places(begin: int, end: int, stretches: StretchRows, told: Codes, octets: Octets) -> tuple[Times, Times]:
    """Where a frame could begin, by its function octet, from `begin` on; and in which stretch."""
    first = max(int(np.searchsorted(stretches.begin, begin, side="right")) - 1, 0)
    beyond = int(np.searchsorted(stretches.begin, end))
    which = np.arange(first, beyond)
    which = which[(told[which] == Told.RUN) | (told[which] == Told.UNLESS_INSIDE)]
    low = np.maximum(stretches.begin[which] - begin, 0)
    high = np.minimum(stretches.end[which] - begin - (MIN_FRAME - 1), end - begin)
    size = np.maximum(high - low, 0)
    if len(which) == 1:
        place = np.flatnonzero(predicting()[octets[low[0] + 1 : low[0] + 1 + size[0]]]) + low[0]
        return place, np.full(len(place), which[0])
    before = np.cumsum(size) - size
    place = np.arange(int(size.sum())) + np.repeat(low - before, size)
    keep = np.flatnonzero(predicting()[octets[place + 1]])
    return place[keep], np.repeat(which, size)[keep]


def apart(rows: Rows) -> Rows:
    """Those that overlap no other."""
    if len(rows) < 2:
        return rows
    end = rows.end
    overlaps = np.zeros(len(rows), bool)
    overlaps[1:] = rows.start[1:] < np.maximum.accumulate(end)[:-1]
    overlaps[:-1] |= rows.start[1:] < end[:-1]
    return rows.take(~overlaps)


def certain(octets: Octets, rows: Rows, stretches: StretchRows, sound: Masks) -> Masks:
    """Which rows the reference gives, whatever it remembers, if it is at rest where their chain begins.

    `rows`: none overlapping another. `sound`: those of them that are so by themselves or, if damaged, behind a sound
    one.
    """
    by_the_one_before = rows.whole & sound
    free = by_the_one_before & ~rows.damaged
    for begin in range(0, len(rows), _AT_ONCE):
        at = begin + np.flatnonzero(free[begin : begin + _AT_ONCE])
        free[at] = frame_bits(octets, rows.start[at], rows.request[at], rows.response[at]) >= _PLAIN
    runs = np.flatnonzero(~rows.whole)
    if len(runs):
        free[runs], by_the_one_before[runs] = _weighed(octets, rows, runs, stretches)
    number = np.arange(len(rows))
    chained = np.zeros(len(rows), bool)
    chained[1:] = rows.start[1:] == rows.end[:-1]
    follows = by_the_one_before & chained
    newest_free = np.maximum.accumulate(np.where(free, number, -1))
    newest_break = np.maximum.accumulate(np.where(free | follows, -1, number))
    return (free | follows) & (newest_free > newest_break)


def _weighed(octets: Octets, rows: Rows, at: Times, stretches: StretchRows) -> tuple[Masks, Masks]:
    """Of candidates in runs: which the reference takes whatever came before; which if the row before is certain."""
    place, length, other = rows.start[at], rows.length[at].astype(np.int64), rows.other[at].astype(np.int64)
    request, response = rows.request[at], rows.response[at]
    code, unit, stretch = octets[place + 1], octets[place], rows.stretch[at]
    closed = stretches.closed[stretch]
    room = stretches.end[stretch] - place
    last = closed & (length == room)
    fair = (closed | (room >= np.maximum(FIRST_LOOK, length + 1))) & ~stretches.marked[stretch]
    as_request, as_response = shapes(octets, place, code)
    own = frame_bits(octets, place, request, response)
    fair &= own > NOT_WEIGHED
    bits = own + PROVED * last
    complete = (length < FIRST_LOOK) & (other <= np.minimum(FIRST_LOOK - 1, room))
    hopes = ((other > length) & ~complete) | (other == MORE)
    hopes &= ~last
    fair &= ~(hopes & (other == MORE))
    hoped = np.where(other > 8, np.where(request, as_response, as_request), _HOPED_SHAPE) + unit_bits(unit)
    known = np.where(request, KNOWN_LENGTH, 0)  # the other one is an answer, perhaps as long as one before

    in_vain = np.zeros(len(at), bool)

    def taken(fit: Times | int, heard: Times | int, most: Times | int) -> Masks:
        """With such bits from the open request and for a known station; `most`: what the other reading may have."""
        hope = hoped + np.maximum(known, most)
        outdone = (hope + HEARD >= 0) & (SCALE * (bits + fit - hope) + length - other < 0)
        result: Masks = fair & (bits + fit + heard >= 0) & (~(hopes & outdone) | in_vain)
        return result

    before = np.maximum(at - 1, 0)
    asked = rows.start[before]
    asked_code = octets[asked + 1]
    same_unit = octets[asked] == unit
    awaited = rows.request[before] & same_unit & (asked_code == code & ~np.uint8(EXCEPTION_BIT))
    surely = awaited & ~rows.response[before]
    answer = answer_lengths(octets, asked, asked_code)
    exact = (other == answer) | (other == rows.length[before])
    most = np.where(awaited, np.where(exact | ~surely, EXACT, ODD), 0)
    fits = surely & response & ((length == answer) | (code & EXCEPTION_BIT != 0))
    sound = ~rows.damaged[before]
    firm = _firm(octets, rows)[at]
    solid = fair & firm & (bits + EXACT * fits >= 0)
    reach = _ends_of_runs(rows, at, solid)
    at_once = taken(0, 0, EXACT), taken(EXACT * fits, HEARD * same_unit, most) & sound
    in_vain = solid & ((reach - place > other) | (closed & (reach == stretches.end[stretch])))
    fair &= firm | _from_the_begin(rows, at, at_once[0] | at_once[1], stretches)
    return taken(0, 0, EXACT), taken(EXACT * fits, HEARD * same_unit, most) & sound


def _firm(octets: Octets, rows: Rows) -> Masks:
    """Which frames the best segmentation never leaves out so that a later one answers an earlier request.

    A request directly before its answer; the answer; and what follows an answer that can be nothing else.
    """
    firm = np.zeros(len(rows), bool)
    place, length = rows.start, rows.length
    code = octets[place + 1]
    asks = rows.request[:-1] & (place[1:] == rows.end[:-1]) & (octets[place[1:]] == octets[place[:-1]])
    same = (code[1:] == code[:-1]) & rows.response[1:]
    same &= length[1:] == answer_lengths(octets, place[:-1], code[:-1])
    asks &= same | (code[1:] == code[:-1] | np.uint8(EXCEPTION_BIT))
    firm[:-1] = asks
    firm[1:] |= asks
    firm[2:] |= asks[:-1] & ~rows.request[1:-1] & (place[2:] == rows.end[1:-1])
    return firm & ~rows.damaged


def _from_the_begin(rows: Rows, at: Times, sure: Masks, stretches: StretchRows) -> Masks:
    """Which of rows `at` stand behind nothing but sure ones since silence was proved.

    There the reference goes from frame to frame, and nothing is left to the best segmentation.
    """
    start, stretch = rows.start[at], rows.stretch[at]
    first = (start == stretches.begin[stretch]) & stretches.proved[stretch]
    follows = np.zeros(len(at), bool)
    follows[1:] = (start[1:] == rows.end[at[:-1]]) & sure[:-1] & (stretch[1:] == stretch[:-1])
    number = np.arange(len(at))
    newest_first = np.maximum.accumulate(np.where(first, number, -1))
    newest_break = np.maximum.accumulate(np.where(first | follows, -1, number))
    return newest_first > newest_break


def _ends_of_runs(rows: Rows, at: Times, solid: Masks) -> Times:
    """Where the frames end that follow each of rows `at` without a doubtful one between, in the same stretch.

    What a reading that is not complete hopes for only delays the decision: when the octets are there and its check is
    wrong, or the stretch is at its end, frames that stand side by side and for themselves are the best segmentation.
    """
    end = rows.end[at]
    goes_on = np.zeros(len(at), bool)
    goes_on[:-1] = solid[1:] & solid[:-1] & (rows.start[at[1:]] == end[:-1])
    goes_on[:-1] &= rows.stretch[at[1:]] == rows.stretch[at[:-1]]
    last = np.where(goes_on, len(at), np.arange(len(at)))
    ends: Times = end[np.minimum.accumulate(last[::-1])[::-1]]
    return ends
