"""Framer and peek for many MS/TP frames at once; `dissectors/columns.py` has the contract.

Every place where a frame could begin is looked at by itself, as `framing.py` would if it were at rest there. Frames are

    good          header and data CRC good, plain data of a legal length or encoded data, no tail octet
    bad data      right length, data CRC wrong, and no good header inside
    bad header    eight octets where the next frame begins directly behind them, else the length that it claims, where
                  no other preamble stands in it

What is left out, and so doubtful: all else that is damaged, what could be repaired, lengths over the limits, frames
with a trailing pad, frames with proved silence of 100 ms inside (or of Tframe_abort and a good header), marked reads,
and the last frame, which more octets may change.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dissectors.bacnet import check_columns as checks
from dissectors.bacnet.frame_types import HEADER, is_encoded
from dissectors.bacnet.header_columns import headers
from dissectors.bacnet.limits import FRAME_ABORT_BITS, MAX_DATA, MAX_ENCODED, MIN_ENCODED, T_FRAME_ABORT_MAX
from dissectors.columns import CHECKS, DAMAGES, FOUNDS, NONE, FrameColumns, OctetTimes, disjoint
from dissectors.frame import Check, Damage, FoundBy

if TYPE_CHECKING:
    import numpy.typing as npt

    from dissectors.columns import Masks, Octets, Reads, Times
    from dissectors.line import Timing

    Words = npt.NDArray[np.uint64]

_PREAMBLE = np.uint64(0xFF55)
_ENCODED = np.array([is_encoded(kind) for kind in range(256)])
_GOOD, _BAD = CHECKS.index(Check.GOOD), CHECKS.index(Check.BAD)
_LENGTH = FOUNDS.index(FoundBy.LENGTH)
_BAD_DATA, _BAD_HEADER = DAMAGES.index(Damage.CHECK), DAMAGES.index(Damage.HEADER)
_DAMAGES = {_BAD_DATA: Damage.CHECK, _BAD_HEADER: Damage.HEADER}
_CRC = 2


def kernel(reads: Reads, timing: Timing) -> FrameColumns:
    """The frames of all clean stretches."""
    octets: Octets = np.ascontiguousarray(reads.octets)
    begins = reads.begins
    times = OctetTimes.of(reads, timing.char)
    silences = times.gaps() - timing.latency
    pauses = begins[:-1][silences >= timing.line.bits(FRAME_ABORT_BITS)]
    offset, length, damage = _frames(octets, pauses)
    late = begins[:-1][silences >= T_FRAME_ABORT_MAX]
    kept = ~_touched(offset + 1, length - 1, late, late + 1)
    if reads.marked.any():
        kept &= ~_touched(offset, length, begins[:-1][reads.marked], begins[1:][reads.marked])
    if not kept.all():
        offset, length, damage = offset[kept], length[kept], damage[kept]
    return _columns(octets, times, offset, length, damage)


def _columns(
    octets: Octets, times: OctetTimes, offset: Times, length: Times, damage: npt.NDArray[np.uint8]
) -> FrameColumns:
    said = headers(octets, offset, length, damage, _DAMAGES)
    good = damage == 0
    size = length.astype(np.int32)
    nothing = np.full(len(offset), NONE, np.int32)
    return FrameColumns(
        offset=offset,
        length=size,
        start=times.start(offset),
        end=times.end(offset + (length - 1)),
        check=np.where(good, np.uint8(_GOOD), np.uint8(_BAD)),
        found=np.full(len(offset), _LENGTH, np.uint8),
        damage=damage,
        expected=np.where(damage == _BAD_HEADER, np.int32(NONE), size),
        source=octets.take(offset + 4).astype(np.int16),
        destination=octets.take(offset + 3).astype(np.int16),
        role=said.role,
        kind=said.kind,
        function=octets.take(offset + 2).astype(np.int16),
        address=said.address,
        count=nothing,
        ok=good,
        error=said.error,
        names=said.names,
    )


def _frames(octets: Octets, pauses: Times) -> tuple[Times, Times, npt.NDArray[np.uint8]]:
    """Offset, length and damage of the frames, ascending, none overlapping another.

    `pauses`: octets with proved silence of Tframe_abort before them.
    """
    preambles, words = _preambles(octets)
    good_header = checks.headers_are_good(words)
    if good_header.all():
        offset, length, damage = _with_good_headers(octets, preambles, words, pauses)
    else:
        offset, length, damage = _with_good_headers(octets, preambles[good_header], words[good_header], pauses)
        spoilt, spoilt_length = _with_bad_headers(octets, preambles, words, good_header)
        offset = np.concatenate((offset, spoilt))
        order = np.argsort(offset, kind="stable")
        offset, length = offset[order], np.concatenate((length, spoilt_length))[order]
        damage = np.concatenate((damage, np.full(len(spoilt), _BAD_HEADER, np.uint8)))[order]
    kept = disjoint(offset, offset + length)
    return (offset, length, damage) if kept.all() else (offset[kept], length[kept], damage[kept])


def _preambles(octets: Octets) -> tuple[Times, Words]:
    """Where 55 FF stands with at least six octets behind, and the eight octets there."""
    begins = np.flatnonzero(octets[: max(0, len(octets) - HEADER + 1)] == 0x55)
    if not len(begins):
        return begins, np.empty(0, np.uint64)
    everywhere = np.ndarray((len(octets) - HEADER + 1,), "<u8", octets.data, strides=(1,))
    words = everywhere[begins]
    whole = words & np.uint64(0xFFFF) == _PREAMBLE
    return (begins, words) if whole.all() else (begins[whole], words[whole])


def _lengths(words: Words) -> Times:
    """The length that each header claims."""
    high = (words >> np.uint64(40)).astype(np.int64) & 0xFF
    return high << 8 | ((words >> np.uint64(48)).astype(np.int64) & 0xFF)


def _kinds(words: Words) -> npt.NDArray[np.int64]:
    return (words >> np.uint64(16)).astype(np.int64) & 0xFF


def _totals(claimed: Times) -> Times:
    """Octets of whole frames with those length fields."""
    return claimed + (HEADER + _CRC * (claimed > 0))


def _with_good_headers(
    octets: Octets, begins: Times, words: Words, pauses: Times
) -> tuple[Times, Times, npt.NDArray[np.uint8]]:
    """Good frames, and those of which only the data CRC is bad."""
    claimed, encoded = _lengths(words), _ENCODED.take(_kinds(words))
    length = _totals(claimed)
    after = begins + length
    take = after < len(octets)
    take &= np.where(encoded, (claimed >= MIN_ENCODED) & (claimed <= MAX_ENCODED), claimed <= MAX_DATA)
    damage = np.zeros(len(begins), np.uint8)
    rows = np.flatnonzero(take & (claimed > 0))
    if len(rows):
        bad, surely = _bad_data(octets, begins[rows], claimed[rows], encoded[rows])
        inside = np.append(begins[1:], len(octets))[rows] < after[rows]
        damage[rows[bad]] = _BAD_DATA
        take[rows] &= ~bad | (surely & ~inside & (after[rows] + HEADER <= len(octets)))
        nested = rows[inside]  # a good header after a pause ends the frame around it
        take[nested] &= ~_any_inside(begins[nested], after[nested], pauses)
    take &= (octets.take(after, mode="clip") != 0xFF) | (damage != 0)
    if take.all():
        return begins, length, damage
    return begins[take], length[take], damage[take]


def _bad_data(octets: Octets, begins: Times, claimed: Times, encoded: Masks) -> tuple[Masks, Masks]:
    """Whose data CRC is bad, and which of those surely cannot be repaired."""
    plain = np.flatnonzero(~encoded)
    bad = np.empty(len(begins), bool)
    surely = ~encoded
    bad[plain] = ~checks.data_are_good(checks.data_left(octets, begins[plain] + HEADER, claimed[plain] + _CRC))
    coded = np.flatnonzero(encoded)
    bad[coded] = ~checks.encoded_are_good(octets, begins[coded] + HEADER, claimed[coded] + _CRC)
    wrong = plain[bad[plain]]
    if len(wrong):  # CRC octets in the wrong order are repaired
        at = begins[wrong] + HEADER + claimed[wrong]
        right = checks.data_left(octets, begins[wrong] + HEADER, claimed[wrong]) ^ np.uint16(0xFFFF)
        surely[wrong] = right != octets[at].astype(np.int64) << 8 | octets[at + 1]
    return bad, surely


def _with_bad_headers(octets: Octets, preambles: Times, words: Words, good_header: Masks) -> tuple[Times, Times]:
    """Offset and length of frames with a bad header that surely end where the rules say."""
    rows = np.flatnonzero(~good_header)
    begins, claimed, kinds = preambles[rows], _lengths(words[rows]), _kinds(words[rows])
    following = np.append(preambles[1:], len(octets))[rows]
    room = following - begins  # to the next preamble
    directly = (room == HEADER) & np.append(good_header[1:], False)[rows]
    plausible = claimed <= np.where(_ENCODED.take(kinds), MAX_ENCODED, MAX_DATA)
    length = np.where(directly | ~plausible, HEADER, _totals(claimed))
    # of the last octets it is not known yet whether they begin a header
    sure = directly | (room >= length) & (begins + length + 2 * HEADER <= len(octets))
    return begins[sure], length[sure]


def _any_inside(begins: Times, ends: Times, places: Times) -> Masks:
    """Whether one of the ascending `places` lies inside a stretch, not at its begin."""
    inside: Masks = np.searchsorted(places, ends, "left") > np.searchsorted(places, begins, "right")
    return inside


def _touched(begins: Times, lengths: Times, first: Times, beyond: Times) -> Masks:
    """Which of disjoint frames share an octet with one of the stretches [first, beyond)."""
    steps = np.bincount(np.searchsorted(begins + lengths, first, "right"), minlength=len(begins) + 1)
    steps -= np.bincount(np.searchsorted(begins, beyond, "left"), minlength=len(begins) + 1)
    touched: Masks = np.cumsum(steps[:-1]) > 0
    return touched
