"""Device instances that two stations say they have (I-Am): a client that looks for a device by its number finds one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from dissectors.bacnet import message as messages
from dissectors.bacnet.ring import RingNode
from dissectors.bacnet.rules import RULES
from dissectors.bacnet.station_address import remote
from dissectors.bacnet.values import ObjectId
from dissectors.findings import Finding, Severity, Tally, together
from dissectors.frame import Event, Frame, Header
from dissectors.row_columns import RowColumns

I_AM = "i-am"
UNCONFIGURED = 0x3FFFFF
"""What a device says that has no number yet (ASHRAE 135, 12)."""

KEPT = 4096
"""Most pairs of an instance and an address that are known."""

_TOLD = 3
_OBJECT_TAG = b"\xc4"


@dataclass(frozen=True, slots=True)
class _Party:
    """Who said it: the station on this bus, or the one behind a router that `net` and `address` name."""

    mac: int
    net: int | None = None
    address: bytes = b""

    @property
    def words(self) -> str:
        return f"MAC {self.mac}" if self.net is None else remote(self.net, self.address)

    def may_be(self, other: _Party) -> bool:
        """Whether one of them may be the other: routers that make a loop show a station under several networks."""
        if self.net is not None and other.net is not None:
            return self.address == other.address
        here, there = (self, other) if self.net is None else (other, self)
        return there.net is not None and there.address == bytes((here.mac,))


@dataclass(slots=True)
class _Said:
    """All that said one instance. `in_turns`: somebody said it again after another one had."""

    by: dict[_Party, Tally] = field(default_factory=dict)
    newest: _Party | None = None
    in_turns: bool = False


class DeviceInstances:
    """Fed row by row, or many at once; gives findings at any time."""

    def __init__(self) -> None:
        self._said: dict[int, _Said] = {}
        self._kept = 0

    def see(self, no: int, event: Event, header: Header | None) -> None:
        """Take the next row."""
        if header is None or header.kind != I_AM or not header.ok or not isinstance(event, Frame):
            return
        message = messages.read(event)
        if message is None or message.npdu is None or message.source is None or message.apdu is None:
            return
        if message.parameters[:1] != _OBJECT_TAG or len(message.parameters) < 5:
            return
        instance = ObjectId.unpack(message.parameters[1:5]).instance
        npdu = message.npdu
        remotely = npdu.snet is not None
        party = _Party(-1 if remotely else message.source, npdu.snet, (npdu.sadr or b"") if remotely else b"")
        if instance != UNCONFIGURED:
            self._say(instance, party, no, event)

    def _say(self, instance: int, party: _Party, no: int, frame: Frame) -> None:
        known = self._said.get(instance)
        if known is None or party not in known.by:
            if self._kept >= KEPT:
                return
            self._kept += 1
            known = self._said.setdefault(instance, _Said())
        known.in_turns = known.in_turns or (known.newest != party and party in known.by)
        known.newest = party
        known.by.setdefault(party, Tally()).add(frame.end, no)

    def take(self, rows: RowColumns) -> None:
        """Take many rows."""
        frames = rows.frames
        if I_AM not in frames.names:
            return
        for place in (rows.good & (frames.kind == frames.names.index(I_AM))).nonzero()[0].tolist():
            row = rows.row(place)
            self.see(row.no, row.event, row.header)

    def findings(self, nodes: Mapping[int, RingNode]) -> Iterable[Finding]:
        """What was found so far. `nodes`: of the ring, when stations were heard last."""
        twice = [(instance, said) for instance, said in sorted(self._said.items()) if _are_several(said)]
        sure = [one for one in twice if _are_both_there(one[1], nodes)]
        for some, severity in ((sure, None), ([one for one in twice if one not in sure], Severity.NOTE)):
            if some:
                yield _found(some, severity)


def _are_several(said: _Said) -> bool:
    parties = list(said.by)
    return any(not one.may_be(other) for at, one in enumerate(parties) for other in parties[at + 1 :])


def _are_both_there(said: _Said, nodes: Mapping[int, RingNode]) -> bool:
    """Whether no device has only changed its address: both say it in turns, or the one goes on when the other has."""
    if said.in_turns:
        return True
    newest = max(tally.first for tally in said.by.values())
    return all(
        party.net is None and party.mac in nodes and nodes[party.mac].last > newest
        for party, tally in said.by.items()
        if tally.first < newest
    )


def _found(some: list[tuple[int, _Said]], severity: Severity | None) -> Finding:
    words = [f"{' and '.join(party.words for party in said.by)} as device {instance}" for instance, said in some]
    more = f"; and {len(words) - _TOLD} more" if len(words) > _TOLD else ""
    after = ", one after the other" if severity is not None else ""
    seen = f"I-Am of {'; of '.join(words[:_TOLD])}{more}{after}"
    tally = together(tally for _, said in some for tally in said.by.values())
    return tally.found(RULES["MS502"], "bus", seen, severity)
