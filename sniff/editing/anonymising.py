"""A capture without names: station addresses renumbered, texts replaced, checks made right again.

Every octet stays an octet at its time, so framing, gaps, pairs, damage and findings stay what they were; only who it
was and what it is called is gone. Rewritten are: addresses in all frames; in good frames server identification (Modbus
17, 43/14), BACnet character strings, device instances and network addresses; what events of the line say in words
(ports that went and came back, notes) is left out. Values of points are kept: they are what a reader needs. The data of
extended (COBS) MS/TP frames is blanked: it would not keep its length.

A damaged frame keeps its damage: only its address is renumbered, where its place is known.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Protocol

from dissectors.bacnet import apdu as apdus
from dissectors.bacnet import npdu as npdus
from dissectors.bacnet.tags import header_at
from dissectors.checksums import crc8_mstp, crc16_modbus, crc16_x25, lrc, sum8
from dissectors.frame import Chunk, Frame, Noise
from dissectors.profiles.packaged import names
from sniff.engine import Output
from sniff.profile_files import EVERY, address, noted
from sniff.reading import engine_for, line_is_assumed
from sniff.session import (
    ASSUMED,
    DEVICES_NOTE,
    LINE_NOTE,
    Adapter,
    Item,
    LineEvent,
    LineEventKind,
    Session,
    settings_change,
)

BLANK = ord("x")
CHARACTER_STRING, OBJECT_IDENTIFIER = 7, 12
DEVICE = 8
ERROR_NAMES = frozenset(("parity", "framing", "break", "overrun", "buffer overrun"))
"""What drivers and gateways call errors that they count."""

SHORTEST_TEXT = 4
"""Printable octets in a row that are taken for a text where nothing says what they are."""


class Pseudonyms:
    """Numbers instead of numbers, one for one, in the order of their appearance. `kept` ones stay as they are."""

    def __init__(self, numbers: Iterable[int], kept: Iterable[int]) -> None:
        self._known = {number: number for number in kept}
        self._free = iter([number for number in numbers if number not in self._known])

    def of(self, number: int) -> int:
        """The pseudonym of a number; itself when all are used up."""
        if number not in self._known:
            self._known[number] = next(self._free, number)
        return self._known[number]


class Rewriter(Protocol):
    """What renames the frames of one protocol."""

    stations: Pseudonyms

    def __call__(self, frame: Frame) -> bytes:
        """The frame under another name."""
        ...


def anonymous_session(session: Session) -> Session:
    """The session without the names of ports, devices and places."""
    adapter = replace(session.adapter, serial_number="")
    if adapter.name.startswith("another program's"):
        adapter = Adapter("another program's file", latency=adapter.latency, latency_from=adapter.latency_from)
    return replace(session, port="anonymised", bus="bus", adapter=adapter, notes=_renamed_devices(session), profiles={})


def _renamed_devices(session: Session) -> dict[str, str]:
    """Who is which device, under the new addresses; a profile of somebody's own may name its owner and is left out."""
    known, _ = noted(session)
    stations = _rewriter(session).stations
    said = [
        f"{word if word == EVERY else stations.of(address(word))}={name}"
        for word, name in known.items()
        if name in names()
    ]
    devices = {DEVICES_NOTE: ",".join(said)} if said else {}
    return {**devices, LINE_NOTE: ASSUMED} if line_is_assumed(session) else devices


def _rewriter(session: Session) -> Rewriter:
    """What renames frames: known devices get the first addresses, so that they are known before the first frame."""
    rewrite = _REWRITERS[session.protocol]()
    for word in noted(session)[0]:
        if word != EVERY:
            rewrite.stations.of(address(word))
    return rewrite


def knows(protocol: str) -> bool:
    """Whether this protocol's addresses and texts are known here."""
    return protocol in _REWRITERS


