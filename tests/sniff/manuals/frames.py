"""The frames that ask for a fact of a manual and answer it, by the way it is asked."""

from __future__ import annotations

import struct
from typing import Any

from dissectors.bacnet import apdu, codec, npdu, services
from dissectors.bacnet.application import supported
from dissectors.bacnet.envelope import npdu_frame
from dissectors.checksums import sum8
from dissectors.modbus.envelope import seal_ascii, seal_rtu
from dissectors.n2.objects import REGIONS
from dissectors.profibus.telegram import telegram
from tests.sniff.manuals.fact import Asked, Exchange, Fact

RTU, ASCII = ("19200,8E1", "modbus-rtu"), ("19200,7E1", "modbus-ascii")
N2, MSTP_LINE, PROFIBUS = ("9600,8N1", "n2"), ("38400,8N1", "mstp"), ("187500,8E1", "profibus")
READ, WRITE, SLAVE = 12, 15, 5
REGION_OF = {region.name: region for region in REGIONS.values()}


# --- Modbus ---


def register(fact: Fact) -> Exchange:
    """A register read, and its value."""
    asked = b"\x01\x03" + bytes.fromhex(fact.place) + b"\x00\x01"
    return Exchange((seal_rtu(asked), seal_rtu(b"\x01\x03\x02" + fact.whole.to_bytes(2, "big"))))


def written(fact: Fact) -> Exchange:
    """A register written; the row of the question must say it."""
    both = seal_rtu(b"\x01\x06" + bytes.fromhex(fact.place) + fact.whole.to_bytes(2, "big"))
    return Exchange((both, both), 0)


def exception(fact: Fact) -> Exchange:
    """A register read, and refused."""
    asked = b"\x01\x03" + bytes.fromhex(fact.place) + b"\x00\x01"
    return Exchange((seal_rtu(asked), seal_rtu(bytes((1, 0x83, fact.whole)))))


def _printed(fact: Fact) -> list[bytes]:
    return [bytes.fromhex(octets) for octets in fact.place.split("|")]


def rtu_octets(fact: Fact) -> Exchange:
    """Frames as they are printed, checks included; the value is the place of the one that must say it."""
    return Exchange(tuple(_printed(fact)), fact.whole)


def rtu_frames(fact: Fact) -> Exchange:
    """Frames that are printed without their check."""
    return Exchange(tuple(map(seal_rtu, _printed(fact))), fact.whole)


def ascii_frames(fact: Fact) -> Exchange:
    """The same as ASCII."""
    return Exchange(tuple(map(seal_ascii, _printed(fact))), fact.whole)


def of_length(fact: Fact) -> Exchange:
    """A frame of so many octets, to the device or from it."""
    if fact.place == "to it":
        words = (fact.whole - 9) // 2
        return Exchange((seal_rtu(struct.pack(">BBHHB", 1, 16, 0x0300, words, 2 * words) + bytes(2 * words)),))
    words = (fact.whole - 5) // 2
    asked = struct.pack(">BBHH", 1, 3, 0x0300, words)
    return Exchange((seal_rtu(asked), seal_rtu(bytes((1, 3, 2 * words)) + bytes(2 * words))))


def in_time(fact: Fact) -> Exchange:
    """An answer so many ms after the question."""
    return register(fact._replace(place="2524", raw=0))._replace(after=fact.raw)


def of_station(fact: Fact) -> Exchange:
    """An answer under that number."""
    at = fact.whole
    return Exchange((seal_rtu(bytes((at, 3, 3, 0, 0, 1))), seal_rtu(bytes((at, 3, 2, 0, 0)))))


FUNCTIONS = {
    1: "01 01 0000 0001",
    2: "01 02 0000 0001",
    3: "01 03 1102 0001",
    4: "01 04 1102 0001",
    5: "01 05 0000 FF00",
    6: "01 06 1102 0001",
    8: "01 08 0000 A537",
    15: "01 0F 0000 0001 01 01",
    16: "01 10 1102 0001 02 0001",
    23: "01 17 1102 0001 1102 0001 02 0001",
}


