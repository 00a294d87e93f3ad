"""A station that may be a late speaker: all damage stands while its answer is overdue, too little to prove it. Pure.

Who is hit by a late answer is innocent, and who damages his own frames is not: as long as chance does not tell the two
apart, neither is named. What is found is the bus's, and says both.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from dissectors.chances import at_least
from dissectors.findings import Finding, Rule, counted
from dissectors.late_speakers import MASTER, NOBODY, Heard, LateSpeakers, Window

_LEAST = 3  # damaged frames, and waits in vain
_ELSEWHERE = 10  # of so many damaged frames one may stand elsewhere
_LIKELY = 0.5  # the chance that so much stands there, from which on it speaks for nothing


@dataclass(frozen=True, slots=True)
class PerhapsLate:
    """A station that may speak into what others send.

    `struck`, `of`: damaged frames of others while its answer was overdue, and all of theirs; `elsewhere`,
    `of_elsewhere`: the same at other times. `hit`: stations among those that are damaged.
    """

    station: int
    window: Window
    struck: int
    of: int
    elsewhere: int
    of_elsewhere: int
    hit: tuple[int, ...]

    def told_of(self, rule: Rule) -> Finding:
        """What is found by a rule: of the bus, since it may be either."""
        words = (
            f"{counted(self.struck, 'damaged frame')} while the answer of station {self.station} was overdue: "
            f"{self.struck} of {self.of} then, {self.elsewhere} of {self.of_elsewhere} elsewhere; "
            "so few may stand there by chance"
        )
        return replace(
            self.window.damage.found(rule, "bus", words),
            means=f"station {self.station} answers when its master has given up, and hits them; or they are damaged by "
            "themselves",
            next="a longer capture tells which; compare the master's timeout with the answer times of this station",
            stations=(self.station, *self.hit),
        )


def perhaps_late(late: LateSpeakers, whole: Mapping[str, int], heard: Mapping[int, Heard]) -> PerhapsLate | None:
    """The station in whose windows nearly all damage of others stands, if there is one. `whole`, `heard`: as
    `late_speakers` takes them."""
    likely = sorted(late.windows.items(), key=lambda pair: -pair[1].damage.count)
    for station, window in likely:
        known = heard.get(station, Heard(0, 0, 0))
        if window.opened >= _LEAST and (known.answers or known.late):
            judged = _judged(station, window, late, whole)
            if judged is not None:
                return judged
    return None


def _judged(station: int, window: Window, late: LateSpeakers, whole: Mapping[str, int]) -> PerhapsLate | None:
    own = f"station {station}"
    struck = window.struck.total() - window.struck[own]
    damaged = late.damaged.total() - late.damaged[own]
    if struck < _LEAST or _ELSEWHERE * (damaged - struck) > struck:
        return None
    here = struck + window.whole.total() - window.whole[own]
    frames = damaged + sum(count for sender, count in whole.items() if sender not in (own, NOBODY))
    if here >= frames or at_least(struck, damaged, here / frames) >= _LIKELY:
        return None
    hit = sorted(int(sender.split()[1]) for sender in window.struck if sender not in (own, MASTER, NOBODY))
    return PerhapsLate(station, window, struck, here, damaged - struck, frames - here, tuple(hit))