def anonymised(items: Iterable[Item], session: Session) -> Iterator[Item]:
    """The items with the same times and lengths, renamed. The engine decides what is a frame."""
    rewrite = _rewriter(session)
    engine = engine_for(session)
    waiting: list[Item] = []
    made = bytearray()
    for item in items:
        waiting.append(item)
        made += _rewritten(engine.take(item), rewrite)
        yield from _filled(waiting, made)
    made += _rewritten(engine.close(), rewrite)
    yield from _filled(waiting, made)


def _rewritten(output: Output, rewrite: Callable[[Frame], bytes]) -> bytes:
    parts = []
    for row in output.rows:
        event = row.event
        parts.append(_without_text(event.octets) if isinstance(event, Noise) else rewrite(event))
    return b"".join(parts)


def _filled(waiting: list[Item], made: bytearray) -> Iterator[Item]:
    """The items whose octets are there."""
    while waiting:
        item = waiting[0]
        if isinstance(item, Chunk):
            if len(made) < len(item.octets):
                return
            count = len(item.octets)
            item = replace(item, octets=bytes(made[:count]))
            del made[:count]
        else:
            item = replace(item, text=_without_names(item))
        waiting.pop(0)
        yield item


def _without_names(event: LineEvent) -> str:
    """What an event of the line may say: settings, kinds of errors. The rest may name a port or a place."""
    change = settings_change(event)
    if change is not None:
        return str(replace(change, protocol=change.protocol if change.protocol in _REWRITERS else None))
    return event.text if event.kind is LineEventKind.ERRORS and event.text in ERROR_NAMES else ""


def _without_text(octets: bytes) -> bytes:
    """Runs of printable octets blanked."""
    result = bytearray(octets)
    begin = 0
    for at in range(len(octets) + 1):
        if at < len(octets) and 32 <= octets[at] < 127:
            continue
        if at - begin >= SHORTEST_TEXT:
            result[begin:at] = bytes([BLANK]) * (at - begin)
        begin = at + 1
    return bytes(result)


# -- Modbus ----------------------------------------------------------------------------------------------------


class ModbusRtu:
    """Rewrites RTU frames."""

    def __init__(self) -> None:
        self.stations = Pseudonyms([*range(1, 248), *range(248, 256)], kept=(0,))

    def __call__(self, frame: Frame) -> bytes:
        """The frame under another name."""
        octets = frame.octets
        if not frame.ok:
            return bytes([self.stations.of(octets[0])]) + octets[1:] if octets else octets
        body = self.pdu(octets[:-2])
        return body + crc16_modbus(body).to_bytes(2, "little")

    def pdu(self, body: bytes) -> bytes:
        """Unit and PDU, renamed."""
        unit, pdu = body[:1], body[1:]
        if pdu[:1] in (b"\x11", b"\x2b"):
            pdu = pdu[:1] + _without_text(pdu[1:])
        return bytes([self.stations.of(unit[0])]) + pdu


class ModbusAscii:
    """Rewrites ASCII frames."""

    def __init__(self) -> None:
        self.rtu = ModbusRtu()
        self.stations = self.rtu.stations

    def __call__(self, frame: Frame) -> bytes:
        """The frame under another name; what is after the hexadecimal digits stays."""
        octets = frame.octets
        text = bytes(octet & 0x7F for octet in octets)
        end = text.find(b"\r") if b"\r" in text else len(text)
        if not frame.ok:
            address = _hex(text[1:3])
            renamed = b"" if address is None else b"%02X" % self.stations.of(address)
            return octets[:1] + renamed + octets[1 + len(renamed) :]
        body = self.rtu.pdu(bytes.fromhex(text[1:end].decode())[:-1])
        return octets[:1] + (body + bytes([lrc(body)])).hex().upper().encode() + octets[end:]


# -- N2 --------------------------------------------------------------------------------------------------------


