"""The quick look at an MS/TP frame: one pass over its octets, no tree. What it needs of the APDU it reads in place."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

from dissectors.bacnet import names
from dissectors.bacnet import npdu as npdus
from dissectors.bacnet import tags as tagging
from dissectors.bacnet.frame_types import CARRIES_NPDU, HEADER, PROPRIETARY, FrameType, name
from dissectors.bacnet.limits import BROADCAST
from dissectors.bacnet.message import data_of
from dissectors.frame import Check, Damage, Frame, Header, Repair, Role

DAMAGE_WORDS: dict[Damage, str] = {
    Damage.CHECK: "data CRC",
    Damage.SHORT: "cut short",
    Damage.LONG: "longer than the standard allows",
    Damage.HEADER: "header CRC",
    Damage.FORM: "too short for an encoded frame",
    Damage.TIMEOUT: "silence inside",
    Damage.RESTARTED: "cut by the next frame",
}

_ROLES: dict[int, Role] = {
    FrameType.TOKEN: Role.TOKEN,
    FrameType.POLL_FOR_MASTER: Role.POLL,
    FrameType.REPLY_TO_POLL_FOR_MASTER: Role.RESPONSE,
    FrameType.TEST_REQUEST: Role.REQUEST,
    FrameType.TEST_RESPONSE: Role.RESPONSE,
    FrameType.DATA_EXPECTING_REPLY: Role.REQUEST,
    FrameType.DATA_NOT_EXPECTING_REPLY: Role.DATA,
    FrameType.REPLY_POSTPONED: Role.RESPONSE,
    FrameType.EXTENDED_DATA_EXPECTING_REPLY: Role.REQUEST,
    FrameType.EXTENDED_DATA_NOT_EXPECTING_REPLY: Role.DATA,
    FrameType.IPV6: Role.DATA,
}

_ERROR_PDU, _REJECT, _ABORT = 5, 6, 7
_ANSWERS = frozenset({2, 3, _ERROR_PDU, _REJECT})


def peek(frame: Frame) -> Header:
    """What the frame is, from whom, to whom. `function` is the frame type, `address` the object's instance.

    `kind` is the frame type's name, for data the service's or network message's name. Total.
    """
    octets = frame.octets
    if frame.repair is not None:
        return _of_mended(frame, frame.repair)
    if len(octets) < 4:
        return Header("mstp", None, None, Role.UNKNOWN, "fragment", ok=False, error=_why(frame))
    frame_type, destination = octets[2], octets[3]
    if frame_type not in CARRIES_NPDU and frame.damage is None and frame.check is Check.GOOD:
        return _of_good(frame_type, destination, octets[4])
    source = octets[4] if len(octets) > 4 else None
    kind = name(frame_type)
    if frame_type in CARRIES_NPDU and frame.check is Check.GOOD:
        return _data(frame, frame_type, destination, source, kind)
    ok = frame.ok
    role = _role(frame_type, destination)
    return Header("mstp", source, destination, role, kind, frame_type, None, None, ok, None if ok else _why(frame))


def _of_mended(frame: Frame, repair: Repair) -> Header:
    """What a damaged frame said, and what is wrong with it."""
    said = peek(replace(frame, octets=repair.octets, check=Check.GOOD, damage=None, repair=None))
    return replace(said, ok=False, error=repair.flaw.value)


@lru_cache(maxsize=4096)
def _of_good(frame_type: int, destination: int, source: int) -> Header:
    """A good frame whose header says all of it: tokens and polls, which are nearly every frame of a bus."""
    return Header("mstp", source, destination, _role(frame_type, destination), name(frame_type), frame_type)


def _role(frame_type: int, destination: int) -> Role:
    role = _ROLES.get(frame_type)
    if role is None:
        role = Role.DATA if frame_type >= PROPRIETARY else Role.UNKNOWN
    if destination == BROADCAST and role in (Role.DATA, Role.REQUEST):
        role = Role.BROADCAST
    return role


def _why(frame: Frame) -> str:
    if frame.damage is not None:
        return DAMAGE_WORDS[frame.damage]
    return "check"


def _data(frame: Frame, frame_type: int, destination: int, source: int | None, kind: str) -> Header:
    """A good frame that carries an NPDU."""
    role = Role.BROADCAST if destination == BROADCAST else _ROLES[frame_type]
    error = None if frame.damage is None else _why(frame)
    address = None
    data = data_of(frame.octets)
    at = -1
    if not data:
        error = error or ("not decodable" if data is None else "no data")
    elif len(data) < 2 or data[0] != npdus.VERSION:
        error = error or "no BACnet version 1"
    elif data[1] & (npdus.NETWORK_MESSAGE | npdus.HAS_DESTINATION | npdus.HAS_SOURCE):
        npdu = npdus.decode(data)
        if npdu is None or npdu.error is not None:
            error = error or "network header cut"
        elif npdu.message is not None:
            kind = npdus.message_name(npdu.message)
            if npdu.message == 3 and len(data) > npdu.body:
                error = error or npdus.REJECTIONS.get(data[npdu.body], f"reason {data[npdu.body]}")
        else:
            at = npdu.body
    else:
        at = 2
    if data and at >= 0:
        kind, role, address, said = _apdu(data, at, frame_type, role, kind)
        error = error or said
    return Header("mstp", source, destination, role, kind, frame_type, address, None, frame.ok, error)


def _apdu(data: bytes, at: int, frame_type: int, role: Role, kind: str) -> tuple[str, Role, int | None, str | None]:
    """(kind, role, object instance, error) of the APDU at `at`."""
    size = len(data)
    if at >= size:
        return kind, role, None, "no APDU"
    first = data[at]
    pdu = first >> 4
    segmented = pdu in (0, 3) and bool(first & 8)
    if pdu == 0:
        service_at = at + (5 if segmented else 3)
    elif pdu == 3:
        service_at = at + (4 if segmented else 2)
    elif pdu in (2, _ERROR_PDU):
        service_at = at + 2
    elif pdu == 1:
        service_at = at + 1
    else:
        return _without_service(data, at, pdu, role, kind)
    if service_at >= size:
        return kind, role, None, "APDU header cut"
    service = data[service_at]
    table = names.UNCONFIRMED if pdu == 1 else names.CONFIRMED
    kind = table.get(service) or f"service-{service}"
    if role is not Role.BROADCAST:
        if pdu in _ANSWERS:
            role = Role.RESPONSE
        elif pdu == 1:  # nobody answers it, whatever the frame type says
            role = Role.DATA
        elif pdu == 0:
            role = Role.REQUEST
    if pdu == _ERROR_PDU:
        return kind, role, None, error_text(data, service_at + 1)
    if segmented and data[at + 2 + (pdu == 0)]:  # only the first segment begins with the first parameter
        return kind, role, None, None
    return kind, role, _instance(data, service_at + 1), None


def _without_service(data: bytes, at: int, pdu: int, role: Role, kind: str) -> tuple[str, Role, int | None, str | None]:
    if pdu > 7:
        return kind, role, None, f"reserved PDU type {pdu}"
    kind = {4: "segment-ack", _REJECT: "reject"}.get(pdu, "abort")
    if at + 2 >= len(data):
        return kind, role, None, "APDU header cut"
    if role is not Role.BROADCAST:
        role = Role.RESPONSE if pdu == _REJECT or data[at] & 1 else Role.DATA
    reason = data[at + 2]
    if pdu == _REJECT:
        return kind, role, None, f"reject {names.name('RejectReason', reason)}"
    if pdu == _ABORT:
        return kind, role, None, f"abort {names.name('AbortReason', reason)}"
    return kind, role, None, None


def _instance(data: bytes, at: int) -> int | None:
    """Instance of the object that the parameters name first (the monitored one in COV notifications).

    An object and a process id of four octets look alike; only behind a process id stands another object.
    """
    size = len(data)
    if at >= size:
        return None
    if data[at] in (0x0C, 0xC4) and at + 5 <= size and data[at : at + 6 : 5] != b"\x0c\x1c":
        return int.from_bytes(data[at + 1 : at + 5], "big") & 0x3FFFFF
    if data[at] & 0xF8 == 0x08 and data[at] & 7 <= 4:  # a process id first
        at += 1 + (data[at] & 7)
        found = None
        for tag in (0x1C, 0x2C):
            if at + 5 <= size and data[at] == tag:
                found = int.from_bytes(data[at + 1 : at + 5], "big") & 0x3FFFFF
                at += 5
        return found
    return None


_ENUMERATES = frozenset(((False, 9), (False, 2), (True, 0), (True, 1)))
"""Tags under which class and code are sent, the right one first: whether it is a context tag, and its number."""


def error_text(data: bytes, at: int) -> str:
    """Class and code of an Error-PDU whose parameters begin at `at`: "object unknown-object"."""
    if at < len(data) and data[at] == 0x0E:
        at += 1
    elif at < len(data) and data[at] == 0x1E:  # SubscribeCOVPropertyMultiple names what failed instead
        return "one subscription failed"
    words = []
    for enumeration in ("ErrorClass", "ErrorCode"):
        tag = tagging.header_at(data, at)
        if isinstance(tag, str) or (tag.context, tag.number) not in _ENUMERATES or not 1 <= tag.end - tag.begin <= 8:
            return "error without class and code"
        words.append(names.name(enumeration, int.from_bytes(data[tag.begin : tag.end], "big")))
        at = tag.end
    return " ".join(words)


def is_whole_header(frame: Frame) -> bool:
    """Whether it is certain what its header says: its CRC is good, or it could be put right."""
    return frame.repair is not None or (len(frame.octets) >= HEADER and frame.damage is not Damage.HEADER)
