"""The turns of an N2 master: commands that were answered, and soon followed by the next one."""

from __future__ import annotations

from dataclasses import dataclass, field

from dissectors.n2.unheard import SOON
from dissectors.rhythm import Rhythm


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
