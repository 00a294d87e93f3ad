"""Something that was lost and is looked for again, beside the reading: a port that comes back, a connection anew."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

from dissectors.line import MS
from sniff.sources.clock import Clock

T = TypeVar("T")

LOOK_EVERY = 50 * MS
"""Between looks at an attempt that runs."""


class Attempt(Generic[T]):
    """Runs `work` in a thread of its own. `result`: what it gave, None while it runs and when it failed."""

    def __init__(self, work: Callable[[], T | None], expected: tuple[type[Exception], ...]) -> None:
        self.result: T | None = None
        self._work = work
        self._expected = expected
        self._thread = threading.Thread(target=self._run, name="attempt", daemon=True)
        self._thread.start()

    @property
    def done(self) -> bool:
        """Whether `result` is final."""
        return not self._thread.is_alive()

    def _run(self) -> None:
        try:
            self.result = self._work()
        except self._expected:
            self.result = None


class Reconnecting(Generic[T]):
    """Tries every `every` ns; `work` opens it, gives None or raises one of `expected` when it is not there."""

    def __init__(
        self, clock: Clock, work: Callable[[], T | None], expected: tuple[type[Exception], ...], every: int
    ) -> None:
        self._clock = clock
        self._work = work
        self._expected = expected
        self._every = every
        self._next = 0
        self._attempt: Attempt[T] | None = None

    def lost(self) -> int:
        """It is gone: the first attempt is due in `every` ns. Gives the time now."""
        now = self._clock.now()
        self._next = now + self._every
        return now

    def deadline(self) -> int:
        """When to call `look` next, ns."""
        return self._next if self._attempt is None else self._clock.now() + LOOK_EVERY

    def look(self) -> T | None:
        """What was opened, once; None as long as it is not there."""
        if self._attempt is None:
            if self._clock.now() >= self._next:
                self._attempt = Attempt(self._work, self._expected)
            return None
        if not self._attempt.done:
            return None
        found, self._attempt = self._attempt.result, None
        self._next = self._clock.now() + self._every
        return found
