"""Findings about networks that routers say they do not reach."""

from __future__ import annotations

from collections.abc import Iterable

from dissectors.bacnet import message as messages
from dissectors.bacnet import npdu as npdus
from dissectors.findings import Finding, Rule, Severity, Tally, counted
from dissectors.frame import Event, Frame, Header
from dissectors.row_columns import RowColumns

ROUTER_RULES = (
    Rule(
        "MS309",
        Severity.WARNING,
        "network that is not reached",
        "A router sends Reject-Message-To-Network (ASHRAE 135, 6.4.4): a message for that network went no further. A "
        "single one is only noted.",
        "somebody asks for stations of a network that is not there, is called by another number, or whose router is "
        "off; every such request waits in vain",
        "network numbers in the clients and in the routers; whether the router to that network is on",
    ),
)

REJECTS = "reject-message-to-network"
KEPT = 256
"""Most routers, networks and reasons that are counted apart."""

_MESSAGE = 3


class NetworkRejections:
    """Fed row by row, or many at once; gives findings at any time."""

    def __init__(self) -> None:
        self._seen: dict[tuple[int, int, int], Tally] = {}  # by router, network and reason

    def see(self, no: int, event: Event, header: Header | None) -> None:
        """Take the next row."""
        if header is None or header.kind != REJECTS or not header.ok or not isinstance(event, Frame):
            return
        message = messages.read(event)
        if message is None or message.npdu is None or message.npdu.message != _MESSAGE or message.source is None:
            return
        payload = message.data[message.npdu.body :]
        if len(payload) < 3:
            return
        key = message.source, payload[1] << 8 | payload[2], payload[0]
        if key in self._seen or len(self._seen) < KEPT:
            self._seen.setdefault(key, Tally()).add(event.end, no)

    def take(self, rows: RowColumns) -> None:
        """Take many rows."""
        frames = rows.frames
        if REJECTS not in frames.names:
            return
        for place in (rows.good & (frames.kind == frames.names.index(REJECTS))).nonzero()[0].tolist():
            row = rows.row(place)
            self.see(row.no, row.event, row.header)

    def findings(self) -> Iterable[Finding]:
        """What was found so far."""
        for (router, network, reason), tally in self._seen.items():
            why = npdus.REJECTIONS.get(reason, f"reason {reason}")
            seen = f"MAC {router} rejected {counted(tally.count, 'message')} to network {network}: {why}"
            yield tally.found(ROUTER_RULES[0], "bus", seen, Severity.NOTE if tally.count == 1 else None)