def by_function(fact: Fact) -> Exchange:
    """A request with that function code."""
    return Exchange((seal_rtu(bytes.fromhex(FUNCTIONS[fact.whole])),), 0)


# --- N2 ---


def _sealed(start: bytes, data: str) -> bytes:
    return start + data.encode() + b"%02X\r" % sum8(data.encode())


def _float(value: float) -> str:
    return struct.pack(">f", value).hex().upper()


def _object(fact: Fact) -> tuple[Any, int]:
    kind, _, number = fact.place.partition(" ")
    return REGION_OF[kind], int(number)


def point(fact: Fact) -> Exchange:
    """The current value of an object; or, for N…, a refusal."""
    if fact.place.startswith("N"):
        return Exchange((_sealed(b">", "011010103"), f"N{fact.whole:02d}\r".encode()))
    region, number = _object(fact)
    data = "00" + _float(fact.raw) if region.name in ("AI", "AO") else f"{fact.whole << 6:02X}"
    return Exchange((_sealed(b">", f"011{region.number:X}{number:02X}{region.current:02X}"), _sealed(b"A", data)))


def overridden(fact: Fact) -> Exchange:
    """An override of an object, refused: what the device obeys is no question here."""
    region, number = _object(fact)
    data = _float(fact.raw) if region.name in ("AI", "AO") else f"{fact.whole:02X}"
    return Exchange((_sealed(b">", f"0172{region.number:02X}{number:02X}{data}"), b"N12\r"), 0)


def n2_limit(fact: Fact) -> Exchange:
    """A value: one that is read, of a binary output one that is commanded."""
    return overridden(fact) if fact.place.startswith("BO") else point(fact)


def n2_command(fact: Fact) -> Exchange:
    """A command that is obeyed."""
    return Exchange((_sealed(b">", fact.place), b"A\r"), 0)


def n2_answer(fact: Fact) -> Exchange:
    """The same; the row of the answer must say it."""
    return n2_command(fact)._replace(told=1)


# --- BACnet ---


def _frame(to: int, by: int, octets: bytes) -> bytes:
    return npdu_frame(to, by, octets, expects_reply=by == 2)


def _request(service: int, values: dict[str, Any]) -> bytes:
    body = codec.encode(services.CONFIRMED[service], values)
    return _frame(1, 2, npdu.encode(apdu.encode(0, body, invoke_id=1, service=service, flags=2), expects_reply=True))


def _told(values: dict[str, Any]) -> bytes:
    body = codec.encode(services.ACK[READ], values)
    return _frame(2, 1, npdu.encode(apdu.encode(3, body, invoke_id=1, service=READ)))


def _read(target: str, name: str, value: Any) -> Exchange:
    about = {"object-identifier": target, "property-identifier": name}
    return Exchange((_request(READ, about), _told({**about, "property-value": value})))


def _value(fact: Fact) -> tuple[str, Any]:
    target = fact.place.replace(" ", ",")
    return target, fact.raw if target.startswith("analog") else codec.Enumerated(fact.whole, "BinaryPV")


def present_value(fact: Fact) -> Exchange:
    """The value of an object."""
    target, value = _value(fact)
    return _read(target, "present-value", value)


def value_written(fact: Fact) -> Exchange:
    """The value of an object written, and confirmed."""
    target, value = _value(fact)
    about = {"object-identifier": target, "property-identifier": "present-value", "property-value": value}
    confirmed = _frame(2, 1, npdu.encode(apdu.encode(2, b"", invoke_id=1, service=WRITE)))
    return Exchange((_request(WRITE, about), confirmed), 0)


def property_asked(fact: Fact) -> Exchange:
    """A property of a kind of object asked for."""
    kind, _, name = fact.place.partition(" ")
    return Exchange((_request(READ, {"object-identifier": f"{kind},1", "property-identifier": name}),), 0)


