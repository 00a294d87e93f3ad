"""Findings of all buses that are followed together, looked at while somebody reads the findings."""

from __future__ import annotations

import time
from collections.abc import Sequence

from dissectors.findings import Finding
from sniff.analysis.site_findings import SiteBus, SiteJudgement, judged
from sniff.bus.site import site_bus
from sniff.tui.seats import Seat

EVERY = 10.0
"""Seconds between two looks at buses that go on; files are looked at once, when all of them are judged."""


class SiteMeter:
    """Findings of the site, the newest look at them."""

    def __init__(self) -> None:
        self._judged: SiteJudgement | None = None
        self._heard: tuple[int, ...] = ()  # of each bus, as it was looked at
        self._looked = -EVERY

    def is_due(self, seats: Sequence[Seat]) -> bool:
        """Whether another look would say more."""
        if len(seats) < 2 or time.monotonic() - self._looked < EVERY:
            return False
        whole = all(not seat.is_still_read and seat.feed.store.ear is not None for seat in seats)
        return whole and self._heard != _heard(seats)

    def findings(self, seats: Sequence[Seat], here: int, own: Sequence[Finding], anew: bool) -> tuple[Finding, ...]:
        """Those of the site and those of the bus that is shown, the gravest first: what the site explains says so.
        `anew`: whether to look again."""
        if anew and self.is_due(seats):
            self._looked, self._heard = time.monotonic(), _heard(seats)
            self._judged = judged(_buses(seats))
        if self._judged is None:
            return tuple(own)
        site = {one.key for one in self._judged.findings}
        explained = {one.key: one for one in self._judged.buses[here] if one.cause in site}
        told = [*self._judged.findings, *(explained.get(one.key, one) for one in own)]
        return tuple(sorted(told, key=lambda one: -one.severity))


def _heard(seats: Sequence[Seat]) -> tuple[int, ...]:
    return tuple(seat.feed.store.heard for seat in seats)


def _buses(seats: Sequence[Seat]) -> list[SiteBus]:
    stores = [seat.feed.store for seat in seats]
    return [site_bus(store.model, store.ear) for store in stores if store.ear is not None]
