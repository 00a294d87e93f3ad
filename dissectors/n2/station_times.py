"""How soon a station answers, as far as it was seen."""

from __future__ import annotations

from dataclasses import dataclass

from dissectors.tracker import Interval

FEW = 16
"""Answers of a station after which its shortest time says something."""


@dataclass(slots=True)
class StationTimes:
    """How often it answered, and the shortest time that an answer may have taken, ns."""

    count: int = 0
    least: int = 0

    def add(self, latency: Interval) -> None:
        """Take one answer."""
        self.least = min(self.least, latency.low) if self.count else latency.low
        self.count += 1
