"""Something that takes a while, done beside the reading: looking for a port, making a connection."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")


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
