"""The turns of an N2 master: commands that were answered, and soon followed by the next one."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from dissectors.n2.unheard import SOON
from dissectors.rhythm import Rhythm

PAUSES_LEAST: Final = 16
"""Pauses of a master after which its usual ones are known."""


@dataclass(slots=True)
class Clocked:
    """Fed answered commands and the commands behind them; all times ns."""

    rhythm: Rhythm = field(default_factory=Rhythm)
    _answered: tuple[int, int, int] | None = None  # the newest command: its begin, its end, the end of its answer

    def answered(self, start: int, end: int, answer_end: int) -> None:
        """Take a command that was answered."""
        self._answered = start, end, answer_end

    def see_command(self, start: int) -> None:
        """Take the begin of the next command."""
        if self._answered is None:
            return
        (begin, end, answer_end), self._answered = self._answered, None
        if start - end < SOON:
            self.rhythm.turns.append((start - begin, answer_end - begin))

    @property
    def short_pause(self) -> int | None:
        """A pause of the master behind an answer, than which three in four are longer; None where few are known."""
        pauses = sorted(cycle - answer for cycle, answer in self.rhythm.turns)
        return pauses[len(pauses) // 4] if len(pauses) >= PAUSES_LEAST else None
