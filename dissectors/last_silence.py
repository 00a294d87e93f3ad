"""The silence of a station since its last sign of life: whether one that used to answer answers no more. Pure.

Damage of the line and single losses do not make it: what is asked several times in a row, up to the end, and never
answered, is not there any more.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Final

from dissectors.findings import Finding, Severity, Tally
from dissectors.words import duration

_LEAST: Final = 5  # requests in a row
_TURNS_LEAST: Final = 2  # of them, that are no repeats


@dataclass(slots=True)
class LastSilence:
    """`missed`: requests that nothing followed since it was heard last; `turns`: of them those that are no repeats."""

    missed: Tally = field(default_factory=Tally)
    turns: int = 0

    def miss(self, time: int, no: int | None, *, is_repeat: bool) -> None:
        """Nothing followed a request."""
        self.missed.add(time, no)
        self.turns += not is_repeat

    def heard(self) -> None:
        """Something came from it, or the master went on as after an answer."""
        if self.missed.count:
            self.missed, self.turns = Tally(), 0

    @property
    def is_lasting(self) -> bool:
        """Whether it is more than some lost requests."""
        return self.missed.count >= _LEAST and self.turns >= _TURNS_LEAST


def fallen_silent(finding: Finding, silence: LastSilence, now: int) -> Finding:
    """The finding of a station that left requests without an answer, where it answers no more; `now`: ns, the end."""
    if not silence.is_lasting:
        return finding
    missed = silence.missed
    since = duration(max(0, now - missed.first))
    return replace(
        finding,
        severity=Severity.ERROR,
        seen=f"{finding.seen}; none to the last {missed.count}, from {since} before the end on",
        evidence=tuple(sorted(missed.evidence)),
        means="the station was switched off, crashed or lost its connection at that time",
        next="what happened at the time of its last answer; supply, fuse and connector of the station",
    )
