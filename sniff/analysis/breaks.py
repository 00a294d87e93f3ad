"""Breaks: how often the line was held low, and in how many disturbances. Pure.

One disturbance (a plug that bounces, two that send at once) holds the line low many times; what is counted and judged
is the disturbances. A zero octet within somebody else's octets is no break: that is how another baud rate is heard. Who
sent before a disturbance made it only where it is short, as that of a driver that is held or lets go late: a line that
is low again and again is somebody's talk, and stands behind that frame by its time alone.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Final

from dissectors.findings import Finding, Severity, Tally, counted, times
from dissectors.frame import Event, Frame, LineError
from dissectors.line import MS, NS_PER_S
from sniff.analysis.line_rules import LINE_RULES as RULES

ONE_DISTURBANCE: Final = 250 * MS
"""From its begin; what comes later is another one."""

AT_ONE_MOMENT: Final = NS_PER_S
"""All within so long of a capture are one event, however often the line was held low."""


SHORT: Final = 3
"""So often at most the line is low in one disturbance that a driver makes which is held, or lets go late."""

LEVELS: Final = frozenset((0x00, 0x80, 0xC0, 0xE0, 0xF0, 0xF8, 0xFC, 0xFE, 0xFF))
"""Octets that one change of the level makes."""


def breaks_in(event: Event) -> int:
    """How many octets of a row with marks are breaks.

    None in a good frame: a break would have spoilt it, and an octet marked so has another cause (another parity, a flag
    that covers the whole packet). None in octets that are no frame and mostly other than zero, or in a longer stretch
    with several that no single change of the level makes: that is talk.
    """
    octets = event.octets
    if isinstance(event, Frame):
        if event.ok:
            return 0
    elif 2 * octets.count(0) < len(octets) or (len(octets) > SHORT and _changing(octets) > 1):
        return 0
    size = len(octets)
    return sum(
        bool(mark.error & LineError.BREAK) and mark.offset < size and not octets[mark.offset] for mark in event.marks
    )


def _changing(octets: bytes) -> int:
    return sum(octet not in LEVELS for octet in octets)


class Breaks:
    """Fed rows with marks. `events`: the disturbances; `begun_by`: number of the row that began the newest one."""

    def __init__(self) -> None:
        self.events = Tally()
        self.begun_by: int | None = None
        self._begin = 0
        self._lows = self._lows_here = 0  # in all, and in the newest disturbance
        self._over_frames = 0  # disturbances that began in a damaged frame
        self._behind: str | None = None  # who sent before the newest one, or while it began
        self._own: Counter[str] = Counter()  # short ones, by who did

    def see(self, no: int, event: Event) -> int:
        """Take the next row with marks; how many breaks are in it."""
        count = breaks_in(event)
        if not count:
            return 0
        self._lows += count
        self._lows_here += count
        if self.begun_by is not None and 0 <= event.start - self._begin < ONE_DISTURBANCE:
            self.events.last = max(self.events.last, event.start)
            return count
        self._own, self._behind, self._lows_here = self.own, None, count
        self.begun_by, self._begin = no, event.start
        self.events.add(event.start, no)
        self._over_frames += isinstance(event, Frame)
        return count

    def begin_behind(self, name: str) -> None:
        """Say who sent before the newest disturbance, or while it began."""
        self._behind = name

    @property
    def own(self) -> Counter[str]:
        """How many disturbances began behind somebody and are so short that he may have made them."""
        is_own = self._behind is not None and self._lows_here <= SHORT
        return self._own + Counter([self._behind] if is_own and self._behind is not None else [])

    def severity(self, note_if: Callable[[int, int], Severity | None], frames: int) -> Severity | None:
        """NOTE where there was but one disturbance, or few."""
        at_one_moment = self.events.last - self.events.first < AT_ONE_MOMENT
        return note_if(1 if at_one_moment else self.events.count, frames)

    @property
    def _seen(self) -> str:
        words = f"the line was held low {times(self._lows)}"
        many = self.events.count
        return words if many == self._lows else f"{words}, in {counted(many, 'disturbance')}"

    def of_sender(self, name: str, struck: int) -> Finding:
        """What is found of the sender in or behind whose frames `struck` of the disturbances began."""
        seen = f"{self._seen}; {struck} of {self.events.count} began in or directly after its frames"
        return replace(
            self.events.found(RULES["LN103"], name, seen),
            means="this station's driver holds the line, or lets go so late or so hard that it falls",
            next="its turnaround, its converter's direction control, A and B at this station; then bias",
        )

    def of_bus(self, severity: Severity | None) -> Finding:
        """What is found of the bus."""
        finding = self.events.found(RULES["LN103"], "bus", self._seen, severity)
        if severity is not None:
            return replace(
                finding,
                means="something that passed: a plug, a switch, a discharge",
                next="nothing, unless it comes again: then bias, and who was at the line",
            )
        if 2 * self._over_frames > self.events.count:
            return replace(
                finding,
                seen=f"{finding.seen}; {self._over_frames} of them began in a damaged frame",
                means="two that send at once, or a driver or a short circuit that holds the line while others send",
                next="whose frames these are; two masters or two stations with one address; then A and B, and bias",
            )
        return finding
