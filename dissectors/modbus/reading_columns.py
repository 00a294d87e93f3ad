"""Readings of Modbus RTU exchanges, many at once: `readings.py` for functions 3, 4, 6 and 16."""

from __future__ import annotations

import numpy as np

from dissectors.columns import FrameColumns, Masks, Octets, Times
from dissectors.reading_columns import HOWS, ReadingColumns
from dissectors.readings import Origin

_SPACES = ("holding", "input")
_CHECK, _HEAD = 2, 6  # octets of the CRC; of unit, function, two words
_READ, _WRITE = HOWS.index(Origin.READ), HOWS.index(Origin.WRITE)


def reading_columns(asked: FrameColumns, answered: FrameColumns, has_answer: Masks, octets: Octets) -> ReadingColumns:
    """See `dissectors.reading_columns.BulkReadings`."""
    begin, size = asked.offset, asked.length - _CHECK
    usable = size >= _HEAD
    back, answer_size = answered.offset, answered.length - _CHECK
    last = len(octets) - 1

    def at(place: Times) -> Times:
        return octets[np.clip(place, 0, last)].astype(np.int64)

    def word(place: Times) -> Times:
        return at(place) << 8 | at(place + 1)

    if last < 0:
        return ReadingColumns.nothing(np.zeros(len(asked), bool))
    function, first, second = at(begin + 1), word(begin + 2), word(begin + 4)
    same = (answer_size >= 2) & (at(back) == at(begin)) & (at(back + 1) == function)
    read = has_answer & same & np.isin(function, (3, 4)) & (answer_size >= 3)
    read &= (at(back + 2) == 2 * second) & (answer_size - 3 == 2 * second)
    confirmed = ~has_answer | same
    single = confirmed & (function == 6)
    many = confirmed & (function == 16) & (size > _HEAD) & (at(begin + 6) == 2 * second) & (size - 7 == 2 * second)
    read, single, many = read & usable, single & usable, many & usable
    count = np.where(read | many, second, single.astype(np.int64))
    data = np.where(read, back + 3, begin + np.where(single, 4, 7))
    exchange = np.repeat(np.arange(len(asked)), count)
    step = np.arange(len(exchange)) - np.repeat(np.cumsum(count) - count, count)
    return ReadingColumns(
        read | single | many,
        exchange,
        (read & (function == 4))[exchange].astype(np.uint8),
        (first[exchange] + step & 0xFFFF).astype(np.int32),
        word(data[exchange] + 2 * step).astype(np.int32),
        np.where(read, _READ, _WRITE)[exchange].astype(np.uint8),
        _SPACES,
    )