def renamed(fact: Fact) -> Exchange:
    """An object that says another name of itself."""
    return _read(fact.place.replace(" ", ","), "object-name", "another name")


def unit(fact: Fact) -> Exchange:
    """An object that says a unit of itself."""
    return _read(fact.place.replace(" ", ","), "units", codec.Enumerated(fact.whole, "EngineeringUnits"))


_BITS = {
    "protocol-services-supported": "ServicesSupported",
    "protocol-object-types-supported": "ObjectTypesSupported",
}
_ENUMERATED = {"object-type": "ObjectType", "system-status": "DeviceStatus"}
_NUMBERS = ("vendor-identifier", "protocol-version", "protocol-revision", "max-master", "max-info-frames")


def device_property(fact: Fact) -> Exchange:
    """A property of the device itself, as the manual has it."""
    value: Any = fact.said.removeprefix("!")
    if fact.place in _BITS:
        value = supported(_BITS[fact.place], value.split())
    elif fact.place in _ENUMERATED:
        value = codec.Enumerated(fact.whole, _ENUMERATED[fact.place])
    elif fact.place in _NUMBERS:
        value = int(value)
    return _read("device,510", fact.place, value)


# --- PROFIBUS DP ---


def cyclic(fact: Fact) -> Exchange:
    """One word of the cyclic data, the others 0."""
    direction, _, number = fact.place.partition(" ")
    words = [0] * 16
    words[int(number)] = fact.whole
    data, others = struct.pack(">16H", *words), bytes(32)
    given, told = (others, data) if direction == "input" else (data, others)
    frames = telegram(SLAVE, 2, 0x5D, given), telegram(2, SLAVE, 0x08, told)
    return Exchange(frames, 1 if direction == "input" else 0, 0.1)


def slave(fact: Fact) -> Exchange:
    """An answer of that address."""
    return Exchange((telegram(fact.whole, 2, 0x5D, bytes(32)), telegram(2, fact.whole, 0x08, bytes(32))), 1, 0.1)


SHOWN: dict[str, Asked] = {
    "modbus": Asked(*RTU, register),
    "write": Asked(*RTU, written),
    "modbus exception": Asked(*RTU, exception),
    "rtu octets": Asked(*RTU, rtu_octets),
    "rtu frames": Asked(*RTU, rtu_frames),
    "ascii octets": Asked(*ASCII, rtu_octets),
    "ascii frames": Asked(*ASCII, ascii_frames),
    "n2": Asked(*N2, point),
    "n2 without unit": Asked(*N2, point),
    "n2 frames": Asked(*N2, n2_command),
    "n2 answers": Asked(*N2, n2_answer),
    "bacnet": Asked(*MSTP_LINE, present_value),
    "bacnet property": Asked(*MSTP_LINE, property_asked),
    "bacnet name": Asked(*MSTP_LINE, renamed),
    "bacnet unit": Asked(*MSTP_LINE, unit),
    "bacnet device": Asked(*MSTP_LINE, device_property),
    "profibus": Asked(*PROFIBUS, cyclic),
}
"""What `show` must say of a row."""

JUDGED: dict[str, Asked] = {
    "check modbus": Asked(*RTU, register),
    "check write": Asked(*RTU, written),
    "check frame": Asked(*RTU, of_length),
    "check time": Asked(*RTU, in_time),
    "check station": Asked(*RTU, of_station),
    "check function": Asked(*RTU, by_function),
    "check n2": Asked(*N2, n2_command),
    "check profibus station": Asked(*PROFIBUS, slave),
    "access modbus": Asked(*RTU, written),
    "access n2": Asked(*N2, overridden),
    "access bacnet": Asked(*MSTP_LINE, value_written),
    "range modbus": Asked(*RTU, register),
    "range n2": Asked(*N2, n2_limit),
    "range bacnet": Asked(*MSTP_LINE, present_value),
}
"""What the rules of device profiles must find, or not."""
