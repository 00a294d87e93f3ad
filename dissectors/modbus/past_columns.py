"""The past of a bus, learnt from many good frames at once: the framer's memory over a stretch of a kernel."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dissectors.columns import ROLES, FrameColumns, Octets, Times
from dissectors.frame import Role
from dissectors.modbus.functions import EXCEPTION_BIT, FUNCTIONS
from dissectors.modbus.past import Past

_RESPONSE = ROLES.index(Role.RESPONSE)
_IS_KNOWN = np.array([code & ~EXCEPTION_BIT in FUNCTIONS and not code & EXCEPTION_BIT for code in range(256)])
_WORD = 8
"""Octets of the commonest requests, which are compared as numbers."""


class LearntLengths:
    """What was noted already, ascending: answers by station, function and length; requests of eight octets."""

    def __init__(self) -> None:
        self.answers: npt.NDArray[np.int64] = np.zeros(0, np.int64)
        self.requests: npt.NDArray[np.uint64] = np.zeros(0, np.uint64)


def learn(past: Past, units: set[int], frames: FrameColumns, octets: Octets) -> None:
    """Note what good frames teach: the same as one after the other, but for how stray zeros are forgotten.

    `octets`: where `frames.offset` counts. A frame that may be either, as the confirmation of a write, teaches nothing
    that its request has not.
    """
    frames = frames.take(frames.ok & (frames.length >= 4))
    units.update(np.flatnonzero(np.bincount(octets[frames.offset])).tolist())
    known = past.learnt if past.only_gathers and isinstance(past.learnt, LearntLengths) else LearntLengths()
    past.learnt = known
    is_answer = frames.role == _RESPONSE
    for row in _new_answers(frames, octets, np.flatnonzero(is_answer), known):
        past.note(_octets_of(frames, octets, row), request=False)
    asked = np.flatnonzero(~is_answer)
    first = [
        _first_of_each(frames, octets, asked[frames.length[asked] == length], known)
        for length in np.flatnonzero(np.bincount(frames.length[asked])).tolist()
    ]
    if not first:
        return
    rows = np.sort(np.concatenate(first))
    if not len(rows):
        return
    said = octets[int(frames.offset[rows[0]]) : int(frames.offset[rows[-1]] + frames.length[rows[-1]])].tobytes()
    begins = frames.offset[rows] - frames.offset[rows[0]]
    pairs = zip(begins.tolist(), (begins + frames.length[rows]).tolist(), strict=True)
    whole = [said[begin:end] for begin, end in pairs]
    if _IS_KNOWN[octets[frames.offset[rows] + 1]].all():
        past.note_requests(whole)
        return
    for one in whole:
        past.note(one, request=True)


def _new_answers(frames: FrameColumns, octets: Octets, rows: Times, known: LearntLengths) -> list[int]:
    """One row for each station, function and length that was not there before."""
    begins = frames.offset[rows]
    keys = octets[begins].astype(np.int64) << 24 | octets[begins + 1].astype(np.int64) << 16 | frames.length[rows]
    distinct, first = np.unique(keys, return_index=True)
    new = ~_is_among(distinct, known.answers)
    if new.any():
        known.answers = np.union1d(known.answers, distinct)
    found: list[int] = rows[first[new]].tolist()
    return found


def _first_of_each(frames: FrameColumns, octets: Octets, rows: Times, known: LearntLengths) -> Times:
    """Of rows of one length the first with each content; of short ones only those that were not there before."""
    length = int(frames.length[rows[0]])
    content = np.ascontiguousarray(octets[frames.offset[rows][:, None] + np.arange(length)])
    if length != _WORD:
        return rows[np.unique(content.view(np.dtype((np.void, length)))[:, 0], return_index=True)[1]]
    distinct, first = np.unique(content.view(np.uint64)[:, 0], return_index=True)
    new = ~_is_among(distinct, known.requests)
    if new.any():
        known.requests = np.union1d(known.requests, distinct)
    return rows[first[new]]


def _is_among(values: npt.NDArray[np.integer], ascending: npt.NDArray[np.integer]) -> npt.NDArray[np.bool_]:
    if not len(ascending):
        return np.zeros(len(values), bool)
    at = np.minimum(np.searchsorted(ascending, values), len(ascending) - 1)
    found: npt.NDArray[np.bool_] = ascending[at] == values
    return found


def _octets_of(frames: FrameColumns, octets: Octets, row: int) -> bytes:
    begin = int(frames.offset[row])
    return octets[begin : begin + int(frames.length[row])].tobytes()
