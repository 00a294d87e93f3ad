"""Frames of many that may hold an oddity (`content.py`): all that say the same are read once.

What is odd does not depend on who sends to whom, on the invoke id, on which object of a type is read, nor on which real
number it has: these octets are taken for 0 where the layout says for sure that they are that.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dissectors.bacnet import npdu as npdus
from dissectors.bacnet.apdu import SEGMENTED, PduType
from dissectors.bacnet.content import oddities
from dissectors.bacnet.frame_types import CARRIES_NPDU, HEADER, is_encoded
from dissectors.bacnet.limits import BROADCAST
from dissectors.fingerprints import LONGEST, fingerprints, gathered
from dissectors.frame import Check, FoundBy, Frame

if TYPE_CHECKING:
    from dissectors.columns import Masks, Octets, Times
    from dissectors.row_columns import RowColumns

_DESTINATION, _SOURCE, _HEADER_CRC, _CRC = 3, 4, 7, 2
_CONTROL, _APDU = HEADER + 1, HEADER + 2
_READ_PROPERTY, _READ_PROPERTY_MULTIPLE = 12, 14
_OBJECT, _PROPERTY, _OPENING, _REAL, _CLOSING = 0x0C, 0x19, 0x3E, 0x44, 0x3F
"""Tags of an answer to ReadProperty (ASHRAE 135, 15.5): object, property of one octet, value, a real number in it."""


class Read:
    """What was read, and is not odd, by what stands for it; bounded."""

    def __init__(self) -> None:
        self._plain: set[int] = set()

    def suspicious(self, rows: RowColumns) -> Times:
        """Places of rows that must be read by themselves, ascending."""
        frames = rows.frames
        carries: Masks = np.isin(frames.function, sorted(CARRIES_NPDU)) & rows.good & (frames.length > HEADER)
        alone = sorted(place for place in rows.odd if carries[place])
        carries[alone] = False
        alone += np.flatnonzero(carries & (frames.length > LONGEST)).tolist()
        carries &= frames.length <= LONGEST
        places = np.flatnonzero(carries)
        if not len(places):
            return np.array(sorted(alone), np.int64)
        lengths = frames.length[places].astype(np.int64)
        held, edges = gathered(rows.octets, frames.offset[places], lengths)
        _level(held, edges, lengths, frames.function[places], frames.destination[places] == BROADCAST)
        marks, firsts, which = np.unique(fingerprints(held, edges, lengths), return_index=True, return_inverse=True)
        examples = zip(marks.tolist(), places[firsts].tolist(), strict=True)
        odd = np.array([self._is_odd(mark, rows, place) for mark, place in examples], bool)
        return np.array(sorted([*alone, *places[odd[which]].tolist()]), np.int64)

    def _is_odd(self, mark: int, rows: RowColumns, place: int) -> bool:
        if mark in self._plain:
            return False
        frames = rows.frames
        begin = int(frames.offset[place])
        octets = rows.octets[begin : begin + int(frames.length[place])].tobytes()
        if oddities(Frame(rows.protocol, octets, 0, 0, Check.GOOD, FoundBy.LENGTH)):
            return True
        if len(self._plain) >= _KEPT:
            self._plain.clear()
        self._plain.add(mark)
        return False


_KEPT = 1 << 16


def _level(held: Octets, edges: Times, lengths: Times, kinds: np.ndarray, to_all: Masks) -> None:
    """Take for 0 what does not matter."""
    for place in (_SOURCE, _HEADER_CRC):
        held[edges + place] = 0
    held[edges + _DESTINATION] = to_all
    sent_plainly = ~np.isin(kinds, [kind for kind in CARRIES_NPDU if is_encoded(kind)])
    for back in range(1, _CRC + 1):
        held[(edges + lengths - back)[sent_plainly]] = 0
    at, size = edges[sent_plainly], lengths[sent_plainly] - _CRC
    _level_local(held, at[size > _APDU + 4], size[size > _APDU + 4])


def _level_local(held: Octets, at: Times, size: Times) -> None:
    """The same in messages that go through no router. `at`: where frames begin, `size`: without their CRC."""
    routed = npdus.NETWORK_MESSAGE | npdus.HAS_DESTINATION | npdus.HAS_SOURCE
    local = (held[at + HEADER] == npdus.VERSION) & (held[at + _CONTROL] & routed == 0)
    at, size = at[local], size[local]
    first = held[at + _APDU]
    asks = first & (0xF0 | SEGMENTED) == PduType.CONFIRMED_REQUEST << 4
    answers = first & (0xF0 | SEGMENTED) == PduType.COMPLEX_ACK << 4
    held[at[asks] + _APDU + 2] = 0
    held[at[answers] + _APDU + 1] = 0
    reads = asks & np.isin(held[at + _APDU + 3], (_READ_PROPERTY, _READ_PROPERTY_MULTIPLE))
    begins, counts = at[reads] + _APDU + 4, (size - _APDU - 4)[reads]
    inside = np.arange(int(counts.sum())) - np.repeat(np.cumsum(counts) - counts, counts)
    held[inside + np.repeat(begins, counts)] = 0  # what is asked for says neither
    values = answers & (held[at + _APDU + 2] == _READ_PROPERTY) & (size >= _APDU + 11)
    begin, size = at[values] + _APDU + 3, size[values]
    named = (held[begin] == _OBJECT) & (held[begin + 5] == _PROPERTY) & (held[begin + 7] == _OPENING)
    begin, size = begin[named], size[named]
    held[begin + 2] &= 0xC0  # the low 22 bits are the instance
    held[begin + 3] = held[begin + 4] = 0
    real = size == _APDU + 3 + 14
    real[real] = (held[begin[real] + 8] == _REAL) & (held[begin[real] + 13] == _CLOSING)
    for place in range(9, 13):
        held[begin[real] + place] = 0
