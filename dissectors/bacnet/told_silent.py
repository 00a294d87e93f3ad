"""Devices that were told to be silent (DeviceCommunicationControl; ASHRAE 135, 16.1): they answer nothing but that and
ReinitializeDevice until the time is up or they are told to speak again, and pass their tokens all the while."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from dissectors.bacnet import message as messages
from dissectors.bacnet import tags
from dissectors.bacnet.apdu import PduType
from dissectors.bacnet.message import Message
from dissectors.findings import Finding
from dissectors.frame import Event, Frame, Header
from dissectors.line import NS_PER_S
from dissectors.row_columns import RowColumns

KIND = "device-communication-control"
NO_ANSWER = "MS301"
KEPT = 256

_DURATION, _ORDER = 0, 1  # context tags
_ENABLE, _DISABLE = 0, 1


@dataclass(frozen=True, slots=True)
class _Order:
    """`by`: the MAC that it came from. `minutes`: for how long; None until another one. `since`, `until`: ns."""

    by: int
    silent: bool
    minutes: int | None
    since: int = 0
    until: int | None = None


class ToldSilent:
    """Fed row by row, or many at once; says of findings that a station does not answer where it was told so."""

    def __init__(self) -> None:
        self._asked: dict[tuple[int, int, int], _Order] = {}  # by station, client and invoke id
        self._silent: dict[int, _Order] = {}  # by station: the newest one to be silent that it acknowledged

    def see(self, no: int, event: Event, header: Header | None) -> None:
        """Take the next row."""
        if header is None or header.kind != KIND or not header.ok or not isinstance(event, Frame):
            return
        message = messages.read(event)
        if message is None or message.npdu is None or message.apdu is None or message.apdu.invoke_id is None:
            return
        if message.source is None or message.npdu.dnet is not None or message.npdu.snet is not None:
            return  # of a device behind a router
        invoke_id = message.apdu.invoke_id
        if message.apdu.type == PduType.CONFIRMED_REQUEST:
            order = _order_of(message, message.source)
            if order is not None and len(self._asked) < KEPT:
                self._asked[message.destination, message.source, invoke_id] = order
        elif message.apdu.type == PduType.SIMPLE_ACK:
            asked = self._asked.pop((message.source, message.destination, invoke_id), None)
            if asked is not None:
                self._obey(message.source, asked, event.end)

    def _obey(self, station: int, order: _Order, now: int) -> None:
        """A station has acknowledged an order."""
        if order.silent:
            until = None if order.minutes is None else now + order.minutes * 60 * NS_PER_S
            self._silent[station] = replace(order, since=now, until=until)
        elif station in self._silent:
            self._silent[station] = replace(self._silent[station], until=now)

    def take(self, rows: RowColumns) -> None:
        """Take many rows."""
        frames = rows.frames
        if KIND not in frames.names:
            return
        for place in (rows.good & (frames.kind == frames.names.index(KIND))).nonzero()[0].tolist():
            row = rows.row(place)
            self.see(row.no, row.event, row.header)

    def told(self, findings: Iterable[Finding]) -> Iterable[Finding]:
        """The same findings; of who was silent only from such an order on, the order is said."""
        for finding in findings:
            station = finding.about.station
            order = self._silent.get(station) if finding.code == NO_ANSWER and station is not None else None
            if order is not None and order.since <= finding.first and _is_within(finding, order):
                how_long = "until it is told otherwise" if order.minutes is None else f"for {order.minutes} min"
                yield replace(
                    finding,
                    seen=f"{finding.seen}, all after MAC {order.by} had told it to be silent {how_long}",
                    means="it was ordered so (DeviceCommunicationControl, disable): it takes part in the ring, and "
                    "answers nothing but another such order and ReinitializeDevice",
                    next="who sends that order, and why; tell it to speak again (enable), or restart it",
                )
            else:
                yield finding


def _is_within(finding: Finding, order: _Order) -> bool:
    return order.until is None or finding.last <= order.until


def _order_of(message: Message, by: int) -> _Order | None:
    """What a request orders; None where it does not say."""
    told = {tag.number: int.from_bytes(tag.octets, "big") for tag in tags.read(message.parameters).tags if tag.context}
    if told.get(_ORDER) not in (_ENABLE, _DISABLE):
        return None  # to begin nothing by itself is no silence
    return _Order(by, told[_ORDER] == _DISABLE, told.get(_DURATION))
