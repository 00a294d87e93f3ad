"""BACnet/IP: the network layer of MS/TP in UDP datagrams. Each datagram with an NPDU has a twin on an MS/TP bus, whose
stations are the last octets of the addresses; what it says is what its twin says. Pairing is by ends and invoke number.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from ipaddress import IPv4Address
from typing import Any

from dissectors.bacnet.envelope import npdu_frame
from dissectors.bacnet.fields import fields as mstp_fields
from dissectors.bacnet.header import peek as peek_mstp
from dissectors.bacnet.ip_framing import ENDS, IP_NAME
from dissectors.bacnet.ip_functions import FUNCTIONS, function_fields, function_text, function_types
from dissectors.bacnet.message import read
from dissectors.bacnet.readings import asks as mstp_asks
from dissectors.bacnet.readings import readings as mstp_readings
from dissectors.bacnet.text import meant as mstp_meant
from dissectors.bacnet.text import text as mstp_text
from dissectors.field_types import FieldType, FieldTypes, Kind
from dissectors.frame import Check, Event, Frame, Header, Role
from dissectors.line import NS_PER_S, Timing
from dissectors.meaning import Meaning
from dissectors.numbered_exchanges import NumberedExchanges
from dissectors.readings import Reading
from dissectors.tracker import NOTHING_TRACKED, Placement, Tracked, Transaction, Verdict

_NPDU_AT = {0x04: 10, 0x09: 4, 0x0A: 4, 0x0B: 4}
_BROADCASTS = (0x04, 0x09, 0x0B)
EVERYBODY = 255
PATIENCE = 60 * NS_PER_S
"""ns that an answer may take: a router waits for the token of its bus, and devices ask again themselves."""
MOST_OPEN = 4096

Fields = dict[str, int | float | str]


@lru_cache(maxsize=4096)
def twin(frame: Frame) -> Frame | None:
    """The MS/TP frame with the same NPDU; None where there is no NPDU, or not all of it came."""
    octets = frame.octets
    at = _NPDU_AT.get(octets[ENDS + 1]) if len(octets) > ENDS + 4 else None
    if at is None or not frame.ok or len(octets) < ENDS + at + 2:
        return None
    npdu = octets[ENDS + at :]
    source, destination = ends(frame)
    if octets[ENDS + 1] == 0x04:
        source = octets[ENDS + 7]  # of the device whose broadcast a router passes on
    made = npdu_frame(destination, source, npdu, bool(npdu[1] & 4))
    return replace(frame, protocol="mstp", octets=made, check=Check.GOOD, expected=None)


def ends(frame: Frame) -> tuple[int, int]:
    """Source and destination as stations."""
    octets = frame.octets.ljust(ENDS, b"\0")
    function = octets[ENDS + 1] if len(octets) > ENDS + 1 else None
    return octets[3], EVERYBODY if function in _BROADCASTS else octets[9]


def peek_ip(frame: Frame) -> Header:
    """The header of a frame. Total."""
    same = twin(frame)
    if same is not None:
        return replace(peek_mstp(same), protocol=IP_NAME)
    source, destination = ends(frame)
    kind = FUNCTIONS.get(frame.octets[ENDS + 1], "unknown function") if len(frame.octets) > ENDS + 1 else "nothing"
    error = None if frame.ok else "datagram cut short"
    return Header(
        IP_NAME, source, destination, Role.DATA if frame.ok else Role.UNKNOWN, kind.replace(" ", "-").lower(),
        ok=frame.ok, error=error,
    )  # fmt: skip


def ip_text(frame: Frame, header: Header, role: Role) -> str:
    """One line about a frame. Total."""
    same = twin(frame)
    if same is not None:
        return f"{mstp_text(same, header, role)}{_behind(frame)}"
    error = f" [{header.error}]" if header.error else ""
    whole = frame.ok and len(frame.octets) >= ENDS + 4
    says = function_text(frame.octets[ENDS + 1], frame.octets[ENDS + 4 :]) if whole else ""
    return f"{header.source} → {header.destination} {header.kind.replace('-', ' ')}{says}{error}{_behind(frame)}"


def ip_meant(frame: Frame, header: Header, role: Role, meaning: Meaning) -> str:
    """The same, what it means to its device first. Total."""
    same = twin(frame)
    if same is None:
        return ip_text(frame, header, role)
    return f"{mstp_meant(same, header, role, meaning)}{_behind(frame)}"


def _behind(frame: Frame) -> str:
    """Who speaks to whom in full."""
    octets = frame.octets
    return f"  {IPv4Address(octets[:4])} → {IPv4Address(octets[6:10])}" if len(octets) >= ENDS else ""


def ip_fields(frame: Frame, role: Role) -> Fields:
    """Its fields in frame order, under Wireshark's names. Total."""
    octets, found = frame.octets, Fields()
    if len(octets) >= ENDS:
        found["ip.src"], found["ip.dst"] = str(IPv4Address(octets[:4])), str(IPv4Address(octets[6:10]))
    for name, begin, end in (("type", 0, 1), ("function", 1, 2), ("length", 2, 4)):
        if len(octets) >= ENDS + end:
            found[f"bvlc.{name}"] = int.from_bytes(octets[ENDS + begin : ENDS + end], "big")
    if len(octets) > ENDS + 4:
        found |= function_fields(octets[ENDS + 1], octets[ENDS + 4 :])
    same = twin(frame)
    told = mstp_fields(same, role) if same is not None else {}
    return found | {name: value for name, value in told.items() if not name.startswith("mstp.")}


