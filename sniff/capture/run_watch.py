"""Whether this process was let run: stopped, or on a computer that did not get round to it, it reads nothing."""

from __future__ import annotations

from dissectors.line import NS_PER_S

STALLED = 2 * NS_PER_S
"""ns that this process was not let run, from which on what came meanwhile may be lost, and has no time of its own."""


class RunWatch:
    """Told of each turn of the loop. `now`: ns on a clock that goes on meanwhile."""

    def __init__(self, now: int) -> None:
        self._ran = now
        self._again: int | None = None

    def see(self, now: int, waited: int) -> int | None:
        """A turn ended that was to wait for `waited` ns at most; for how many it did not run, None where it did."""
        took, self._ran = now - self._ran, now
        if took - waited < STALLED:
            return None
        self._again = now
        return took

    def runs_since(self, now: int) -> int | None:
        """ns since it was let run again; None where it always was."""
        return None if self._again is None else now - self._again
