"""One list of what can be said over MS/TP, made by us: every service, PDU, error, network message and frame type.

Values are random but repeatable: the same seed gives the same octets. Tests hold them against bacpypes3 and tshark.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from random import Random
from typing import Any

from dissectors.bacnet import apdu as apdus
from dissectors.bacnet import codec, layout, names, npdu, services
from dissectors.bacnet.apdu import MORE_FOLLOWS, SEGMENTED, SEGMENTED_ACCEPTED, PduType
from dissectors.bacnet.choices import CHOICES
from dissectors.bacnet.dates import Date, Time
from dissectors.bacnet.enumerations import BIT_STRINGS, ENUMERATIONS
from dissectors.bacnet.envelope import frame, npdu_frame
from dissectors.bacnet.property_types import PROPERTY_TYPES
from dissectors.bacnet.values import BitString, ConstructedValue, Double, Enumerated, ObjectId, Signed, base
from tests.dissectors.bacnet.generate_tables import types_by_object

SEEDS = 25
SERVER, CLIENT = 5, 2
LAYOUTS = {0: services.CONFIRMED, 1: services.UNCONFIRMED, 3: services.ACK, 5: services.ERROR}
"""Tables of parameters by PDU type."""

WITH_PARAMETERS = [(kind, choice) for kind, table in LAYOUTS.items() for choice in sorted(table)]

_TYPED = (28, 36, 77, 79, 85, 103, 111, 117, 600, 4194306)
"""Properties that samples name: of one plain type each, of any (85), and a vendor's."""

_THREE = {"event-time-stamps", "event-priorities"}
"""Lists that have one item for each transition."""

PLAIN: dict[str, Any] = {
    "Null": lambda rng: None,
    "Boolean": lambda rng: rng.random() < 0.5,
    "Unsigned": lambda rng: rng.choice([0, 1, 127, 128, 255]),
    "Signed": lambda rng: Signed(rng.choice([-1000, -129, -128, -1, 0, 1, 127, 128, 255, 256, 32767])),
    "Real": lambda rng: struct.unpack(">f", struct.pack(">f", rng.uniform(-1e6, 1e6)))[0],
    "Double": lambda rng: Double(rng.uniform(-1e12, 1e12)),
    "OctetString": lambda rng: rng.randbytes(rng.choice([0, 1, 4, 5, 6])),
    "CharacterString": lambda rng: "".join(rng.choices("abcÄ1 ", k=rng.randint(0, 8))),
    "BitString": lambda rng: BitString(tuple(rng.random() < 0.5 for _ in range(rng.randint(0, 17)))),
    "Enumerated": lambda rng: Enumerated(rng.choice([0, 1, 255, 256, 1000])),
    "Date": lambda rng: Date(rng.randint(70, 180), rng.randint(1, 12), rng.randint(1, 28), rng.randint(1, 7)),
    "Time": lambda rng: Time(rng.randint(0, 23), rng.randint(0, 59), rng.randint(0, 59), rng.randint(0, 99)),
    "ObjectIdentifier": lambda rng: ObjectId(rng.choice([0, 1, 8, 19, 20]), rng.randint(0, 4194303)),
}
_ANY = ("Null", "Boolean", "Unsigned", "Real", "CharacterString", "ObjectIdentifier")


@dataclass(frozen=True, slots=True)
class Sample:
    """A good frame and what it is."""

    name: str
    octets: bytes


