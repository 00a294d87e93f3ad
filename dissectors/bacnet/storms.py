"""Broadcasts so dense that they are a storm: each costs every station time, and nobody waits for an answer."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

from dissectors.bacnet.limits import MS

STORM_BROADCASTS = 100
STORM_WITHIN = 5_000 * MS


class Storms:
    """Fed the time of each broadcast."""

    def __init__(self) -> None:
        self._newest: deque[int] = deque(maxlen=STORM_BROADCASTS)

    def see(self, time: int) -> bool:
        """Whether this one is the last of STORM_BROADCASTS within STORM_WITHIN."""
        newest = self._newest
        newest.append(time)
        return len(newest) == STORM_BROADCASTS and 0 <= time - newest[0] <= STORM_WITHIN

    def see_many(self, times: Iterable[int]) -> None:
        """Take broadcasts of which it is known that they are no storm."""
        self._newest.extend(times)

    @property
    def newest(self) -> Iterable[int]:
        """When the newest were sent."""
        return self._newest
