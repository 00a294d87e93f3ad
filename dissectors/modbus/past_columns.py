"""The past of a bus, learnt from many good frames at once: the framer's memory over a stretch of a kernel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dissectors.columns import ROLES
from dissectors.frame import Role
from dissectors.modbus.functions import ANSWER_LENGTHS, EXCEPTION_BIT, FUNCTIONS, answer_length
from dissectors.modbus.past import MOST_REQUESTS

if TYPE_CHECKING:
    from dissectors.columns import FrameColumns, Octets, Times
    from dissectors.modbus.past import Past

_REQUEST, _RESPONSE, _EITHER = (ROLES.index(role) for role in (Role.REQUEST, Role.RESPONSE, Role.EITHER))
_LENGTH_VARIES = np.array([code in FUNCTIONS and code not in ANSWER_LENGTHS for code in range(256)])
_IS_KNOWN = np.array([code & ~EXCEPTION_BIT in FUNCTIONS and not code & EXCEPTION_BIT for code in range(256)])
_MANY = 2000
"""Values of which the distinct ones are sooner found by sorting."""


@dataclass(slots=True)
class _Learnt:
    """What a past keeps for the next stretch. `answers`: stations, functions and lengths that were noted already;
    `teaching`: of the block at work."""

    answers: set[int]
    teaching: _Teaching


@dataclass(frozen=True, slots=True)
class _Side:
    """Requests or answers, ascending by row. `call`: unit << 8 | function. `key`: call << 16 | length."""

    rows: Times
    begins: Times
    lengths: Times
    call: Times
    key: Times

    @classmethod
    def of(cls, frames: FrameColumns, octets: Octets, rows: Times) -> _Side:
        begins, lengths = frames.offset[rows], frames.length[rows].astype(np.int64)
        call = octets[begins].astype(np.int64) << 8 | octets[begins + 1]
        return cls(rows, begins, lengths, call, call << 16 | lengths)


class _Teaching:
    """What all good frames of a block teach, worked out once: its chains, which may be many, are learnt one by one.

    A frame that may be either is noted as a request, as the confirmation of a write always is, unless it is the answer
    to the request directly before it.
    """

    def __init__(self, frames: FrameColumns, octets: Octets) -> None:
        self.frames, self._octets = frames, octets
        fine = np.flatnonzero(frames.ok & (frames.length >= 4))
        is_answer = frames.role[fine] == _RESPONSE
        is_answer[_answers_of_either_shape(frames, octets, fine)] = True
        self._requests = _Side.of(frames, octets, fine[~is_answer])
        self._answers = _Side.of(frames, octets, fine[is_answer])
        self._strange: Times = self._requests.rows[~_IS_KNOWN[self._requests.call & 0xFF]]

    def teach(self, past: Past, units: set[int], known: set[int], begin: int, end: int) -> None:
        """Note what rows [begin, end) teach. `known`: keys of answers that were noted already."""
        asked, said = (_within(side, begin, end) for side in (self._requests, self._answers))
        for side, which in ((self._requests, asked), (self._answers, said)):
            units.update(call >> 8 for call in _distinct(side.call[which]))
        self._note_answers(past, known, said)
        if asked.start == asked.stop:
            return
        first_strange, beyond = self._strange.searchsorted((begin, end)).tolist()
        begins, lengths = self._requests.begins[asked], self._requests.lengths[asked]
        if first_strange == beyond:
            calls = _distinct(self._requests.call[asked])
            past.note_requests(asked.stop - asked.start, self._newest(begins, lengths), calls)
            return
        for one in self._each(begins, lengths):
            past.note(one, request=True)

    def _note_answers(self, past: Past, known: set[int], which: slice) -> None:
        """Of answers, the first of each station, function and length that was not there before."""
        if not past.only_gathers:
            known.clear()
        keys = self._answers.key[which]
        new = _distinct(keys) - known
        if not new:
            return
        known |= new
        distinct, first = np.unique(keys, return_index=True)
        for place in np.sort(first[[key in new for key in distinct.tolist()]]).tolist():
            begin = int(self._answers.begins[which.start + place])
            length = int(self._answers.lengths[which.start + place])
            past.note(self._octets[begin : begin + length].tobytes(), request=False)

    def _newest(self, begins: Times, lengths: Times) -> list[bytes]:
        """The last requests that differ, no more than are remembered, in the order in which each came last."""
        newest: dict[bytes, None] = {}
        end = len(begins)
        while end and len(newest) < MOST_REQUESTS:
            begin = max(0, end - MOST_REQUESTS)
            newest |= dict.fromkeys(reversed(self._each(begins[begin:end], lengths[begin:end])))
            end = begin
        return list(newest)[:MOST_REQUESTS][::-1]

    def _each(self, begins: Times, lengths: Times) -> list[bytes]:
        """Frames as octets."""
        said = self._octets[int(begins[0]) : int(begins[-1] + lengths[-1])].tobytes()
        first = begins - begins[0]
        return [said[begin:end] for begin, end in zip(first.tolist(), (first + lengths).tolist(), strict=True)]


def learn(past: Past, units: set[int], frames: FrameColumns, octets: Octets, begin: int, end: int) -> None:
    """Note what good frames teach, of rows [begin, end): the same as one after the other, but for how stray zeros are
    forgotten. `octets`: where `frames.offset` counts."""
    learnt = past.learnt
    if not isinstance(learnt, _Learnt):
        past.learnt = learnt = _Learnt(set(), _Teaching(frames, octets))
    elif learnt.teaching.frames is not frames:
        learnt.teaching = _Teaching(frames, octets)
    learnt.teaching.teach(past, units, learnt.answers, begin, end)


def _answers_of_either_shape(frames: FrameColumns, octets: Octets, fine: Times) -> list[int]:
    """Places in `fine` of frames that have the length of a request, too, as the state of 17 coils, and answer one."""
    code = octets[frames.offset[fine] + 1]
    answers = []
    for place in np.flatnonzero((frames.role[fine] == _EITHER) & _LENGTH_VARIES[code]).tolist():
        asked, row = int(fine[place - 1]), int(fine[place])
        if not place or frames.role[asked] != _REQUEST:
            continue
        request, answer = _octets_of(frames, octets, asked), _octets_of(frames, octets, row)
        if request[:2] == answer[:2] and answer_length(request) == len(answer):
            answers.append(place)
    return answers


def _octets_of(frames: FrameColumns, octets: Octets, row: int) -> bytes:
    begin = int(frames.offset[row])
    return octets[begin : begin + int(frames.length[row])].tobytes()


def _within(side: _Side, begin: int, end: int) -> slice:
    """Which frames of a side are among rows [begin, end)."""
    first, beyond = side.rows.searchsorted((begin, end)).tolist()
    return slice(first, beyond)


def _distinct(values: Times) -> set[int]:
    return set((values if len(values) < _MANY else np.unique(values)).tolist())
