"""The one contract of all outlets: told something, never waited for, dropped from with a count.

An outlet has a bounded box of what it was told and a thread of its own that takes from it. Where the thread falls
behind, the oldest is dropped and counted: what is newest about a bus is worth most. Whoever tells never waits, at the
end neither.
"""

from __future__ import annotations

import threading
import time
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Sequence

from sniff.outlets.told import Told

MOST_WAITING = 8192
"""Things told that wait for an outlet; a busy bus tells some hundred a second."""

AT_THE_END = 1.5
"""Seconds that outlets get, all together, for what still waits when everything is over."""


class Outlet(ABC):
    """One listener. `name`: as people know it. `every`: ns between two values of one point, 0 for each of them.
    `sent`, `dropped`: how many were delivered, and how many never will be. `trouble`: why nothing gets through at the
    moment, in words without secrets; empty when all is well. `connected`: whether what it is told gets through; not yet
    either, where that needs somebody at the other end. `where`: whom it tells, in words without secrets. `complain`:
    called once when trouble begins, and once when it is over.
    """

    def __init__(self, name: str, complain: Callable[[str], None], every: int = 0, most: int = MOST_WAITING) -> None:
        self.name = name
        self.every = every
        self.sent = self.dropped = 0
        self.trouble = self.where = ""
        self.connected = True
        self._complain = complain
        self._told: deque[Told] = deque()
        self._most = most
        self._condition = threading.Condition()
        self._closing = False
        self._thread = threading.Thread(target=self._live, name=name, daemon=True)

    def start(self) -> None:
        """From now on what is told is delivered."""
        self._thread.start()

    def tell(self, things: Sequence[Told]) -> None:
        """Hand things on; never waits. The oldest give way."""
        with self._condition:
            self._told.extend(things)
            excess = len(self._told) - self._most
            for _ in range(excess):
                self._told.popleft()
            self.dropped += max(0, excess)
            self._condition.notify()
        self._wake()

    def finish(self) -> None:
        """Nothing more will be told: what waits is delivered meanwhile. Does not wait for it; `close` does."""
        with self._condition:
            self._closing = True
            self._condition.notify()
        self._wake()

    def close(self, patience: float = AT_THE_END) -> None:
        """Deliver what waits, for so many seconds at most; the rest is dropped, and counted."""
        self.finish()
        self._thread.join(patience)
        with self._condition:
            self.dropped += len(self._told)
            self._told.clear()

    @property
    def closing(self) -> bool:
        """Whether nothing more will be told."""
        return self._closing

    @property
    def counted(self) -> str:
        """How it is doing, in words for a line: "mqtt 120 sent, 3 dropped"."""
        dropped = f", {self.dropped} dropped" if self.dropped else ""
        return f"{self.name} {self.sent} sent{dropped}" + (f" ({self.trouble})" if self.trouble else "")

    def _wake(self) -> None:  # noqa: B027
        """Called after something was told, for a thread that waits elsewhere."""

    def _take(self, most: int, timeout: float | None = 0.0) -> list[Told]:
        """The oldest things that wait; waits up to `timeout` seconds (None: for ever) for some, or the end."""
        with self._condition:
            if not self._told and not self._closing and timeout != 0:
                self._condition.wait(timeout)
            return [self._told.popleft() for _ in range(min(most, len(self._told)))]

    def _fare(self, trouble: str) -> None:
        """Say once that nothing gets through, and once that it does again."""
        if bool(trouble) is not bool(self.trouble):
            self._complain(f"{self.name}: {trouble}" if trouble else f"{self.name}: goes on")
        self.trouble = trouble
        self.connected = not trouble

    def _live(self) -> None:
        try:
            self._run()
        except Exception as error:  # an outlet that breaks is said, and breaks nothing else
            self._fare(f"ended: {type(error).__name__}")

    @abstractmethod
    def _run(self) -> None:
        """The thread: take and deliver until `closing` and nothing waits."""


def close_all(outlets: Sequence[Outlet], patience: float = AT_THE_END) -> None:
    """Close them at the same time: one that hangs takes nothing from the others, and all of them no longer than one."""
    until = time.monotonic() + patience
    for outlet in outlets:
        outlet.finish()
    for outlet in outlets:
        outlet.close(max(0.0, until - time.monotonic()))
