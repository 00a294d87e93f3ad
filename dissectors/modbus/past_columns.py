"""The past of a bus, learnt from many good frames at once: the framer's memory over a stretch of a kernel."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dissectors.columns import ROLES, FrameColumns, Octets, Times
from dissectors.frame import Role
from dissectors.modbus.functions import ANSWER_LENGTHS, EXCEPTION_BIT, FUNCTIONS, answer_length
from dissectors.modbus.past import MOST_REQUESTS, Past

_REQUEST, _RESPONSE, _EITHER = (ROLES.index(role) for role in (Role.REQUEST, Role.RESPONSE, Role.EITHER))
_LENGTH_VARIES = np.array([code in FUNCTIONS and code not in ANSWER_LENGTHS for code in range(256)])
_IS_KNOWN = np.array([code & ~EXCEPTION_BIT in FUNCTIONS and not code & EXCEPTION_BIT for code in range(256)])


class LearntLengths:
    """What was noted already: answers by station, function and length, ascending; by station and function, whether
    there were requests."""

    def __init__(self) -> None:
        self.answers: npt.NDArray[np.int64] = np.zeros(0, np.int64)
        self.calls = np.zeros(1 << 16, bool)


def learn(past: Past, units: set[int], frames: FrameColumns, octets: Octets) -> None:
    """Note what good frames teach: the same as one after the other, but for how stray zeros are forgotten.

    `octets`: where `frames.offset` counts. A frame that may be either is noted as a request, as the confirmation of a
    write always is, unless it is the answer to the request directly before it.
    """
    fine = np.flatnonzero(frames.ok & (frames.length >= 4))
    if not len(fine):
        return
    begins, lengths = frames.offset[fine], frames.length[fine].astype(np.int64)
    units.update(np.flatnonzero(np.bincount(octets[begins])).tolist())
    is_answer = frames.role[fine] == _RESPONSE
    is_answer[_answers_of_either_shape(frames, octets, fine)] = True
    for row in _new_answers(past, octets, begins[is_answer], lengths[is_answer]):
        past.note(_octets_of(frames, octets, int(fine[is_answer][row])), request=False)
    begins, lengths = begins[~is_answer], lengths[~is_answer]
    if not len(begins):
        return
    if _IS_KNOWN[octets[begins + 1]].all():
        calls = octets[begins].astype(np.int64) << 8 | octets[begins + 1]
        known = _learnt(past)
        fresh = calls[~known.calls[calls]]
        known.calls[fresh] = True
        past.note_requests(len(begins), _newest(octets, begins, lengths), set(fresh.tolist()))
        return
    for one in _each(octets, begins, lengths):
        past.note(one, request=True)


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


def _newest(octets: Octets, begins: Times, lengths: Times) -> list[bytes]:
    """The last requests that differ, no more than are remembered, in the order in which each came last."""
    newest: dict[bytes, None] = {}
    end = len(begins)
    while end and len(newest) < MOST_REQUESTS:
        begin = max(0, end - MOST_REQUESTS)
        newest |= dict.fromkeys(reversed(_each(octets, begins[begin:end], lengths[begin:end])))
        end = begin
    return list(newest)[:MOST_REQUESTS][::-1]


def _each(octets: Octets, begins: Times, lengths: Times) -> list[bytes]:
    """Frames as octets."""
    said = octets[int(begins[0]) : int(begins[-1] + lengths[-1])].tobytes()
    first = begins - begins[0]
    return [said[begin:end] for begin, end in zip(first.tolist(), (first + lengths).tolist(), strict=True)]


def _new_answers(past: Past, octets: Octets, begins: Times, lengths: Times) -> list[int]:
    """The first place of each station, function and length that was not there before."""
    known = _learnt(past)
    if not past.only_gathers:
        known.answers = np.zeros(0, np.int64)
    keys = octets[begins].astype(np.int64) << 24 | octets[begins + 1].astype(np.int64) << 16 | lengths
    places = np.flatnonzero(~_is_among(keys, known.answers))
    if not len(places):
        return []
    distinct, first = np.unique(keys[places], return_index=True)
    known.answers = np.union1d(known.answers, distinct)
    found: list[int] = places[first].tolist()
    return found


def _learnt(past: Past) -> LearntLengths:
    if not isinstance(past.learnt, LearntLengths):
        past.learnt = LearntLengths()
    return past.learnt


def _is_among(values: npt.NDArray[np.integer], ascending: npt.NDArray[np.integer]) -> npt.NDArray[np.bool_]:
    if not len(ascending):
        return np.zeros(len(values), bool)
    at = np.minimum(np.searchsorted(ascending, values), len(ascending) - 1)
    found: npt.NDArray[np.bool_] = ascending[at] == values
    return found


def _octets_of(frames: FrameColumns, octets: Octets, row: int) -> bytes:
    begin = int(frames.offset[row])
    return octets[begin : begin + int(frames.length[row])].tobytes()