def ip_types() -> FieldTypes:
    """The types of its fields, by name."""
    from dissectors.bacnet.field_types import types

    return {
        "ip.src": FieldType(Kind.TEXT, "address of who sends"),
        "ip.dst": FieldType(Kind.TEXT, "address of who is spoken to"),
        "bvlc.type": FieldType(Kind.NUMBER, "81 for IP"),
        "bvlc.function": FieldType(Kind.NUMBER, "what it is", {name: code for code, name in FUNCTIONS.items()}),
        "bvlc.length": FieldType(Kind.NUMBER, "octets of the datagram"),
        **function_types(),
        **{name: kind for name, kind in types().items() if not name.startswith("mstp.")},
    }


def ip_readings(request: Frame | None, response: Frame | None) -> tuple[Reading, ...]:
    """See `dissectors.readings.Readings`."""
    first = None if request is None else twin(request)
    second = None if response is None else twin(response)
    if (request is not None and first is None) or (response is not None and second is None):
        return ()
    return mstp_readings(first, second)


def ip_asks(frame: Frame) -> tuple[Reading, ...]:
    """See `dissectors.readings.Asks`."""
    same = twin(frame)
    return () if same is None else mstp_asks(same)


def ip_bits(frame: Frame) -> float:
    """Evidence of a whole frame: type, function and length of a datagram, which does not begin behind something."""
    return 24.0 if frame.ok and not frame.skipped else 0.0


def ip_packet(frame: Frame, role: Role) -> Any:
    """The scapy packet. Never raises."""
    from scapy.packet import Raw

    from dissectors.bacnet.ip_packets import dissect

    return dissect(frame) if len(frame.octets) > ENDS + 4 else Raw(frame.octets)


# -- pairing ---------------------------------------------------------------------------------------------------


class IpTracker:
    """The tracker of one network: a confirmed request is answered under its invoke number."""

    def __init__(self, timing: Timing) -> None:
        self._exchanges = NumberedExchanges(PATIENCE + timing.latency, MOST_OPEN)

    def track(self, no: int, event: Event, header: Header | None) -> Tracked:
        """Take the next event."""
        if header is None or not isinstance(event, Frame):
            return NOTHING_TRACKED
        before = self.advance(event.start)
        same = twin(event)
        message = read(same) if same is not None else None
        apdu = message.apdu if message is not None else None
        if apdu is not None and apdu.invoke_id is not None and not apdu.sequence:
            here, there = event.octets[:6], event.octets[6:12]
            if apdu.is_request:  # by who asks, who is asked, and the number
                tx, over = self._exchanges.ask((here, there, apdu.invoke_id), no, event, header)
                return Tracked(Placement(no, tx, Role.REQUEST, header.source, header.destination), before + over)
            if apdu.is_answer and apdu.service is not None:
                refused = Verdict.EXCEPTION if header.error else None
                closed = self._exchanges.answer((there, here, apdu.invoke_id), no, event, header, refused)
                placed = Placement(no, closed.id, Role.RESPONSE, header.source, header.destination)
                return Tracked(placed, (*before, closed))
        verdict = Verdict.BROADCAST if header.role is Role.BROADCAST else Verdict.DATA
        closed = self._exchanges.alone(no, event, header, verdict)
        placed = Placement(no, closed.id, header.role, header.source, header.destination)
        return Tracked(placed, (*before, closed))

    def advance(self, now: int) -> tuple[Transaction, ...]:
        """Say that nothing came up to `now` (ns)."""
        return self._exchanges.advance(now)

    def close(self) -> tuple[Transaction, ...]:
        """End of capture: answers could still have come."""
        return self._exchanges.close()


def make_ip(source: bytes, destination: bytes, function: int, npdu: bytes) -> bytes:
    """The frame of two ends (address and port, six octets each), a function and an NPDU."""
    return source + destination + bytes((0x81, function)) + (4 + len(npdu)).to_bytes(2, "big") + npdu