class _Maker:
    """Makes values of the types of the tables; a value that may be anything fits the property named last."""

    def __init__(self, rng: Random, chosen: dict[str, str] | None = None) -> None:
        self._rng = rng
        self._property: int | None = None
        self._chosen = chosen or {}

    def of_type(self, type_name: str, depth: int = 0, items: int | None = None) -> Any:
        rng = self._rng
        if type_name.startswith("{"):
            count = items or rng.randint(1, 2)
            return tuple(self.of_type(type_name[1:-1], depth + 1) for _ in range(count))
        if type_name == "Any":
            fitting = PROPERTY_TYPES.get(self._property) if self._property in _TYPED else None
            return self.of_type(fitting) if fitting and fitting != "Any" else PLAIN[rng.choice(_ANY)](rng)
        if type_name in layout.ANYTHING:
            return PLAIN[rng.choice(_ANY)](rng)
        if type_name == "PropertyIdentifier":
            self._property = rng.choice(_TYPED)
            return Enumerated(self._property, type_name)
        if type_name in ENUMERATIONS:
            return Enumerated(rng.choice(sorted(ENUMERATIONS[type_name])), type_name)
        if type_name in BIT_STRINGS:
            return BitString(tuple(rng.random() < 0.5 for _ in range(max(BIT_STRINGS[type_name]) + 1)), type_name)
        kind = base(type_name)
        if kind is not None:
            return PLAIN[kind](rng)
        alternatives = layout.choice(type_name)
        if alternatives is not None:
            wanted = self._chosen.get(type_name)
            shallow = [f for f in alternatives if base(f.type) is not None]
            field = rng.choice(shallow if depth > 3 and shallow else list(alternatives))
            if wanted is not None:
                field = next(f for f in alternatives if f.name == wanted)
            return ConstructedValue(type_name, ((field.name, self.of_type(field.type, depth + 1)),))
        fields = layout.sequence(type_name)
        assert fields is not None, type_name
        return self.record(fields, type_name, depth)

    def record(self, fields: tuple[layout.LayoutField, ...], type_name: str | None, depth: int = 0) -> ConstructedValue:
        entries = []
        for field in fields:
            if field.optional and (depth >= 4 or self._rng.random() >= 0.6):
                continue
            items = 3 if field.name in _THREE else None
            value = self.of_type(field.type, depth + 1, items)
            if field.name == "priority" and field.type == "Unsigned":
                value = self._rng.randint(1, 16)
            entries.append((field.name, value))
        return ConstructedValue(type_name, tuple(entries))


def parameters_of(kind: int, choice: int, seed: int, *, complete: bool = False) -> ConstructedValue:
    """Random parameters of a service; `complete`: with all optional ones of the first level."""
    fields = layout.parse(LAYOUTS[kind][choice])
    if complete:
        fields = tuple(layout.LayoutField(f.name, f.type, f.tag, False) for f in fields)
    if (kind, choice) == (1, 7):  # one of two: an object or a name; both limits or none
        fields = tuple(f for n, f in enumerate(fields) if n == 2 + seed % 2 or (n < 2 and seed % 3 == 0))
        fields = tuple(layout.LayoutField(f.name, f.type, f.tag, False) for f in fields)
    if (kind, choice) == (5, 30):  # one of two
        fields = (layout.LayoutField(fields[seed % 2].name, fields[seed % 2].type, fields[seed % 2].tag, False),)
    if (kind, choice) == (1, 8):
        fields = tuple(layout.LayoutField(f.name, f.type, f.tag, False) for f in fields) if seed % 2 else ()
    return _Maker(Random(seed)).record(fields, None)


def apdu_of(kind: int, choice: int, values: ConstructedValue, invoke_id: int = 7) -> bytes:
    """The APDU of a service with these parameters."""
    return apdus.encode(kind, codec.encode(LAYOUTS[kind][choice], values), invoke_id=invoke_id, service=choice)


def sent(name: str, apdu: bytes, **network: Any) -> Sample:
    """An APDU in the frame that carries it: requests from the client, all else from the server."""
    asks = apdu[0] >> 4 == PduType.CONFIRMED_REQUEST
    to, by = (SERVER, CLIENT) if asks else (CLIENT, SERVER)
    return Sample(name, npdu_frame(to, by, npdu.encode(apdu, expects_reply=asks, **network), asks))


def _kind(kind: int) -> str:
    return apdus.TITLES[kind]


def every_service() -> Iterator[Sample]:
    """Requests, acknowledgements and errors with parameters of their own, SEEDS of each."""
    for kind, choice in WITH_PARAMETERS:
        for seed in range(SEEDS):
            values = parameters_of(kind, choice, seed)
            name = f"{_kind(kind)} {services.service_name(kind, choice)} #{seed}"
            yield sent(name, apdu_of(kind, choice, values, seed))


def _holding(object_type: int, number: int, value: Any) -> ConstructedValue:
    """Parameters of a ReadProperty acknowledgement."""
    return ConstructedValue(
        None,
        (
            ("object-identifier", ObjectId(object_type, 1)),
            ("property-identifier", Enumerated(number, "PropertyIdentifier")),
            ("property-value", value),
        ),
    )


def every_property() -> Iterator[Sample]:
    """ReadProperty acknowledgements: every property of every object type with a value of its type."""
    for number, types in types_by_object().items():
        for object_type, found in types.items():
            values = _holding(object_type, number, _Maker(Random(number)).of_type(found, 2))
            yield sent(f"{names.object_type(object_type)} {names.property_name(number)}", apdu_of(3, 12, values))


