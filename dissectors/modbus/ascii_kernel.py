"""The kernel of Modbus ASCII: clean frames of a capture as columns; contract in `dissectors/columns.py`.

A frame is what stands between two LF, where it is `:`, pairs of large hex digits with a right LRC, as many as its
function predicts, and CR LF. Left out, and so doubtful: all else, frames with silence of over a second inside, marked
reads, functions that predict no length, and those that change the end character of a station (function 08/0003), which
the framer keeps in mind.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from dissectors.columns import CHECKS, FOUNDS, NONE, FrameColumns, OctetTimes, holds_any
from dissectors.frame import Check, FoundBy
from dissectors.modbus.ascii_framing import LONGEST_SILENCE, MAX_CHARACTERS
from dissectors.modbus.candidates import SHORT_FRAME
from dissectors.modbus.header_columns import Words, headers
from dissectors.modbus.hex_columns import octets_of_pairs
from dissectors.modbus.length_columns import PADDING, lengths, predicting, shapes, unit_bits
from dissectors.modbus.lengths import NEVER

if TYPE_CHECKING:
    from dissectors.columns import Codes, Masks, Octets, Reads, Times
    from dissectors.line import Timing

_START, _CR, _LF = ord(":"), 0x0D, 0x0A
_DIAGNOSTICS: Final = 0x08
_LEAST: Final = 1 + 2 * 3 + 2  # ':' unit function LRC CR LF
_IS_UPPER = np.isin(np.arange(256), np.frombuffer(b"0123456789ABCDEF", np.uint8))
_GOOD = np.uint8(CHECKS.index(Check.GOOD))
_DELIMITER = np.uint8(FOUNDS.index(FoundBy.DELIMITER))


def kernel(reads: Reads, timing: Timing) -> FrameColumns:
    """The frames of all clean chains; see `dissectors.columns.Kernel`."""
    octets: Octets = np.ascontiguousarray(reads.octets)
    times = OctetTimes.of(reads, timing.char)
    begins, ends = _stretches(octets, reads, times, timing)
    binary, places, sizes = _decoded(octets, begins, ends)
    kept = _sums(binary, places, sizes) == 0
    begins, ends, places, sizes = begins[kept], ends[kept], places[kept], sizes[kept]
    request, response, certain = _directions(binary, places, sizes)
    begins, ends, places, sizes = begins[certain], ends[certain], places[certain], sizes[certain]
    return _columns(binary, places, sizes, request[certain], response[certain], begins, ends, times)


def _stretches(octets: Octets, reads: Reads, times: OctetTimes, timing: Timing) -> tuple[Times, Times]:
    """Where what may be clean frames by their characters begins and ends."""
    ends = np.flatnonzero(octets == _LF) + 1
    begins = np.concatenate((np.zeros(min(1, len(ends)), np.int64), ends[:-1]))
    length = ends - begins
    formed = (length >= _LEAST) & (length <= MAX_CHARACTERS) & (length & 1 == 1)
    formed &= (octets.take(begins) == _START) & (octets.take(ends - 2, mode="clip") == _CR)
    strange = np.concatenate(([0], np.cumsum(~_IS_UPPER.take(octets), dtype=np.int64)))
    formed &= strange[ends] - strange[begins] == 3
    reads_begin = reads.begins[:-1]
    formed &= ~holds_any(begins + 1, ends, reads_begin[times.gaps() - timing.latency >= LONGEST_SILENCE])
    if reads.marked.any():
        formed &= ~holds_any(begins, ends, np.flatnonzero(np.repeat(reads.marked, reads.lengths)))
    return begins[formed], ends[formed]


def _decoded(octets: Octets, begins: Times, ends: Times) -> tuple[Octets, Times, Times]:
    """The octets that the digits stand for, a zero behind the LRC of each frame, so that it is as long as its RTU twin;
    where each begins, and its length."""
    pairs = (ends - begins - 3) >> 1
    sizes = pairs + 1
    places = np.cumsum(sizes) - sizes
    binary = np.zeros(int(sizes.sum()) + MAX_CHARACTERS + PADDING, np.uint8)
    binary[: -MAX_CHARACTERS - PADDING] = octets_of_pairs(octets, begins + 1, sizes)
    binary[places + pairs] = 0
    return binary, places, sizes


def rtu_twins(frames: FrameColumns, octets: Octets) -> tuple[FrameColumns, Octets]:
    """Frames of this kernel as the RTU frames that would carry the same, but for their check, and their octets.

    What directly follows another still does, and nothing else.
    """
    binary, places, sizes = _decoded(octets, frames.offset, frames.offset + frames.length)
    apart = np.cumsum(~frames.chained)
    total = int(sizes.sum())
    spread = np.zeros(len(binary) + int(apart[-1] if len(apart) else 0), np.uint8)
    spread[np.arange(total) + np.repeat(apart, sizes)] = binary[:total]
    return replace(frames, offset=places + apart, length=sizes.astype(np.int32)), spread


def _sums(binary: Octets, places: Times, sizes: Times) -> Codes:
    """The sum of the octets of each, its LRC with them: 0 where that is right."""
    if not len(places):
        return np.zeros(0, np.uint8)
    total = int(places[-1] + sizes[-1])
    sums: Codes = np.add.reduceat(binary[:total], places, dtype=np.uint8)
    return sums


def _directions(binary: Octets, places: Times, sizes: Times) -> tuple[Masks, Masks, Masks]:
    """Which are as long as a request, as an answer, and of which it is certain that the reference says so, too."""
    codes = binary[places + 1]
    request, response = lengths(binary, places, codes, sizes)
    as_request, as_response = request == sizes, response == sizes
    unit = unit_bits(binary[places])
    fair_request, fair_response = (bits + unit >= SHORT_FRAME for bits in shapes(binary, places, codes))
    other = np.where(as_request, response, request)
    alone = (other == NEVER) | (other == sizes)
    fair = np.where(as_request, fair_request, False) | np.where(as_response, fair_response, False)
    certain = predicting()[codes] & (as_request | as_response) & (alone | fair)
    diagnostics = np.flatnonzero(codes == _DIAGNOSTICS)
    changes = (binary[places[diagnostics] + 2] == 0) & (binary[places[diagnostics] + 3] == 3)
    certain[diagnostics[changes]] = False
    return as_request, as_response, certain


def _columns(
    binary: Octets,
    places: Times,
    sizes: Times,
    request: Masks,
    response: Masks,
    begins: Times,
    ends: Times,
    times: OctetTimes,
) -> FrameColumns:
    names, count = Words(), len(begins)
    said = headers(binary, places, sizes, request, response, np.zeros(count, np.uint8), names)
    length = (ends - begins).astype(np.int32)
    columns = FrameColumns(
        begins,
        length,
        times.start(begins),
        times.end(ends - 1),
        np.full(count, _GOOD),
        np.full(count, _DELIMITER),
        np.zeros(count, np.uint8),
        np.where(said.expected == NONE, np.int32(NONE), length),
        said.source,
        said.destination,
        said.role,
        said.kind,
        said.function,
        said.address,
        said.count,
        said.ok,
        said.error,
        names.words,
    )
    return columns if said.known.all() else columns.take(said.known)
