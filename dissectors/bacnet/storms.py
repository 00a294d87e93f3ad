"""Broadcasts so dense that they are a storm: each costs every station time, and nobody waits for an answer."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence

from dissectors.bacnet.limits import MS

STORM_BROADCASTS = 100
STORM_WITHIN = 5_000 * MS


class Storms:
    """Fed the time of each broadcast."""

    def __init__(self) -> None:
        self._newest: deque[int] = deque(maxlen=STORM_BROADCASTS)
        self._since: int | None = None  # the first of the storm that goes on

    def see(self, time: int) -> int | None:
        """How long (ns) a storm has lasted, where this one is the last of STORM_BROADCASTS within STORM_WITHIN."""
        newest = self._newest
        newest.append(time)
        if len(newest) < STORM_BROADCASTS or not 0 <= time - newest[0] <= STORM_WITHIN:
            self._since = None
            return None
        if self._since is None:
            self._since = newest[0]
        return time - self._since

    def see_many(self, times: Sequence[int]) -> None:
        """Take broadcasts of which it is known that they are no storm."""
        if times:
            self._since = None
        self._newest.extend(times)

    @property
    def newest(self) -> Iterable[int]:
        """When the newest were sent."""
        return self._newest
