"""Whether the master sends by a clock: then its next command says nothing of an answer.

    command ── answer ── pause ── command        the pause is steady: it goes on when it has the answer
    command ─────── step ──────── command        the step is steady, however long the answer took: it has a clock

Counted are answered commands that the next one followed soon, where both could be. How far eight in ten of them lie
apart is compared; a few turns of another kind change nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from dissectors.histogram import Histogram
from dissectors.line import MS
from dissectors.n2.unheard import SOON

LEAST: Final = 20
MOST: Final = 4096
"""Of the first so many turns it is told."""

STEADIER: Final = 3
"""So many times less than the pauses vary the steps of a clock."""


@dataclass(slots=True)
class Clocked:
    """Fed answered commands and the commands behind them; all times ns."""

    steps: Histogram = field(default_factory=Histogram)
    pauses: Histogram = field(default_factory=Histogram)
    _answered: tuple[int, int, int] | None = None  # the newest command: its begin, its end, the end of its answer

    def answered(self, start: int, end: int, answer_end: int) -> None:
        """Take a command that was answered."""
        self._answered = start, end, answer_end

    def see_command(self, start: int) -> None:
        """Take the begin of the next command."""
        if self._answered is None:
            return
        (begin, end, answer_end), self._answered = self._answered, None
        if start - end < SOON and self.steps.count < MOST:
            self.steps.add(start - begin)
            self.pauses.add(start - answer_end)

    @property
    def is_sure(self) -> bool:
        """Whether the steps are steady, and the pauses are not."""
        steps, pauses = _spread(self.steps), _spread(self.pauses)
        return self.steps.count >= LEAST and STEADIER * steps <= pauses >= MS


def _spread(times: Histogram) -> int:
    return (times.quantile(0.9) or 0) - (times.quantile(0.1) or 0)
