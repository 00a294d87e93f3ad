"""The kernel of Modbus RTU: clean stretches of a capture as columns of frames; contract in `dissectors/columns.py`.

A *stretch* is what stands between two proved silences. It is told at once where it is

    one frame       its length is one that its function code predicts, and its CRC is good (whole_columns.py), or is
                    wrong where nothing but a frame with a wrong CRC can be meant (damaged_columns.py)
    several frames  without silence between, as behind an adapter that holds octets back: each begins where the one
                    before it ends, at a predicted length with a good CRC, and no other reading of the octets stands
                    or might yet come (run_columns.py)

All else is doubtful: functions that predict no length, silences inside a frame, noise, frames with line errors, frames
with a second one inside. The reference (framing.py) weighs such octets by what it remembers of the bus; what is given
here it would give whatever it remembers.
"""

from __future__ import annotations

from dataclasses import fields, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from dissectors.columns import CHECKS, DAMAGES, FOUNDS, FrameColumns, OctetTimes
from dissectors.frame import Check, Damage, FoundBy
from dissectors.modbus import damaged_columns, run_columns
from dissectors.modbus.header_columns import Words, headers
from dissectors.modbus.length_columns import PADDING
from dissectors.modbus.lengths import MAX_FRAME
from dissectors.modbus.stretch_crc import StretchCrc
from dissectors.modbus.stretch_rows import Rows, StretchRows
from dissectors.modbus.whole_columns import Told, whole_frames

if TYPE_CHECKING:
    from dissectors.columns import Codes, Octets, Reads, Times
    from dissectors.line import Timing

BLOCK: Final = 1 << 20
"""Octets looked at in one go, so that what is computed of each octet stays small."""

_AT_ONCE: Final = 1 << 16  # rows of which the columns are made together
_GOOD, _BAD = (np.uint8(CHECKS.index(check)) for check in (Check.GOOD, Check.BAD))
_CHECK = np.uint8(DAMAGES.index(Damage.CHECK))
_GAP, _LENGTH, _SPLIT = (np.uint8(FOUNDS.index(found)) for found in (FoundBy.GAP, FoundBy.LENGTH, FoundBy.SPLIT))


def kernel(reads: Reads, timing: Timing) -> FrameColumns:
    """The frames of all clean chains; see `dissectors.columns.Kernel`."""
    times = OctetTimes.of(reads, timing.char)
    stretches = StretchRows.of(reads, times, timing)
    octets = np.zeros(len(reads.octets) + MAX_FRAME + PADDING, np.uint8)
    octets[: len(reads.octets)] = reads.octets
    rows = _rows(octets, len(reads.octets), stretches)
    rows = rows.take(run_columns.certain(octets, rows, stretches, damaged_columns.certain(octets, rows)))
    return _columns(octets, rows, stretches, times, timing)


def _rows(octets: Octets, count: int, stretches: StretchRows) -> Rows:
    """Frames that are whole stretches, and candidates of runs of frames, in order and apart."""
    told = np.full(len(stretches), Told.RUN, np.uint8)
    whole, runs = [], []
    for begin in range(0, max(count, 1), BLOCK):
        end = min(begin + BLOCK, count)
        part = octets[begin : end + MAX_FRAME + PADDING]
        crc = StretchCrc(part)
        which = np.arange(*np.searchsorted(stretches.begin, (begin, end)))
        whole.append(whole_frames(part, begin, crc, which, stretches, told))
        runs.append(run_columns.candidates(part, begin, end, crc, stretches, told))
    frames, candidates = Rows.joined(whole), Rows.joined(runs)
    frames, candidates = _without_others_inside(frames, candidates, stretches, told)
    return Rows.joined([frames, run_columns.apart(candidates)]).ordered()


def _without_others_inside(frames: Rows, candidates: Rows, stretches: StretchRows, told: Codes) -> tuple[Rows, Rows]:
    """Less the whole frames that are none if something else in them is good, where that is so."""
    unless = told[candidates.stretch] == Told.UNLESS_INSIDE
    if not unless.any():
        return frames, candidates
    itself = (candidates.start == stretches.begin[candidates.stretch]) & (
        candidates.end == stretches.end[candidates.stretch]
    )
    told[candidates.stretch[unless & ~itself]] = Told.DOUBTFUL
    return frames.take(told[frames.stretch] != Told.DOUBTFUL), candidates.take(~unless)


