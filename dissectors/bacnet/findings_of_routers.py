"""Findings about routers: networks that they say they do not reach, and those that two of them lead to."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from dissectors.bacnet import message as messages
from dissectors.bacnet import npdu as npdus
from dissectors.findings import Finding, Rule, Severity, Tally, counted, together
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
    Rule(
        "MS310",
        Severity.WARNING,
        "two ways to one network",
        "Two routers on this bus say in turns that they lead to the same network (I-Am-Router-To-Network; ASHRAE 135, "
        "6.4.2). One after the other is only noted: a router may have been replaced.",
        "two networks have one number, or the routers make a loop: broadcasts go round, and answers come another way",
        "network numbers of the routers named; whether two of them join the same networks",
    ),
)

REJECTS, LEADS = "reject-message-to-network", "i-am-router-to-network"
KEPT = 256
"""Most routers, networks and reasons that are counted apart."""

_REJECTS, _LEADS = 3, 1


_NOT_REACHED, _TWO_WAYS = ROUTER_RULES


@dataclass(slots=True)
class _Ways:
    """Which routers lead to a network. `in_turns`: one of them said it again after another one had."""

    by: dict[int, Tally] = field(default_factory=dict)
    newest: int | None = None
    in_turns: bool = False

    def add(self, router: int, no: int, frame: Frame) -> None:
        self.in_turns = self.in_turns or (router in self.by and router != self.newest)
        self.newest = router
        self.by.setdefault(router, Tally()).add(frame.end, no)


class RouterFindings:
    """Fed row by row, or many at once; gives findings at any time."""

    def __init__(self) -> None:
        self._rejected: dict[tuple[int, int, int], Tally] = {}  # by router, network and reason
        self._ways: dict[int, _Ways] = {}  # by network

    def see(self, no: int, event: Event, header: Header | None) -> None:
        """Take the next row."""
        if header is None or header.kind not in (REJECTS, LEADS) or not header.ok or not isinstance(event, Frame):
            return
        message = messages.read(event)
        if message is None or message.npdu is None or message.source is None:
            return
        npdu, payload = message.npdu, message.data[message.npdu.body :]
        if npdu.message == _REJECTS and len(payload) >= 3:
            key = message.source, payload[1] << 8 | payload[2], payload[0]
            if key in self._rejected or len(self._rejected) < KEPT:
                self._rejected.setdefault(key, Tally()).add(event.end, no)
        elif npdu.message == _LEADS and npdu.snet is None:
            for network in npdus.networks(npdu, message.data):
                if network in self._ways or len(self._ways) < KEPT:
                    self._ways.setdefault(network, _Ways()).add(message.source, no, event)

    def take(self, rows: RowColumns) -> None:
        """Take many rows."""
        frames = rows.frames
        codes = [frames.names.index(kind) for kind in (REJECTS, LEADS) if kind in frames.names]
        if not codes:
            return
        some = frames.kind == codes[0]
        for code in codes[1:]:
            some = some | (frames.kind == code)
        for place in (rows.good & some).nonzero()[0].tolist():
            row = rows.row(place)
            self.see(row.no, row.event, row.header)

    def findings(self) -> Iterable[Finding]:
        """What was found so far."""
        for (router, network, reason), tally in self._rejected.items():
            why = npdus.REJECTIONS.get(reason, f"reason {reason}")
            seen = f"MAC {router} rejected {counted(tally.count, 'message')} to network {network}: {why}"
            yield tally.found(_NOT_REACHED, "bus", seen, Severity.NOTE if tally.count == 1 else None)
        for network, ways in self._ways.items():
            if len(ways.by) > 1:
                seen = f"MAC {' and '.join(map(str, sorted(ways.by)))} say that they lead to network {network}"
                severity = None if ways.in_turns else Severity.NOTE
                yield together(ways.by.values()).found(_TWO_WAYS, "bus", seen, severity)
