"""A master that gives up before its stations answer: whether it is that, and not one slow station, or noise. Pure.

Late answers fall on what the master sends next, and so seem damage of everybody, requests that are lost, answers that
nobody asked for. Of one station that is its own slowness; where most are late now and then, it is one setting of the
master. The damage that such answers do stands where one is overdue, and noise stands anywhere.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from dissectors.late_speakers import Heard, LateSpeakers, Window

_HEARD = 3  # answers from which on a station counts among those that are there
_LATE, _STATIONS = 3, 2  # late answers, and stations that give them
_EACH = 3  # frames that one answer damages at most
_NOTHING = Window()


@dataclass(frozen=True, slots=True)
class Impatience:
    """What shows it.

    `late`: the stations that are heard to answer late; `answers`: of theirs, how many. `in_vain`: those, and what was
    left by all that are late or are shown in damage. `overdue`, `damaged`: damaged frames where an answer was, and all.
    """

    late: tuple[int, ...]
    answers: int
    in_vain: int
    overdue: int
    damaged: int


def impatience(late: LateSpeakers, heard: Mapping[int, Heard]) -> Impatience | None:
    """What shows that the master gives up too soon; None where it does not. `heard`: of each station."""
    there = {station: one for station, one in heard.items() if one.answers + one.late >= _HEARD}
    are_late = tuple(sorted(station for station, one in there.items() if one.late))
    answers = sum(there[station].late for station in are_late)
    shown = {station: one.late + _hits(window(late, station)) for station, one in there.items()}
    is_one = 2 * sum(shown.values()) < 3 * max(shown.values(), default=0)  # and hardly anybody else
    if len(are_late) < _STATIONS or answers < _LATE or is_one:
        return None
    waited = [there[station] for station, often in shown.items() if often]
    in_vain = answers + sum(one.missing for one in waited)
    if 2 * len(waited) < len(there) or 4 * late.overdue < 3 * late.struck or late.struck > _EACH * in_vain:
        return None
    return Impatience(are_late, answers, in_vain, late.overdue, late.struck)


def window(late: LateSpeakers, station: int) -> Window:
    """What came while the answer of a station was overdue."""
    return late.windows.get(station, _NOTHING)


def _hits(due: Window) -> int:
    """How often damage stood directly behind a wait for a station, or showed that it spoke."""
    return due.behind.count + due.own_behind.count + due.shown.total()
