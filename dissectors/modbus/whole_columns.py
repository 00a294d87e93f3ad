"""Frames that fill the room between two proved silences: what a healthy bus gives behind a good adapter.

Silence on both sides, a predicted length and a good CRC settle it for the reference too (`RtuFramer._take_whole`).
Two reservations: a frame that ends with a zero is weighed, since it may be a shorter one and zeros, so nothing shorter
may be good here; and a frame of FIRST_LOOK octets and more is looked at before it is complete, so nothing good may
stand at its begin or, where it is longer than SECOND_LOOK, anywhere inside.
"""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING, Final

import numpy as np

from dissectors.modbus import damaged_columns
from dissectors.modbus.best_split import PROVED
from dissectors.modbus.length_columns import common, frame_bits, lengths, predicting
from dissectors.modbus.lengths import MAX_FRAME, MIN_FRAME, NEVER
from dissectors.modbus.stretch_rows import Rows, StretchRows

if TYPE_CHECKING:
    from dissectors.columns import Codes, Masks, Octets, Times
    from dissectors.modbus.length_columns import Lengths
    from dissectors.modbus.stretch_crc import StretchCrc

FIRST_LOOK: Final = 24
"""The reference looks at a window of so many octets for the first time, and leaves it alone until then."""

SECOND_LOOK: Final = 88
"""Where that did not settle it and the frame goes on, it looks here again, then for frames inside, too."""


class Told(IntEnum):
    """What a look at a whole stretch tells of it."""

    RUN = 0  # no frame by itself: perhaps several
    FRAME = 1
    UNLESS_INSIDE = 2  # a frame, unless something else in it has a good CRC
    DOUBTFUL = 3


def whole_frames(octets: Octets, base: int, crc: StretchCrc, which: Times, stretches: StretchRows, told: Codes) -> Rows:
    """The stretches `which` that are one frame; writes into `told` (a `Told` for each of `stretches`).

    `octets`, `crc`: those of a part that begins at place `base` and holds these stretches, as far as they count.
    """
    length = stretches.end[which] - stretches.begin[which]
    fair = stretches.proved[which] & stretches.closed[which] & ~stretches.marked[which]
    keep = np.flatnonzero(fair & (length >= MIN_FRAME) & (length <= MAX_FRAME))
    which, length = which[keep], length[keep]
    place = stretches.begin[which] - base
    keep = np.flatnonzero(predicting()[octets[place + 1]])
    which, length, place = which[keep], length[keep], place[keep]
    code = octets[place + 1]
    request, response = lengths(octets, place, code, length)
    as_request, as_response = request == length, response == length
    other = np.where(as_request, np.where(as_response, NEVER, response), request).astype(np.int16)
    good = crc.good(place, length)
    fits = as_request | as_response
    verdict = np.where(fits & good, np.uint8(Told.FRAME), np.uint8(Told.RUN))
    simple = (length < FIRST_LOOK) & (octets[place + length - 1] != 0)
    look = np.flatnonzero(fits & good & ~simple)
    verdict[look] = _looked_at(octets, crc, place[look], length[look], as_request[look], as_response[look], other[look])
    damaged = fits & ~good
    hurt = np.flatnonzero(damaged)
    plain = damaged_columns.plain(octets, crc, place[hurt], length[hurt], request[hurt])
    verdict[hurt[plain]] = Told.UNLESS_INSIDE
    told[which] = verdict
    keep = np.flatnonzero((verdict == Told.FRAME) | (verdict == Told.UNLESS_INSIDE))
    return Rows(
        stretches.begin[which[keep]],
        length[keep].astype(np.int16),
        as_request[keep],
        as_response[keep],
        other[keep],
        which[keep],
        np.ones(len(keep), bool),
        damaged[keep],
    )


def _looked_at(
    octets: Octets,
    crc: StretchCrc,
    place: Times,
    length: Times,
    request: Masks,
    response: Masks,
    other: Lengths,
) -> Codes:
    """What is told of frames that are long, or end with a zero."""
    code = octets[place + 1]
    shorter = (other >= MIN_FRAME) & (other < length)
    second = np.zeros(len(place), bool)
    at = np.flatnonzero(shorter)
    second[at] = crc.good(place[at], other[at].astype(np.int64))
    bits = frame_bits(octets, place, request, response)
    zero = octets[place + length - 1] == 0
    long = length >= FIRST_LOOK
    weak = (zero & (bits + PROVED < 0)) | (long & ~common()[code])
    looked_into = (length >= SECOND_LOOK) | (long & shorter & (other >= FIRST_LOOK))
    verdict = np.where(looked_into, np.uint8(Told.UNLESS_INSIDE), np.uint8(Told.FRAME))
    verdict[second | weak] = Told.RUN
    return verdict