class N2:
    """Rewrites N2 commands; answers carry no address."""

    def __init__(self) -> None:
        self.stations = Pseudonyms(range(1, 256), kept=(0,))

    def __call__(self, frame: Frame) -> bytes:
        """The frame under another name."""
        octets = frame.octets
        address = _hex(octets[1:3])
        if octets[:1] != b">" or address is None:
            return octets
        renamed = b"%02X" % self.stations.of(address)
        if not frame.ok or len(octets) < 6:
            return octets[:1] + renamed + octets[3:]
        body = renamed + octets[3:-3]
        return octets[:1] + body + b"%02X" % sum8(body) + octets[-1:]


# -- MS/TP -----------------------------------------------------------------------------------------------------


class Mstp:
    """Rewrites MS/TP frames: MAC addresses, device instances, network addresses, texts."""

    def __init__(self) -> None:
        self.stations = Pseudonyms(range(255), kept=(255,))
        self.devices = Pseudonyms(range(1, 4_194_303), kept=(4_194_303,))

    def __call__(self, frame: Frame) -> bytes:
        """The frame under another name."""
        octets = frame.octets
        if len(octets) < 8:
            return octets
        header = bytes([octets[2], self.stations.of(octets[3]), self.stations.of(octets[4]), octets[5], octets[6]])
        good_header = crc8_mstp(octets[2:7]) == octets[7]
        head = octets[:2] + header + (bytes([crc8_mstp(header)]) if good_header else octets[7:8])
        length = octets[5] << 8 | octets[6]
        if not frame.ok or not length:
            return head + octets[8:]
        data, check, rest = octets[8 : 8 + length], octets[8 + length : 10 + length], octets[10 + length :]
        if octets[2] >= 32:  # encoded: its length would not survive a change of its content; the frame reads damaged
            return head + bytes([BLANK]) * (len(octets) - 8)
        renamed = self._npdu(data) if octets[2] in (5, 6) else _without_text(data)
        good = crc16_x25(data).to_bytes(2, "little") == check
        return head + renamed + (crc16_x25(renamed).to_bytes(2, "little") if good else check) + rest

    def _npdu(self, data: bytes) -> bytes:
        header = npdus.decode(data)
        if header is None or header.error is not None:
            return _without_text(data)
        front = bytearray(data[: header.body])
        for named in (header.dadr, header.sadr):
            if named:
                place = bytes(front).find(named)
                front[place : place + len(named)] = bytes(len(named) - 1) + bytes([self.stations.of(named[-1])])
        body = data[header.body :]
        if header.is_network_message:
            return bytes(front) + body
        return bytes(front) + self._apdu(body)

    def _apdu(self, body: bytes) -> bytes:
        apdu = apdus.decode(body)
        if apdu is None or apdu.error is not None or apdu.segmented:
            begin = apdu.body if apdu is not None and apdu.error is None else 0
            return body[:begin] + _without_text(body[begin:])
        result = bytearray(body)
        at = apdu.body
        while at < len(body):
            tag = header_at(body, at)
            if isinstance(tag, str):
                result[at:] = _without_text(body[at:])
                break
            if tag.kind == "primitive":
                context = bool(body[at] & 8)
                result[tag.begin : tag.end] = self._content(tag.number, context, body[tag.begin : tag.end])
            at = max(tag.end, at + 1)
        return bytes(result)

    def _content(self, number: int, context: bool, content: bytes) -> bytes:
        if not context and number == CHARACTER_STRING and content:
            return content[:1] + bytes([BLANK]) * (len(content) - 1)
        value = int.from_bytes(content, "big")
        is_object = (not context and number == OBJECT_IDENTIFIER) or context
        if is_object and len(content) == 4 and value >> 22 == DEVICE:
            return (DEVICE << 22 | self.devices.of(value & 0x3FFFFF)).to_bytes(4, "big")
        return _without_text(content) if context else content


_REWRITERS: dict[str, Callable[[], Rewriter]] = {
    "modbus-rtu": ModbusRtu,
    "modbus-ascii": ModbusAscii,
    "n2": N2,
    "mstp": Mstp,
}


def _hex(octets: bytes) -> int | None:
    try:
        return int(octets, 16) if len(octets) == 2 and octets.isalnum() else None
    except ValueError:
        return None
