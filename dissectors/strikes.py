"""Strikes: how often each sender's frames were damaged, where what is repeated into one disturbance counts as once.

A master that gets no good answer asks again, three times as a rule: four damaged answers in a row, while nobody else
answers, are one observation and not four. Chance is reckoned with strikes; what is told are frames.
"""

from __future__ import annotations

from dataclasses import dataclass, field

RUN = 4
"""Frames of one sender, damaged one after the other, that count as one strike: a request and three repeats."""


@dataclass(slots=True)
class Strikes:
    """Fed the frames of all senders in their order."""

    _counts: dict[str, int] = field(default_factory=dict)
    _last: str | None = None  # whose frame was damaged last, and no whole answer came since
    _run: int = 0

    def struck(self, sender: str) -> None:
        """A frame of a sender was damaged."""
        self._run = self._run + 1 if sender == self._last else 0
        self._last = sender
        if self._run % RUN == 0:
            self._counts[sender] = self._counts.get(sender, 0) + 1

    def whole(self) -> None:
        """Somebody answered, and nothing was wrong with it."""
        self._last = None

    def of(self, sender: str, damaged: int) -> int:
        """Strikes of a sender of which so many frames were damaged: fewer where some were taken back."""
        return min(self._counts.get(sender, 0), damaged)