_EVENT = {
    "process-identifier": 1,
    "initiating-device-identifier": "device,1234",
    "event-object-identifier": "analog-input,1",
    "time-stamp": {"sequence-number": 42},
    "notification-class": 3,
    "priority": 100,
    "event-type": 0,
    "notify-type": "alarm",
    "ack-required": False,
    "from-state": "normal",
    "to-state": "offnormal",
}
_IN_CHOICES: tuple[tuple[str, dict[str, str]], ...] = (
    ("NotificationParameters", {}),
    ("PropertyStates", {"NotificationParameters": "change-of-state"}),
    ("EventParameter", {}),
    ("FaultParameter", {}),
)


def every_alternative() -> Iterator[Sample]:
    """Every kind of event and fault, with the parameters that are its own, in notifications and as properties."""
    for type_name, chosen_with in _IN_CHOICES:
        for field in layout.parse(CHOICES[type_name]):
            chosen = {type_name: field.name, **chosen_with}
            if type_name in ("NotificationParameters", "PropertyStates"):
                event = _Maker(Random(1), chosen).of_type("NotificationParameters")
                body = codec.encode(services.UNCONFIRMED[3], {**_EVENT, "event-values": event})
                apdu = apdus.encode(PduType.UNCONFIRMED_REQUEST, body, service=3)
            else:
                number = 83 if type_name == "EventParameter" else 358
                apdu = apdu_of(3, 12, _holding(9, number, _Maker(Random(1), chosen).of_type(type_name)))
            yield sent(f"{type_name} {field.name}", apdu)


def every_answer() -> Iterator[Sample]:
    """Simple acknowledgements, errors with every class and code, rejects and aborts with every reason."""
    for service in sorted(names.CONFIRMED):
        yield sent(f"SimpleACK {service}", apdus.encode(PduType.SIMPLE_ACK, invoke_id=1, service=service))
    classes = [*sorted(names.ERROR_CLASSES), 64, 65535]
    codes = [*sorted(names.ERROR_CODES), 256, 65535]
    pairs = [(classes[0], code) for code in codes] + [(number, codes[0]) for number in classes]
    for error_class, code in pairs:
        body = codec.encode(
            "error-class ErrorClass, error-code ErrorCode", {"error-class": error_class, "error-code": code}
        )
        yield sent(f"Error {error_class} {code}", apdus.encode(PduType.ERROR, body, invoke_id=1, service=12))
    for service in sorted(set(names.CONFIRMED) - set(services.ERROR)):
        body = bytes.fromhex("91019120")
        yield sent(f"Error of {service}", apdus.encode(PduType.ERROR, body, invoke_id=1, service=service))
    for reason in [*sorted(names.REJECT_REASONS), 64, 255]:
        yield sent(f"Reject {reason}", apdus.encode(PduType.REJECT, invoke_id=1, reason=reason))
    for reason in [*sorted(names.ABORT_REASONS), 64, 255]:
        for flags in (0, apdus.SERVER):
            yield sent(f"Abort {reason} {flags}", apdus.encode(PduType.ABORT, invoke_id=1, reason=reason, flags=flags))


def in_segments(kind: int, choice: int, body: bytes, invoke_id: int, size: int = 50) -> list[bytes]:
    """The APDUs of a message cut into segments."""
    pieces = [body[at : at + size] for at in range(0, len(body), size)]
    base_flags = SEGMENTED_ACCEPTED if kind == PduType.CONFIRMED_REQUEST else 0
    return [
        apdus.encode(
            kind,
            piece,
            invoke_id=invoke_id,
            service=choice,
            flags=base_flags | SEGMENTED | (MORE_FOLLOWS if number < len(pieces) - 1 else 0),
            sequence=number,
            window=4,
        )
        for number, piece in enumerate(pieces)
    ]


def every_segment() -> Iterator[Sample]:
    """A request and an answer in segments, each acknowledged, and refused segments."""
    targets = [
        {"object-identifier": f"analog-value,{n}", "list-of-property-references": [{"property-identifier": 85}]}
        for n in range(30)
    ]
    request = codec.encode(services.CONFIRMED[14], {"list-of-read-access-specs": targets})
    results = [
        {
            "object-identifier": f"analog-value,{n}",
            "list-of-results": [{"property-identifier": 85, "read-result": {"property-value": float(n)}}],
        }
        for n in range(30)
    ]
    answer = codec.encode(services.ACK[14], {"list-of-read-access-results": results})
    for kind, body in ((PduType.CONFIRMED_REQUEST, request), (PduType.COMPLEX_ACK, answer)):
        for number, segment in enumerate(in_segments(kind, 14, body, 99)):
            yield sent(f"{_kind(kind)} segment {number}", segment)
    for flags in (0, apdus.SERVER, apdus.NEGATIVE_ACK, apdus.NEGATIVE_ACK | apdus.SERVER):
        octets = bytes((PduType.SEGMENT_ACK << 4 | flags, 98, 3, 4))
        yield sent(f"SegmentACK {flags}", octets)