def _columns(octets: Octets, rows: Rows, stretches: StretchRows, times: OctetTimes, timing: Timing) -> FrameColumns:
    """The columns, made some rows at a time."""
    names, gaps = Words(), times.gaps()
    parts = [
        _some_columns(octets, rows.take(slice(begin, begin + _AT_ONCE)), stretches, times, gaps, timing, names)
        for begin in range(0, max(len(rows), 1), _AT_ONCE)
    ]
    joined = {
        one.name: np.concatenate([getattr(part, one.name) for part in parts]) for one in fields(FrameColumns)[:-1]
    }
    return replace(parts[0], **joined, names=names.words)


def _some_columns(
    octets: Octets,
    rows: Rows,
    stretches: StretchRows,
    times: OctetTimes,
    gaps: Times,
    timing: Timing,
    names: Words,
) -> FrameColumns:
    damage = rows.damaged * _CHECK
    length = rows.length.astype(np.int64)
    header = headers(octets, rows.start, length, rows.request, rows.response, damage, names)
    first, last = _reads_of(rows, stretches, times)
    columns = FrameColumns(
        rows.start,
        rows.length.astype(np.int32),
        _starts(rows.start, first, times),
        _ends(rows.end - 1, last, times),
        np.where(rows.damaged, _BAD, _GOOD),
        _found(rows, first, last, stretches, times, gaps, timing),
        damage,
        header.expected,
        header.source,
        header.destination,
        header.role,
        header.kind,
        header.function,
        header.address,
        header.count,
        header.ok,
        header.error,
    )
    return columns if header.known.all() else columns.take(header.known)


def _reads_of(rows: Rows, stretches: StretchRows, times: OctetTimes) -> tuple[Times, Times]:
    """The reads that hold the first and the last octet of each."""
    first, last = stretches.first[rows.stretch], stretches.last[rows.stretch]
    runs = np.flatnonzero(~rows.whole)
    if len(runs):
        first[runs] = times.read_of(rows.start[runs])
        last[runs] = times.read_of(rows.end[runs] - 1)
    return first, last


def _ends(octets: Times, reads: Times, times: OctetTimes) -> Times:
    """As `OctetTimes.end`, of octets whose reads are known."""
    behind = times.begins[reads + 1] - 1 - octets
    return np.maximum(times.floors[reads], times.times[reads] - behind * times.char)


def _starts(octets: Times, reads: Times, times: OctetTimes) -> Times:
    """As `OctetTimes.start`, of octets whose reads are known."""
    behind = times.begins[reads + 1] - octets
    return np.maximum(times.floors[reads], times.times[reads] - behind * times.char)


def _found(
    rows: Rows, first: Times, last: Times, stretches: StretchRows, times: OctetTimes, gaps: Times, timing: Timing
) -> Codes:
    """How the limits were found: between silences, next to others, or by their length alone."""
    found = np.full(len(rows), _GAP, np.uint8)
    runs = np.flatnonzero(~rows.whole)
    if not len(runs):
        return found
    stretch, start, end = rows.stretch[runs], rows.start[runs], rows.end[runs]
    before = np.where(times.begins[first[runs]] == start, gaps[first[runs]], 0)
    following = last[runs] + 1
    behind = np.where(
        times.begins[following] == end,
        np.where(following < len(gaps), gaps[np.minimum(following, len(gaps) - 1)], 0),
        0,
    )
    closed = (stretches.end[stretch] == end) & stretches.closed[stretch]
    proved = closed & (stretches.begin[stretch] == start) & stretches.proved[stretch]
    touched = (before < timing.t15) | (~closed & (behind < timing.t15))
    found[runs] = np.where(proved, _GAP, np.where(touched, _SPLIT, _LENGTH))
    return found
