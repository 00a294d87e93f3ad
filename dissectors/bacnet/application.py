"""Simulated applications behind an MS/TP node: one that asks, one that is a device with objects. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from dissectors.bacnet import apdu as apdus
from dissectors.bacnet import codec, names, npdu, services
from dissectors.bacnet.apdu import SEGMENTED_ACCEPTED, Apdu, PduType
from dissectors.bacnet.limits import BROADCAST
from dissectors.bacnet.segmenting import SegmentReceiver, SegmentSender
from dissectors.bacnet.values import BitString, ConstructedValue, Enumerated, ObjectId

READ_PROPERTY, READ_MULTIPLE, WRITE_PROPERTY = 12, 14, 15
I_AM, WHO_IS = 0, 8
_REASON_UNRECOGNIZED, _REASON_MISSING = 9, 5
_ABORT_SEGMENTATION = 4
_RECEIVING_MAX = 16


@dataclass(frozen=True, slots=True)
class Outgoing:
    """An NPDU to send when the node has the token."""

    destination: int
    npdu: bytes
    expects_reply: bool = False


class Application(Protocol):
    """What a node asks of the program above it."""

    def answer(self, source: int, octets: bytes) -> bytes | None:
        """The NPDU that answers a Data Expecting Reply; None: stay silent."""
        ...

    def hear(self, source: int, octets: bytes) -> Iterable[Outgoing]:
        """Take data that expect no reply; give what to send because of them."""
        ...

    def on_token(self, now: int) -> Iterable[Outgoing]:
        """The node has the token at `now`: what to send with it."""
        ...


class Quiet:
    """An application that never says anything."""

    def answer(self, source: int, octets: bytes) -> bytes | None:
        """Nothing."""
        return None

    def hear(self, source: int, octets: bytes) -> Iterable[Outgoing]:
        """Nothing."""
        return ()

    def on_token(self, now: int) -> Iterable[Outgoing]:
        """Nothing."""
        return ()


def confirmed(invoke_id: int, service: int, values: Mapping[str, Any]) -> bytes:
    """The NPDU of a confirmed request."""
    body = codec.encode(services.CONFIRMED[service], values)
    apdu = apdus.encode(PduType.CONFIRMED_REQUEST, body, invoke_id=invoke_id, service=service, flags=2)
    return npdu.encode(apdu, expects_reply=True)


def read_property(invoke_id: int, target: ObjectId | str, property_name: str) -> bytes:
    """The NPDU of a ReadProperty."""
    values = {"object-identifier": target, "property-identifier": property_name}
    return confirmed(invoke_id, READ_PROPERTY, values)


class Poller(Quiet):
    """Reads a list of properties again and again: one request every `every` ns, when the node has the token."""

    def __init__(self, targets: Iterable[tuple[int, str, str]], every: int = 1_000_000_000) -> None:
        self._targets = tuple(targets)
        self._every = every
        self._next = 0
        self._turn = 0
        self._receiving: dict[tuple[int, int], SegmentReceiver] = {}  # by server and invoke id, the newest last
        self.answers: list[bytes] = []

    def on_token(self, now: int) -> Iterable[Outgoing]:
        """The next request when it is time."""
        if not self._targets or now < self._next:
            return ()
        self._next = now + self._every
        destination, target, name = self._targets[self._turn % len(self._targets)]
        self._turn += 1
        return (Outgoing(destination, read_property(self._turn & 0xFF, target, name), True),)

    def hear(self, source: int, octets: bytes) -> Iterable[Outgoing]:
        """Keep the newest answers; acknowledge those that come in segments."""
        self.answers = [*self.answers[-99:], octets]
        header, apdu, _ = _open(octets)
        if header is None or apdu is None or apdu.type != PduType.COMPLEX_ACK or not apdu.segmented:
            return ()
        about = source, apdu.invoke_id or 0
        receiver = self._receiving.pop(about, None)
        if receiver is None or (apdu.sequence == 0 and receiver.is_whole):
            receiver = SegmentReceiver()
        self._receiving[about] = receiver
        if len(self._receiving) > _RECEIVING_MAX:
            del self._receiving[next(iter(self._receiving))]
        acknowledgement = receiver.take(apdu)
        return () if acknowledgement is None else (Outgoing(source, npdu.encode(acknowledgement)),)


@dataclass(slots=True)
class Thing:
    """One object: its properties by number; `writable`: whether present-value may be written; `low`, `high`: range."""

    properties: dict[int, Any]
    writable: bool = False
    low: float | None = None
    high: float | None = None


_OBJECT_ID, _OBJECT_NAME, _OBJECT_TYPE, _PRESENT_VALUE, _OBJECT_LIST = 75, 77, 79, 85, 76
_ALL, _REQUIRED = 8, 105
_NO_ACCESS = {"unknown-object": "object", "unknown-property": "property", "invalid-array-index": "property"}


class _Refused(Exception):
    def __init__(self, code: str) -> None:
        super().__init__(code)
        self.error = {"error-class": _NO_ACCESS.get(code, "property"), "error-code": code}


@dataclass(slots=True)
class Device:
    """A BACnet device: ReadProperty, ReadPropertyMultiple, WriteProperty, Who-Is; other services are rejected."""

    instance: int
    objects: dict[ObjectId, Thing]
    vendor: int = 0
    max_apdu: int = 480
    announce: bool = True  # says I-Am when it gets its first token
    segments: bool = False  # answers that are too long go in segments where the client takes them
    written: list[tuple[ObjectId, Any]] = field(default_factory=list)
    _sending: dict[tuple[int, int], SegmentSender] = field(default_factory=dict)  # by client and invoke id

    def on_token(self, now: int) -> Iterable[Outgoing]:
        """I-Am, once; segments that nobody acknowledged."""
        again = [
            Outgoing(client, npdu.encode(segment, expects_reply=True))
            for (client, _), sender in self._sending.items()
            for segment in sender.wake(now)
        ]
        self._sending = {key: sender for key, sender in self._sending.items() if not sender.is_over}
        if not self.announce:
            return again
        self.announce = False
        return (self.i_am(), *again)

    def i_am(self) -> Outgoing:
        """The broadcast that says who is here."""
        values = {
            "i-am-device-identifier": ObjectId(8, self.instance),
            "max-apdu-length-accepted": self.max_apdu,
            "segmentation-supported": "segmented-transmit" if self.segments else "no-segmentation",
            "vendor-id": self.vendor,
        }
        body = codec.encode(services.UNCONFIRMED[I_AM], values)
        return Outgoing(BROADCAST, npdu.encode(apdus.encode(PduType.UNCONFIRMED_REQUEST, body, service=I_AM)))

    def hear(self, source: int, octets: bytes) -> Iterable[Outgoing]:
        """I-Am to a Who-Is that means this device; the next segments to an acknowledgement."""
        header, apdu, body = _open(octets)
        if apdu is not None and apdu.type == PduType.SEGMENT_ACK:
            return self._next_segments(source, apdu)
        if header is None or apdu is None or (apdu.type, apdu.service) != (PduType.UNCONFIRMED_REQUEST, WHO_IS):
            return ()
        asked = codec.decode(services.UNCONFIRMED[WHO_IS], body).record
        low = asked.get("device-instance-range-low-limit", 0)
        high = asked.get("device-instance-range-high-limit", 4194303)
        return (self.i_am(),) if low <= self.instance <= high else ()

    def _next_segments(self, client: int, acknowledgement: Apdu) -> Iterable[Outgoing]:
        key = client, acknowledgement.invoke_id or 0
        sender = self._sending.get(key)
        if sender is None:
            return ()
        following = sender.take(acknowledgement)
        if sender.is_over:
            del self._sending[key]
        return tuple(Outgoing(client, npdu.encode(segment, expects_reply=True)) for segment in following)

    def answer(self, source: int, octets: bytes) -> bytes | None:
        """The answer to a confirmed request."""
        header, apdu, body = _open(octets)
        if header is None or apdu is None or not apdu.is_request or apdu.invoke_id is None or apdu.error is not None:
            return None
        reply = self._reply(source, apdu, body)
        if header.snet is not None:
            return npdu.encode(reply, dnet=header.snet, dadr=header.sadr or b"")
        return npdu.encode(reply)

    def _reply(self, source: int, apdu: Apdu, body: bytes) -> bytes:
        invoke_id, service = apdu.invoke_id or 0, apdu.service or 0
        if apdu.segmented:
            return apdus.encode(PduType.ABORT, invoke_id=invoke_id, reason=_ABORT_SEGMENTATION, flags=1)
        if service not in (READ_PROPERTY, READ_MULTIPLE, WRITE_PROPERTY):
            return apdus.encode(PduType.REJECT, invoke_id=invoke_id, reason=_REASON_UNRECOGNIZED)
        decoded = codec.decode(services.CONFIRMED[service], body)
        if decoded.error is not None:
            return apdus.encode(PduType.REJECT, invoke_id=invoke_id, reason=_REASON_MISSING)
        try:
            if service == WRITE_PROPERTY:
                self._write(decoded.record)
                return apdus.encode(PduType.SIMPLE_ACK, invoke_id=invoke_id, service=service)
            values = self._read(decoded.record) if service == READ_PROPERTY else self._read_many(decoded.record)
            made = codec.encode(services.ACK[service], values)
        except _Refused as refused:
            error = codec.encode(services.parameters(PduType.ERROR, service) or "", refused.error)
            return apdus.encode(PduType.ERROR, error, invoke_id=invoke_id, service=service)
        if len(made) + 3 > self.max_apdu and self.segments and apdu.flags & SEGMENTED_ACCEPTED:
            sender = self._sending[source, invoke_id] = SegmentSender.of(invoke_id, service, made, self.max_apdu)
            return sender.window_of_segments()[0]
        if len(made) + 3 > self.max_apdu:
            return apdus.encode(PduType.ABORT, invoke_id=invoke_id, reason=_ABORT_SEGMENTATION, flags=1)
        return apdus.encode(PduType.COMPLEX_ACK, made, invoke_id=invoke_id, service=service)

    def _read(self, asked: ConstructedValue) -> dict[str, Any]:
        values = dict(asked.entries)
        values["property-value"] = self._value(
            asked["object-identifier"], asked["property-identifier"].value, asked.get("property-array-index")
        )
        return values

    def _read_many(self, asked: ConstructedValue) -> dict[str, Any]:
        results = []
        for spec in asked["list-of-read-access-specs"]:
            target = self._own(spec["object-identifier"])
            items = [
                self._result(target, number, item.get("property-array-index"))
                for item in spec["list-of-property-references"]
                for number in self._numbers(target, item["property-identifier"].value)
            ]
            results.append({"object-identifier": target, "list-of-results": items})
        return {"list-of-read-access-results": results}

    def _numbers(self, target: ObjectId, number: int) -> list[int]:
        thing = self.objects.get(target)
        return sorted(thing.properties) if number in (_ALL, _REQUIRED) and thing is not None else [number]

    def _result(self, target: ObjectId, number: int, index: int | None) -> dict[str, Any]:
        result: dict[str, Any] = {"property-identifier": number}
        if index is not None:
            result["property-array-index"] = index
        try:
            result["read-result"] = {"property-value": self._value(target, number, index)}
        except _Refused as refused:
            result["read-result"] = {"property-access-error": refused.error}
        return result

    def _own(self, target: ObjectId) -> ObjectId:
        return ObjectId(8, self.instance) if target == ObjectId(8, 4194303) else target

    def _value(self, target: ObjectId, number: int, index: int | None) -> Any:
        target = self._own(target)
        thing = self.objects.get(target)
        if thing is None:
            raise _Refused("unknown-object")
        if target.type == 8 and number == _OBJECT_LIST:
            return _element(tuple(sorted(self.objects, key=lambda o: (o.type, o.instance))), index)
        if number not in thing.properties:
            raise _Refused("unknown-property")
        value = thing.properties[number]
        if index is not None and not isinstance(value, tuple):
            raise _Refused("property-is-not-an-array")
        return _element(value, index)

    def _write(self, asked: ConstructedValue) -> None:
        target, value = asked["object-identifier"], asked["property-value"]
        thing = self.objects.get(target)
        if thing is None:
            raise _Refused("unknown-object")
        number = asked["property-identifier"].value
        if number not in thing.properties:
            raise _Refused("unknown-property")
        if number != _PRESENT_VALUE or not thing.writable:
            raise _Refused("write-access-denied")
        old = thing.properties[number]
        if isinstance(old, float) != isinstance(value, float) or value is None:
            raise _Refused("invalid-data-type")
        plain = float(value.value if isinstance(value, Enumerated) else value)
        if (thing.low is not None and plain < thing.low) or (thing.high is not None and plain > thing.high):
            raise _Refused("value-out-of-range")
        thing.properties[number] = value
        self.written = [*self.written[-99:], (target, value)]


def _element(value: Any, index: int | None) -> Any:
    if index is None:
        return value
    if index == 0:
        return len(value)
    if index > len(value):
        raise _Refused("invalid-array-index")
    return value[index - 1]


def _open(octets: bytes) -> tuple[npdu.Npdu | None, Apdu | None, bytes]:
    header = npdu.decode(octets)
    if header is None or header.error is not None or header.is_network_message:
        return None, None, b""
    body = octets[header.body :]
    apdu = apdus.decode(body)
    return header, apdu, body[apdu.body :] if apdu is not None else b""


def thing(target: ObjectId, name: str, value: Any, *, units: str | None = None, **more: Any) -> Thing:
    """An object with the properties that every input, output and value has."""
    properties = {
        _OBJECT_ID: target,
        _OBJECT_NAME: name,
        _OBJECT_TYPE: Enumerated(target.type, "ObjectType"),
        _PRESENT_VALUE: value,
    }
    if units is not None:
        properties[117] = Enumerated(names.number("EngineeringUnits", units), "EngineeringUnits")
    return Thing(properties, **more)


def supported(type_name: str, wanted: Iterable[str]) -> BitString:
    """A bit string of supported services or object types, by name."""
    table = names.bits(type_name) or {}
    wanted = set(wanted)
    return BitString(tuple(table.get(n) in wanted for n in range(max(table, default=0) + 1)), type_name)
