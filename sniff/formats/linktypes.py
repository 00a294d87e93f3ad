"""Link types of pcap records: how a frame is written into it and read out of it. Pure.

165  A link type of a protocol's own: the frame as it is; Wireshark reads it without set-up.
257  Another one's; read, and written where it is asked for.
147  User 0: the bare frame; Wireshark needs a DLT_USER entry.
250  RTAC Serial: a 12-octet header with an event, then the frame; line errors are events without octets.
252  Exported PDU: tags that name the dissector and synthetic addresses, then the frame; no set-up.
148  User 1: in our files, octets that are no frame (noise, damaged pieces), so that a file keeps every octet.
149 … 162  User 2 … 15: others' bare frames; read only.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from dissectors import registry
from dissectors.frame import Frame, LineError, Role
from dissectors.manifest import Dissector, PacketFile

OWN, USER0, USER1, RTAC, EXPORTED = 165, 147, 148, 250, 252
OWNS = (OWN, 257)
"""Link types that are a protocol's own."""
USERS = range(USER0, 163)
"""User 0 … 15, which serial capture programs let one choose from (WiresharkSerialAdapter)."""

RTAC_HEADER = struct.Struct(">IIBBH")
RTAC_TX_START, RTAC_RX_START = 1, 2
RTAC_LOST = 5
RTAC_ERRORS = {LineError.FRAMING: 7, LineError.PARITY: 8, LineError.BREAK: 9, LineError.OVERRUN: 10}
RTAC_ERROR_NAMES = {7: "framing", 8: "parity", 9: "break", 10: "overrun"}

TAG_END, TAG_NAME, TAG_SRC4, TAG_DST4, TAG_PORT_TYPE, TAG_SRC_PORT, TAG_DST_PORT = 0, 12, 20, 21, 24, 25, 26
SERVER_PORT, CLIENT_PORT, PORT_TYPE_TCP = 502, 40000, 2
CLIENT_HOST = 254


@dataclass(frozen=True, slots=True)
class DecodedRecord:
    """What was in a record. `protocol` is None when the record does not say; `event` is an RTAC line error's name."""

    octets: bytes
    protocol: str | None = None
    event: str = ""


@dataclass(frozen=True, slots=True)
class LinkType:
    """One link type: how to write (None where we only read) and read a record."""

    number: int
    read: Callable[[bytes], DecodedRecord | None]
    write: Callable[[Frame, Role, int | None, int], bytes]


def _plain(octets: bytes) -> DecodedRecord:
    return DecodedRecord(octets)


def _write_plain(frame: Frame, _role: Role, _station: int | None, _time: int) -> bytes:
    return frame.octets


def _read_rtac(record: bytes) -> DecodedRecord | None:
    if len(record) < RTAC_HEADER.size:
        return None
    event = record[8]
    if event in RTAC_ERROR_NAMES:
        return DecodedRecord(record[RTAC_HEADER.size :], protocol_of(RTAC), RTAC_ERROR_NAMES[event])
    return DecodedRecord(record[RTAC_HEADER.size :], protocol_of(RTAC), "dropped" if event == RTAC_LOST else "")


