"""Answers that stations postponed and never sent."""

from __future__ import annotations

from collections.abc import Iterable

from dissectors.bacnet.findings_of_hearing import unheard_share
from dissectors.bacnet.ring import Ring
from dissectors.bacnet.rules import RULES
from dissectors.bacnet.unheard import TRUSTED
from dissectors.findings import Finding, Severity, Tally, counted
from dissectors.tracker import Transaction

LEAST_SHARE = 0.05
"""Of all that a station postponed; of less, the answers may not have been heard here."""

KEPT = 256


class BrokenPromises:
    """Fed every exchange that ended so (`exchange.Ending.NEVER_ANSWERED`)."""

    def __init__(self) -> None:
        self._broken: dict[int, Tally] = {}  # by station

    def add(self, station: int, transaction: Transaction) -> None:
        """An answer that the station postponed never came."""
        if station in self._broken or len(self._broken) < KEPT:
            self._broken.setdefault(station, Tally()).add(transaction.end, transaction.request)

    def findings(self, ring: Ring) -> Iterable[Finding]:
        """What was found so far."""
        least = max(LEAST_SHARE, TRUSTED * unheard_share(ring))
        for mac, tally in self._broken.items():
            node = ring.nodes.get(mac)
            postponed = max(tally.count, node.postponed if node is not None else 0)
            seen = f"never answered {tally.count} of {counted(postponed, 'request')} that it had postponed"
            few = tally.count == 1 or tally.count < least * postponed
            yield tally.found(RULES["MS311"], f"MAC {mac}", seen, Severity.NOTE if few else None)
