"""Findings about routers: networks that they do not reach, those that two lead to, and the number of this one."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from dissectors.bacnet import message as messages
from dissectors.bacnet import npdu as npdus
from dissectors.bacnet.frame_types import HEADER, FrameType
from dissectors.findings import Finding, Rule, Severity, Tally, counted, together
from dissectors.frame import Event, Frame, Header
from dissectors.row_columns import RowColumns

if TYPE_CHECKING:
    from dissectors.columns import Times

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
        "6.4.2), or pass on messages from there in turns: there is one way between two networks (6.2). One after the "
        "other is only noted: a router may have been replaced.",
        "two networks have one number, or the routers make a loop: broadcasts go round, and answers come another way",
        "network numbers of the routers named; whether two of them join the same networks",
    ),
    Rule(
        "MS314",
        Severity.WARNING,
        "two numbers of this network",
        "Two stations on this bus say that this network has another number, each as it was configured "
        "(Network-Number-Is; ASHRAE 135, 6.4.20).",
        "one of them is set to the number of another network: what is sent to this network by number comes here by one "
        "way, and its answers go another, or nowhere",
        "the number of this port in each of the routers named",
    ),
)

REJECTS, LEADS, NUMBERED = "reject-message-to-network", "i-am-router-to-network", "network-number-is"
KEPT = 256
"""Most routers, networks and reasons that are counted apart."""

_REJECTS, _LEADS, _NUMBERED = 3, 1, 0x13
_CONFIGURED = 1
_PLAIN = (int(FrameType.DATA_EXPECTING_REPLY), int(FrameType.DATA_NOT_EXPECTING_REPLY))
_CONTROL = HEADER + 1
_CRC = 2
_ADDRESS = 3  # octets of a network number and the length of the address that follows

_NOT_REACHED, _TWO_WAYS, _TWO_NUMBERS = ROUTER_RULES


@dataclass(slots=True)
class _Ways:
    """Which routers lead to a network. `in_turns`: one of them did again after another one had."""

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
        self._ways: dict[int, _Ways] = {}  # by network, of those that say so
        self._carries: dict[int, _Ways] = {}  # by network, of those that pass on what comes from there: each turn once
        self._numbers: dict[int, dict[int, Tally]] = {}  # by number of this network, who says so

    def see(self, no: int, event: Event, header: Header | None) -> None:
        """Take the next row."""
        if header is None or not header.ok or not isinstance(event, Frame):
            return
        network = _source_network(event.octets)
        if network is not None:
            self._carry(network, event.octets[4], no, event)
        if header.kind in (REJECTS, LEADS, NUMBERED):
            self._see_message(no, event)

    def _carry(self, network: int, router: int, no: int, frame: Frame) -> None:
        """A message from a network comes through a router; what goes on as before says nothing new."""
        if network not in self._carries and len(self._carries) >= KEPT:
            return
        ways = self._carries.setdefault(network, _Ways())
        if ways.newest != router:
            ways.add(router, no, frame)

    def _see_message(self, no: int, event: Frame) -> None:
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
        elif npdu.message == _NUMBERED and npdu.snet is None and payload[2:3] == bytes((_CONFIGURED,)):
            number = payload[0] << 8 | payload[1]
            if number in self._numbers or len(self._numbers) < KEPT:
                self._numbers.setdefault(number, {}).setdefault(message.source, Tally()).add(event.end, no)

    def take(self, rows: RowColumns) -> None:
        """Take many rows."""
        import numpy as np

        frames = rows.frames
        codes = [frames.names.index(kind) for kind in (REJECTS, LEADS, NUMBERED) if kind in frames.names]
        told = np.flatnonzero(rows.good & np.isin(frames.kind, codes)) if codes else np.zeros(0, np.int64)
        for place in np.union1d(told, self._turns(rows)).tolist():
            row = rows.row(place)
            self.see(row.no, row.event, row.header)

    def _turns(self, rows: RowColumns) -> Times:
        """Places of rows that come from a network by another router than what came from there before."""
        import numpy as np

        places, networks = _source_networks(rows)
        order = np.argsort(networks, kind="stable")
        places, networks = places[order], networks[order]
        routers = rows.frames.source[places].astype(np.int64)
        before = np.full(len(places), -1, np.int64)
        before[1:] = np.where(networks[1:] == networks[:-1], routers[:-1], -1)
        for place in np.flatnonzero(before < 0).tolist():
            known = self._carries.get(int(networks[place]))
            if known is not None and known.newest is not None:
                before[place] = known.newest
        found: Times = places[before != routers]
        return found

    def findings(self) -> Iterable[Finding]:
        """What was found so far."""
        for (router, network, reason), tally in self._rejected.items():
            why = npdus.REJECTIONS.get(reason, f"reason {reason}")
            seen = f"MAC {router} rejected {counted(tally.count, 'message')} to network {network}: {why}"
            yield tally.found(_NOT_REACHED, "bus", seen, Severity.NOTE if tally.count == 1 else None)
        for network in dict.fromkeys((*self._ways, *self._carries)):
            yield from self._two_ways(network)
        if len(self._numbers) > 1:
            said = [f"MAC {_names(by)} that it is {number}" for number, by in sorted(self._numbers.items())]
            tallies = together(tally for by in self._numbers.values() for tally in by.values())
            yield tallies.found(_TWO_NUMBERS, "bus", f"of the number of this network say {', '.join(said)}")

    def _two_ways(self, network: int) -> Iterable[Finding]:
        told = (
            (self._ways.get(network, _Ways()), f"say that they lead to network {network}"),
            (self._carries.get(network, _Ways()), f"pass on messages from network {network}"),
        )
        several = [(ways, words) for ways, words in told if len(ways.by) > 1]
        if several:
            seen = "; ".join(f"MAC {_names(ways.by)} {words}" for ways, words in several)
            severity = None if any(ways.in_turns for ways, _ in several) else Severity.NOTE
            tally = together(tally for ways, _ in several for tally in ways.by.values())
            yield tally.found(_TWO_WAYS, "bus", seen, severity)


def _names(macs: Iterable[int]) -> str:
    return " and ".join(map(str, sorted(macs)))


def _source_network(octets: bytes) -> int | None:
    """The network behind a router from which a frame comes; None where it comes from none, or is encoded."""
    if octets[2] not in _PLAIN or len(octets) < _CONTROL + 3 or octets[HEADER] != npdus.VERSION:
        return None
    control, at = octets[_CONTROL], _CONTROL + 1
    if not control & npdus.HAS_SOURCE:
        return None
    if control & npdus.HAS_DESTINATION:
        at += _ADDRESS + octets[min(at + 2, len(octets) - 1)]
    return octets[at] << 8 | octets[at + 1] if at + _ADDRESS + _CRC <= len(octets) else None


def _source_networks(rows: RowColumns) -> tuple[Times, Times]:
    """The same of many: places of rows that come from one, and which."""
    import numpy as np

    frames, octets = rows.frames, rows.octets
    plain = rows.good & np.isin(frames.function, _PLAIN) & (frames.length >= _CONTROL + 3)
    places = np.flatnonzero(plain)
    begin, size = frames.offset[places].astype(np.int64), frames.length[places].astype(np.int64)
    control = octets[begin + _CONTROL]
    some = (octets[begin + HEADER] == npdus.VERSION) & (control & npdus.HAS_SOURCE != 0)
    places, begin, size, control = places[some], begin[some], size[some], control[some]
    at = np.full(len(places), _CONTROL + 1, np.int64)
    routed = control & npdus.HAS_DESTINATION != 0
    length = octets[begin + np.minimum(at + 2, size - 1)].astype(np.int64)
    at += np.where(routed, _ADDRESS + length, 0)
    whole = at + _ADDRESS + _CRC <= size
    places, begin, at = places[whole], begin[whole], at[whole]
    network: Times = octets[begin + at].astype(np.int64) << 8 | octets[begin + at + 1]
    return places, network