def every_network_message() -> Iterator[Sample]:
    """Network messages of every type, and addresses of every form around an APDU."""
    payloads: dict[int, list[bytes]] = {
        0x00: [b"", b"\x00\x64"],
        0x01: [b"\x00\x64", b"\x00\x64\x00\x65\x00\x66"],
        0x02: [b"\x00\x64\x05"],
        0x03: [bytes((reason, 0, 100)) for reason in sorted(npdu.REJECTIONS)],
        0x04: [b"", b"\x00\x64"],
        0x05: [b"", b"\x00\x64"],
        0x06: [b"\x00", b"\x02\x00\x64\x01\x00\x00\x65\x02\x03abc"],
        0x07: [b"\x00", b"\x01\x00\x64\x01\x00"],
        0x08: [b"\x00\x64\x05"],
        0x09: [b"\x00\x64"],
        0x12: [b""],
        0x13: [b"\x00\x64\x00", b"\x00\x64\x01"],
        0x80: [b"\x01\xcd", b"\x01\xcdxyz"],
        0xFF: [b"\x01\xcd"],
    }
    for message, bodies in payloads.items():
        for number, body in enumerate(bodies):
            octets = npdu.encode(body, message=message)
            yield Sample(f"{npdu.message_name(message)} #{number}", npdu_frame(255, 2, octets, False))
    who_is = apdus.encode(PduType.UNCONFIRMED_REQUEST, service=8)
    addresses: list[dict[str, Any]] = [
        {"dnet": 0xFFFF},
        {"dnet": 100, "dadr": b"\x07"},
        {"dnet": 100, "dadr": bytes.fromhex("c0a8010abac0"), "hops": 3},
        {"snet": 100, "sadr": b"\x07"},
        {"snet": 100, "sadr": bytes.fromhex("010203")},
        {"dnet": 7, "dadr": b"\x01", "snet": 9, "sadr": bytes.fromhex("aabbccddee01")},
    ]
    for network in addresses:
        yield sent(f"Who-Is {network}", who_is, **network)
    for priority in range(4):
        yield sent(f"Who-Is priority {priority}", who_is, priority=priority)


def every_frame_type() -> Iterator[Sample]:
    """Frames of every type, with data where they may have some."""
    for kind in (0, 1, 2, 7):
        yield Sample(f"type {kind}", frame(kind, 5, 2))
    for kind in (3, 4):
        yield Sample(f"type {kind} empty", frame(kind, 5, 2))
        yield Sample(f"type {kind}", frame(kind, 5, 2, b"abc"))
    yield Sample("reserved type 8", frame(8, 5, 2))
    for kind in (128, 255):
        yield Sample(f"proprietary type {kind}", frame(kind, 5, 2, b"\x01\xcdxyz"))
    who_is, read = bytes.fromhex("01001008"), bytes.fromhex("010400050c0c0c020004d2194d")
    for kind, data in ((5, read), (6, who_is), (32, read), (33, who_is)):
        yield Sample(f"type {kind} with an NPDU", frame(kind, 5, 2, data))
    zeros = bytes.fromhex("010000040102060c") + b"\x00" * 500  # nothing but zeros makes COBS work
    yield Sample("type 34", frame(34, 5, 2, zeros))
    for size in (470, 700, 1400):
        record = {
            "stream-access": {"file-start-position": Signed(0), "file-data": bytes(n * 7 & 0xFF for n in range(size))}
        }
        body = codec.encode(services.ACK[6], {"end-of-file": True, "access-method": record})
        yield sent(f"{size} octets of a file", apdus.encode(PduType.COMPLEX_ACK, body, invoke_id=3, service=6))


def without_layout() -> Iterator[Sample]:
    """Services whose parameters are read as a tree of tags."""
    tree = bytes.fromhex("09122e44429080002f")
    for service in sorted(set(names.CONFIRMED) - set(services.CONFIRMED)):
        yield sent(f"confirmed {service}", apdus.encode(PduType.CONFIRMED_REQUEST, tree, invoke_id=1, service=service))
    for service in sorted(set(names.UNCONFIRMED) - set(services.UNCONFIRMED)):
        yield sent(f"unconfirmed {service}", apdus.encode(PduType.UNCONFIRMED_REQUEST, tree, service=service))


def everything() -> Iterator[Sample]:
    """All of the above."""
    yield from every_service()
    yield from every_property()
    yield from every_alternative()
    yield from every_answer()
    yield from every_segment()
    yield from every_network_message()
    yield from every_frame_type()
    yield from without_layout()
