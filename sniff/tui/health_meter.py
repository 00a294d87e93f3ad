"""The health of the bus as the header and the screens show it: worked out now and then, never for every look."""

from __future__ import annotations

import time

from sniff.analysis.health import Health, HealthReport
from sniff.bus.rows import Store

PERIOD = 2.0
"""Seconds between two looks while rows keep coming: the rules have to be asked for it."""
LEAST_FRAMES = 20
"""Frames from which on a bus that goes on has a health: one damaged frame of three says nothing yet. A capture that is
whole has the one that every command tells."""


class HealthMeter:
    """Health of a store. `report`: the latest, None where nothing can be said yet."""

    def __init__(self) -> None:
        self.report: HealthReport | None = None
        self._version = -1
        self._looked = -PERIOD

    def look(self, store: Store, final: bool) -> HealthReport | None:
        """Look again if it is time, and at once when all has been judged (`final`)."""
        if store.version == self._version:
            return self.report
        now = time.monotonic()
        if now - self._looked < PERIOD and not final:
            return self.report
        if store.summary.load.total.frames < LEAST_FRAMES and not final:
            return None
        self._looked, self._version = now, store.version
        self.report = store.model.health()
        return self.report

    @property
    def bus(self) -> Health | None:
        """Of the bus."""
        return None if self.report is None else self.report.bus
