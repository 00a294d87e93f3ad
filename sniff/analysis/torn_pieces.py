"""Pieces of a frame that a pause or a late read tore: rows that are no good frame, and put together are one. Pure.

A computer or an adapter that holds back the end of a frame shows its begin alone, behind it a silence that there never
was. Where the frame after it was read in time too, no time tells (`Frame.slack`); the octets do: no noise makes a good
frame of what stood before it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Final

from dissectors.findings import Finding, Severity, Tally, counted, together
from dissectors.frame import Chunk, Frame
from dissectors.framer import Framer
from dissectors.line import Timing
from dissectors.manifest import Dissector
from sniff.analysis.line_rules import LINE_RULES as RULES
from sniff.analysis.sender_findings import BUS
from sniff.analysis.shares import standing_out

PIECES: Final = 8
"""Most rows that one torn frame is."""

TORN_LEAST: Final = 3
"""So many frames of one sender, and it is named."""

OFTEN: Final = 0.05
"""Of all of its frames: a weak check agrees by chance now and then."""

_LATE_READS: Final = "a computer or an adapter that read late, or a pause of the sender"
_COMPUTER: Final = "what else runs on the computer; whether it comes again with the same sender"

LONGEST: Final = 600
"""Octets; no more are put together."""


MOST_LONG: Final = 3
"""Most rows of which none is short: noise goes on for many, and one pause makes two."""


class TornPieces:
    """Fed every row that is no good frame, and told of good ones. `short`: octets that may be stray ones."""

    def __init__(self, dissector: Dissector, timing: Timing, short: int) -> None:
        self._framer, self._timing = dissector.framer, Timing(timing.line)
        self._short = short
        self._pieces: list[bytes] = []  # since the last good frame
        self.remains: list[int] = []  # octets of those that were counted as no frame
        self._torn: dict[str, Tally] = {}

    def forget(self) -> None:
        """A good frame came."""
        if self._pieces:
            self._pieces, self.remains = [], []

    def complete(self, octets: bytes) -> bool:
        """Take a row that is no good frame; whether it makes those before it a good one."""
        self._pieces.append(octets)
        if len(self._pieces) > PIECES or sum(map(len, self._pieces)) > LONGEST:
            self.forget()
        if len(self._pieces) < 2 or (self._are_long and len(self._pieces) > MOST_LONG):
            return False
        return self._is_one_frame(b"".join(self._pieces))

    def take(self, name: str, time: int, no: int) -> None:
        """What was put together is a frame of this sender, and the row `no` its end."""
        if self._are_long:  # else it is what a busy computer does
            self._torn.setdefault(name, Tally()).add(time, no)
        self.forget()

    def count_remains(self, octets: int) -> None:
        """The newest row was counted as octets that are no frame."""
        if self._pieces:
            self.remains.append(octets)

    @property
    def _are_long(self) -> bool:
        return min(map(len, self._pieces)) > self._short

    def found(self, frames: Mapping[str, int], master: str) -> Iterator[Finding]:
        """Whose frames come in pieces; `frames`: of each sender, how many came."""
        counts = {name: self._torn[name].count if name in self._torn else 0 for name in frames}
        shares = {name: (count, float(max(count, frames[name]))) for name, count in counts.items()}
        out = standing_out(shares, master)
        often = {name for name in out if TORN_LEAST <= self._torn[name].count >= OFTEN * frames[name]}
        named = often - {BUS}
        for name in sorted(named):
            yield self._torn[name].found(RULES["LN206"], name, _words(self._torn[name]))
        rest = together(tally for name, tally in self._torn.items() if name not in named)
        if rest.count:
            finding = rest.found(RULES["LN206"], BUS, _words(rest), Severity.NOTE)
            yield replace(finding, means=_LATE_READS, next=_COMPUTER)

    def _is_one_frame(self, octets: bytes) -> bool:
        framer: Framer = self._framer(self._timing)
        events = framer.feed(Chunk(len(octets) * self._timing.char, octets)) + framer.close()
        return len(events) == 1 and isinstance(events[0], Frame) and events[0].ok


def _words(torn: Tally) -> str:
    return f"{counted(torn.count, 'frame')} came in pieces, with good checks once they are put together"
