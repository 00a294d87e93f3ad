"""Octets that a sender puts behind its frames itself, always the same ones: no driver's and no noise. Pure.

A terminal program adds a line end (0D 0A); a program that makes a check of a frame with its check gets 00 00. Whoever
goes by silence takes neither for the end of a frame. One octet that a change of the level makes is the driver's.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

from dissectors.findings import Finding, Severity, Tally, counted
from dissectors.frame import Noise
from sniff.analysis.breaks import LEVELS
from sniff.analysis.line_rules import LINE_RULES as RULES

LEAST: Final = 5
"""Frames with them."""

_NEARLY = 9, 10
"""So many of so many stretches are the same, and of so many frames have one."""


_DIFFERENT: Final = 32
"""Stretches that are kept apart."""


@dataclass(slots=True)
class Behind:
    """What stood behind the frames of one sender."""

    tally: Tally = field(default_factory=Tally)
    octets: Counter[bytes] = field(default_factory=Counter)

    def add(self, no: int, noise: Noise) -> None:
        """Take a row."""
        self.tally.add(noise.start, no)
        if noise.octets in self.octets or len(self.octets) < _DIFFERENT:
            self.octets[noise.octets] += 1

    def take_back(self, noise: Noise) -> None:
        """Forget one that was something else."""
        self.tally.count -= 1
        if self.octets[noise.octets] > 0:
            self.octets[noise.octets] -= 1


def appended_to(stretches: Counter[bytes], count: int, frames: int) -> bytes | None:
    """The octets behind nearly all of a sender's frames; None where they differ, are seldom, or may be its driver's.

    `stretches`: what stood behind them; `count`: how often, of so many `frames`.
    """
    if count < LEAST or not stretches:
        return None
    octets, often = stretches.most_common(1)[0]
    part, of = _NEARLY
    if of * often < part * count or of * count < part * frames:
        return None
    return octets if len(octets) > 1 or not LEVELS.issuperset(octets) else None


def as_appended(finding: Finding, octets: bytes, frames: int, answered: bool | None) -> Finding:
    """What is found of strays behind frames, where the sender puts them there. `answered`: whether a master's frames
    are taken all the same; None of a station."""
    words = f"the same {counted(len(octets), 'octet')} behind {finding.count} of {counted(frames, 'frame')}"
    rule = RULES["LN207"]
    told = replace(
        finding,
        code=rule.code,
        severity=_GRAVE[answered],
        seen=f"{words}: {octets.hex(' ').upper()}{_WHAT.get(octets, '')}",
        means=rule.means,
        next=rule.next,
    )
    if answered is False:
        return replace(told, means=f"{rule.means}; no station takes a frame that goes on so, and none is heard")
    return replace(told, means=f"{rule.means}; the stations take its frames all the same") if answered else told


_GRAVE: Final[Mapping[bool | None, Severity]] = {None: Severity.WARNING, True: Severity.NOTE, False: Severity.ERROR}
_WHAT: Final[Mapping[bytes, str]] = {
    b"\r\n": ", a line end",
    b"\0\0": ", as a check over a frame and its check would be",
}
