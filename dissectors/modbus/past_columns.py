"""What a bus has said, learnt from many good frames at once: the memory of the framer over a stretch of a kernel."""

from __future__ import annotations

import numpy as np

from dissectors.columns import ROLES, FrameColumns, Octets, Times
from dissectors.frame import Role
from dissectors.modbus.past import Past

_RESPONSE = ROLES.index(Role.RESPONSE)


def learn(past: Past, units: set[int], frames: FrameColumns, octets: Octets) -> None:
    """Note what good frames teach: the same as one after the other, but for how stray zeros are forgotten.

    `octets`: where `frames.offset` counts. A frame that may be either, as the confirmation of a write, teaches nothing
    that its request has not.
    """
    frames = frames.take(frames.ok & (frames.length >= 4))
    units.update(np.unique(octets[frames.offset]).tolist())
    answers = frames.role == _RESPONSE
    for row in _distinct_answers(frames, octets, np.flatnonzero(answers)):
        past.note(_octets_of(frames, octets, row), request=False)
    asked = np.flatnonzero(~answers)
    first = [
        _first_of_each(frames, octets, asked[frames.length[asked] == length]) for length in _lengths(frames, asked)
    ]
    for row in sorted(np.concatenate(first).tolist()) if first else ():
        past.note(_octets_of(frames, octets, row), request=True)


def _lengths(frames: FrameColumns, rows: Times) -> list[int]:
    lengths: list[int] = np.unique(frames.length[rows]).tolist()
    return lengths


def _distinct_answers(frames: FrameColumns, octets: Octets, rows: Times) -> list[int]:
    """One row for each station, function and length."""
    begins = frames.offset[rows]
    keys = octets[begins].astype(np.int64) << 24 | octets[begins + 1].astype(np.int64) << 16 | frames.length[rows]
    distinct: list[int] = rows[np.unique(keys, return_index=True)[1]].tolist()
    return distinct


def _first_of_each(frames: FrameColumns, octets: Octets, rows: Times) -> Times:
    """Of rows of one length the first with each content."""
    length = int(frames.length[rows[0]])
    content = octets[frames.offset[rows][:, None] + np.arange(length)]
    keys = np.ascontiguousarray(content).view(np.uint64 if length == 8 else np.dtype((np.void, length)))[:, 0]
    return rows[np.unique(keys, return_index=True)[1]]


def _octets_of(frames: FrameColumns, octets: Octets, row: int) -> bytes:
    begin = int(frames.offset[row])
    return octets[begin : begin + int(frames.length[row])].tobytes()