def rtac_record(time: int, event: int, octets: bytes) -> bytes:
    """An RTAC Serial record; `time` is ns since the start of the capture, kept to the microsecond."""
    seconds, rest = divmod(max(0, time), 1_000_000_000)
    return RTAC_HEADER.pack(seconds & 0xFFFFFFFF, rest // 1000, event, 0, 0) + octets


def _write_rtac(frame: Frame, role: Role, _station: int | None, time: int) -> bytes:
    return rtac_record(time, RTAC_RX_START if role is Role.RESPONSE else RTAC_TX_START, frame.octets)


def _read_exported(record: bytes) -> DecodedRecord | None:
    name, at = "", 0
    while at + 4 <= len(record):
        tag, length = struct.unpack_from(">HH", record, at)
        at += 4
        if tag == TAG_END:
            protocol = _by_pdu_name().get(name)
            return DecodedRecord(record[at:], protocol) if protocol is not None else None
        if tag == TAG_NAME:
            name = record[at : at + length].split(b"\0")[0].decode("ascii", "replace")
        at += length
    return None


def exported_header(record: bytes) -> list[int] | None:
    """Places of the octets that say what an exported PDU is and where its frame begins: tags, their lengths and the
    dissector's name, but not addresses. None without an end of tags.
    """
    fixed: list[int] = []
    at = 0
    while at + 4 <= len(record):
        tag, length = struct.unpack_from(">HH", record, at)
        fixed += range(at, at + 4)
        at += 4
        if tag == TAG_END:
            return fixed
        if tag == TAG_NAME:
            fixed += range(at, min(at + length, len(record)))
        at += length
    return None


def _tag(number: int, value: bytes) -> bytes:
    padded = value + b"\0" * (-len(value) % 4)
    return struct.pack(">HH", number, len(padded)) + padded


def _write_exported(frame: Frame, role: Role, station: int | None, _time: int) -> bytes:
    """Addresses are synthetic: the client is 10.0.0.254, unit n is 10.0.0.n; the ports say the direction."""
    held = registry.get(frame.protocol).packet_file
    name = (held.pdu_name if held is not None else "").encode() + b"\0"
    unit, client = bytes((10, 0, 0, (station or 0) & 0xFF)), bytes((10, 0, 0, CLIENT_HOST))
    answer = role is Role.RESPONSE
    source, destination = (unit, client) if answer else (client, unit)
    ports = (SERVER_PORT, CLIENT_PORT) if answer else (CLIENT_PORT, SERVER_PORT)
    return b"".join(
        (
            _tag(TAG_NAME, name),
            _tag(TAG_SRC4, source),
            _tag(TAG_DST4, destination),
            _tag(TAG_PORT_TYPE, struct.pack(">I", PORT_TYPE_TCP)),
            _tag(TAG_SRC_PORT, struct.pack(">I", ports[0])),
            _tag(TAG_DST_PORT, struct.pack(">I", ports[1])),
            _tag(TAG_END, b""),
            frame.octets,
        )
    )


LINK_TYPES: dict[int, LinkType] = {
    **{number: LinkType(number, _plain, _write_plain) for number in (*OWNS, *USERS)},
    RTAC: LinkType(RTAC, _read_rtac, _write_rtac),
    EXPORTED: LinkType(EXPORTED, _read_exported, _write_exported),
}
ANYBODYS = frozenset((*USERS, RTAC, EXPORTED))
"""Link types that do not name a protocol."""


@cache
def protocol_of(link_type: int) -> str | None:
    """The one protocol whose frames lie in records of this link type; None where that may be any."""
    if link_type in ANYBODYS:
        return None
    return next((protocol.name for protocol, held in _held() if link_type in held.link_types), None)


@cache
def _by_pdu_name() -> dict[str, str]:
    return {held.pdu_name: protocol.name for protocol, held in _held() if held.pdu_name}


def _held() -> list[tuple[Dissector, PacketFile]]:
    return [(one, one.packet_file) for one in registry.usable() if one.packet_file is not None]


def link_type_for(protocol: str, wanted: int | None = None) -> int:
    """The link type to write a protocol with: by default the first that its manifest names, else bare into USER0, which
    no Wireshark dissector reads. Raises ValueError, saying what is possible."""
    held = registry.get(protocol).packet_file
    allowed = held.link_types if held is not None else (USER0,)
    if wanted is not None and wanted not in allowed:
        raise ValueError(f"link type {wanted} cannot hold {protocol}; possible: {', '.join(map(str, allowed))}")
    return wanted if wanted is not None else allowed[0]


def written_link_types() -> list[int]:
    """Every link type that some protocol can be written with."""
    return sorted({number for _, held in _held() for number in held.link_types})


def held_by_protocols() -> str:
    """Which link types can hold which protocol, in words, the one written by default first."""
    return "; ".join(f"{one.name}: {', '.join(map(str, held.link_types))}" for one, held in _held())
