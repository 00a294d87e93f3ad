"""Silences between frames (`gaps.py`), for stretches of regular exchanges at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dissectors.columns import FOUNDS, ROLES
from dissectors.frame import FoundBy, Role
from dissectors.modbus.gaps import SPACING_KEPT, Gaps, sender_name

if TYPE_CHECKING:
    from dissectors.columns import Masks, Times
    from dissectors.line import Timing
    from dissectors.row_columns import RowColumns

_JOINED = FOUNDS.index(FoundBy.JOINED)
_REQUEST, _RESPONSE = ROLES.index(Role.REQUEST), ROLES.index(Role.RESPONSE)


@dataclass(frozen=True, slots=True)
class Silences:
    """Of good frames, each as if the row before were one too. ns.

    `inside`: silence in a frame. `spacing`: the same an octet. `close`: begins too soon after the row before. `pause`:
    from the row before, where that is an answer and this a request; -1 elsewhere.
    """

    inside: Times
    spacing: Times
    close: Masks
    pause: Times


def silences(rows: RowColumns, timing: Timing, limit: int) -> Silences:
    """Of all rows. `limit`: `Gaps.close`."""
    frames, slack = rows.frames, rows.slack
    length = frames.length.astype(np.int64)
    inside = frames.end - slack - frames.start - length * timing.char
    between = np.zeros(len(rows), np.int64)
    between[1:] = frames.start[1:] - frames.end[:-1]
    close = np.zeros(len(rows), bool)
    close[1:] = (between[1:] > 0) & (between[1:] + slack[:-1] < limit)
    pause = np.full(len(rows), -1)
    role = rows.placed.role
    pauses = np.flatnonzero((role[:-1] == _RESPONSE) & (role[1:] == _REQUEST)) + 1
    pause[pauses] = np.maximum(between[pauses], 0)
    return Silences(inside, inside // np.maximum(length - 1, 1), close, pause)


def see_close(gaps: Gaps, rows: RowColumns, which: Times) -> None:
    """Frames that began too soon after the row before, which is good too."""
    octets, offset, length = rows.octets, rows.frames.offset, rows.frames.length
    for place in which.tolist():
        mine, before = (octets[offset[at] : offset[at] + length[at]].tobytes() for at in (place, place - 1))
        if mine != before:
            sender = int(rows.placed.source[place]) if rows.placed.role[place] == _RESPONSE else 0
            no = rows.first + place
            gaps.seen.too_close(sender_name(sender), int(rows.frames.start[place]), no - 1, no)


def see_spacing(gaps: Gaps, rows: RowColumns, said: Silences, stretch: slice) -> None:
    """Silences inside the frames of a stretch."""
    inside, spacing = said.inside[stretch], said.spacing[stretch]
    who = np.where(rows.placed.role[stretch] == _RESPONSE, rows.placed.source[stretch].astype(np.int64), 0)
    if int(inside.max()) > gaps.pause_limit:
        start, length = rows.frames.start[stretch].tolist(), rows.frames.length[stretch].tolist()
        torn = (rows.frames.found[stretch] == _JOINED).tolist()
        every = zip(who.tolist(), inside.tolist(), spacing.tolist(), start, length, torn, strict=True)
        for no, (sender, silence, of_octet, began, size, is_torn) in enumerate(every, rows.first + stretch.start):
            if silence > gaps.pause_limit:
                gaps.see_pause(no, began, size, silence, sender_name(sender), is_torn=is_torn)
            gaps.spacing_of(sender_name(sender)).append(of_octet)
        return
    order = np.argsort(who.astype(np.int16), kind="stable")
    ends = np.cumsum(np.bincount(who)).tolist()
    begin = 0
    for sender, end in enumerate(ends):
        if begin < end:
            newest = order[max(begin, end - SPACING_KEPT) : end]
            gaps.spacing_of(sender_name(sender)).extend(spacing[newest].tolist())
        begin = end


def hurried(gaps: Gaps, pauses: list[int]) -> list[int]:
    """Which of the master's next pauses are far below the usual of those before them."""
    if not pauses:
        return []
    every, begin = [*gaps.pauses, *pauses], len(gaps.pauses)
    most = max(every) - gaps.latency
    if 2 * min(pauses) >= most:
        return []
    doubtful = [at for at, pause in enumerate(pauses) if 2 * pause < most]
    return [at for at in doubtful if gaps.is_hurried(pauses[at], every[max(0, begin + at - SPACING_KEPT) : begin + at])]


def turns_before(gaps: Gaps, rows: RowColumns, requests: list[int], first: int) -> tuple[Times, Times, Masks]:
    """`Rhythm.turns` up to each of some requests behind answers, in a stretch that begins with row `first`; whether
    that is known."""
    start, end, at = rows.frames.start, rows.frames.end, np.array(requests, np.int64)
    inside = at > first
    asked = start[np.where(inside, at - 2, 0)]
    cycles, answers = np.where(inside, start[at] - asked, 0), np.where(inside, end[at - 1] - asked, 0)
    if requests[:1] == [first] and gaps.asked is not None and gaps.answered is not None:
        cycles[0], answers[0] = int(start[first]) - gaps.asked, gaps.answered.end - gaps.asked
        inside[0] = True
    return cycles, answers, inside
