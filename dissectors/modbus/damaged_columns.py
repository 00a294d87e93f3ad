"""Whole stretches of a predicted length with a wrong CRC that the reference gives as just that: Damage.CHECK.

Left out is what it may put right (repair.py), hold for octets to come (an answer shorter than was asked), or take for
the begin of an echo. What it remembers may speak for a repair in the rarest of cases, so each that merely may be one is
left out. Also left out are stations that the standard does not know: they must have been heard before.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from dissectors.modbus.functions import BROADCAST, EXCEPTION_BIT, MAX_UNIT
from dissectors.modbus.length_columns import COMMON, answer_lengths, common, of_codes
from dissectors.modbus.stretch_crc import INITIAL, after_zeros, of_octet

if TYPE_CHECKING:
    from dissectors.columns import Masks, Octets, Times
    from dissectors.modbus.length_columns import Lengths
    from dissectors.modbus.stretch_crc import StretchCrc
    from dissectors.modbus.stretch_rows import Rows


def plain(octets: Octets, crc: StretchCrc, place: Times, length: Times, request: Lengths) -> Masks:
    """Which stretches with a wrong CRC are nothing that could be put right. `request`: their predicted lengths."""
    unit, code = octets[place], octets[place + 1]
    fair = common()[code] & (unit > BROADCAST) & (unit <= MAX_UNIT)
    fair &= (request != length + 1) & (request != length + 2)  # a request that was made before, without its end
    first, second = octets[place + length - 2], octets[place + length - 1]
    right = crc.registers(place, length - 2)
    low, high = right & 0xFF, right >> 8
    fair &= (first != low) & ~((first == high) & (second == low))  # the last octet spoilt; swapped
    fair &= (crc.registers(place, length - 1) & 0xFF) != second  # the last octet missing
    left = crc.registers(place, length)
    for count in np.flatnonzero(np.bincount(length)):
        at = np.flatnonzero(length == count)
        fair[at] &= ~_by_first_octet(int(count))[left[at]]
    return fair


@lru_cache(maxsize=256)
def _by_first_octet(length: int) -> Masks:
    """bool[65536]: registers over frames of that length that another first octet, or one more before it, would set
    right."""
    table = np.zeros(1 << 16, bool)
    zeros = np.full(256, length, np.int64)
    table[after_zeros(of_octet(), zeros - 1)] = True
    with_one_more = of_octet()[np.arange(256) ^ 0xFF] ^ INITIAL >> 8
    table[after_zeros(with_one_more, zeros) ^ after_zeros(np.full(256, INITIAL), zeros)] = True
    return table


def certain(octets: Octets, rows: Rows) -> Masks:
    """Which rows are good, or damaged behind a good one that leaves no doubt what the bus waits for.

    True does not say that the row before is certain itself.
    """
    fine = ~rows.damaged
    at = np.flatnonzero(rows.damaged)
    at = at[at > 0]
    before = at - 1
    at = at[~rows.damaged[before] & (rows.end[before] == rows.start[at])]
    before = at - 1
    place, asked = rows.start[at], rows.start[before]
    code, asked_code = octets[place + 1], octets[asked + 1]
    waits = rows.request[before] & (octets[asked] == octets[place])
    answer = answer_lengths(octets, asked, asked_code)
    length = rows.length[at]
    goes_on = (asked_code == code) & (length < answer)
    echo = (length < rows.length[before]) & (asked_code == code) & (octets[asked + 2] == octets[place + 2])
    unknown = ~of_codes(COMMON, False)[asked_code] & (asked_code & EXCEPTION_BIT == 0)
    fine[at] = ~(waits & (goes_on | echo | unknown))
    return fine
