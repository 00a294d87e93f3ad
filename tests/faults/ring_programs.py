"""What members of an MS/TP ring do with data: segmented answers, broadcasts, scans, mistakes of their programs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from dissectors.bacnet import apdu as apdus
from dissectors.bacnet import codec, npdu, services
from dissectors.bacnet.apdu import MORE_FOLLOWS, SEGMENTED, SERVER, PduType
from dissectors.bacnet.application import READ_PROPERTY, Device, Outgoing, Poller, Quiet, read_property
from dissectors.bacnet.f510 import f510
from dissectors.bacnet.limits import BROADCAST
from dissectors.bacnet.values import ObjectId

S = 1_000_000_000

_ABORT_OVERFLOW = 1  # buffer-overflow


def drive(mac: int) -> Device:
    """A drive."""
    return f510(mac, name=f"drive {mac}")


def controller(*macs: int) -> Poller:
    """Reads two values of each of these drives in turn, one a second."""
    return Poller([(mac, f"analog-input,{number}", "present-value") for number in (4, 5) for mac in macs])


class Segmenting(Device):
    """A device whose list of objects is longer than one message: it answers in segments, one a SegmentACK.

    `aborts`: after the first segment it gives up, each time.
    """

    def __init__(self, instance: int, *, piece: int = 60, aborts: bool = False) -> None:
        like = f510(instance)
        super().__init__(instance, like.objects, like.vendor, max_apdu=1_000_000)
        self.piece, self.aborts = piece, aborts
        self.pieces: list[bytes] = []
        self.invoke_id = self.service = 0

    def answer(self, source: int, octets: bytes) -> bytes | None:
        whole = super().answer(source, octets)
        header = npdu.decode(octets)
        asked = apdus.decode(octets[header.body :]) if header is not None else None
        if whole is None or asked is None or len(whole) <= self.piece:
            return whole
        reply = npdu.decode(whole)
        assert reply is not None
        apdu = apdus.decode(whole[reply.body :])
        if apdu is None or apdu.type != PduType.COMPLEX_ACK:
            return whole
        body = whole[reply.body + apdu.body :]
        self.pieces = [body[at : at + self.piece] for at in range(0, len(body), self.piece)]
        self.invoke_id, self.service = apdu.invoke_id or 0, apdu.service or 0
        return self._segment(0)

    def hear(self, source: int, octets: bytes) -> Iterable[Outgoing]:
        header = npdu.decode(octets)
        apdu = apdus.decode(octets[header.body :]) if header is not None else None
        if apdu is None or apdu.type != PduType.SEGMENT_ACK or apdu.invoke_id != self.invoke_id:
            return super().hear(source, octets)
        following = (apdu.sequence or 0) + 1
        if following >= len(self.pieces):
            return ()
        if self.aborts:
            abort = apdus.encode(PduType.ABORT, invoke_id=self.invoke_id, reason=_ABORT_OVERFLOW, flags=SERVER)
            return (Outgoing(source, npdu.encode(abort)),)
        return (Outgoing(source, self._segment(following)),)

    def _segment(self, number: int) -> bytes:
        more = MORE_FOLLOWS if number + 1 < len(self.pieces) else 0
        return npdu.encode(
            apdus.encode(
                PduType.COMPLEX_ACK,
                self.pieces[number],
                invoke_id=self.invoke_id,
                service=self.service,
                flags=SEGMENTED | more,
                sequence=number,
            )
        )


class Lister(Poller):
    """Reads the object list of a device, every `every` ns, and acknowledges each segment."""

    def __init__(self, mac: int, instance: int, every: int = 3 * S) -> None:
        super().__init__([(mac, f"device,{instance}", "object-list")], every)

    def hear(self, source: int, octets: bytes) -> Iterable[Outgoing]:
        header = npdu.decode(octets)
        apdu = apdus.decode(octets[header.body :]) if header is not None else None
        if apdu is None or not apdu.segmented or apdu.type != PduType.COMPLEX_ACK:
            return super().hear(source, octets)
        ack = apdus.encode(PduType.SEGMENT_ACK, invoke_id=apdu.invoke_id or 0, sequence=apdu.sequence or 0)
        return (Outgoing(source, npdu.encode(ack)),)


class Sends(Quiet):
    """Sends one thing again and again, `count` of it with a token, every `every` ns."""

    def __init__(self, what: Outgoing, every: int = 0, count: int = 1) -> None:
        self.what, self.every, self.count = what, every, count
        self.next = 0

    def on_token(self, now: int) -> Iterable[Outgoing]:
        if now < self.next:
            return ()
        self.next = now + self.every
        return (self.what,) * self.count


class Scans(Poller):
    """Looks once for a device at every address, from `at` on; before and after it reads what it always reads."""

    def __init__(self, targets: Sequence[tuple[int, str, str]], addresses: Iterable[int], at: int) -> None:
        super().__init__(targets)
        self.addresses, self.at = list(addresses), at

    def on_token(self, now: int) -> Iterable[Outgoing]:
        if now >= self.at and self.addresses:
            mac = self.addresses.pop(0)
            return (Outgoing(mac, read_property(mac & 0xFF, "device,4194303", "object-name"), True),)
        return super().on_token(now)


class WrongType(Device):
    """A drive that gives its analogue values as whole numbers."""

    def __init__(self, instance: int) -> None:
        like = f510(instance)
        super().__init__(instance, like.objects, like.vendor)
        for target, held in self.objects.items():
            if target.type == 0:
                held.properties[85] = 7


def who_is() -> bytes:
    """The NPDU of a Who-Is to all."""
    return npdu.encode(apdus.encode(PduType.UNCONFIRMED_REQUEST, service=8))


def i_am(instance: int) -> Outgoing:
    """An I-Am to all."""
    return f510(instance).i_am()


def time_to_all(weekday: int) -> Outgoing:
    """A time synchronisation: Sunday, 1 March 2026, with that day of the week (1: Monday)."""
    body = bytes((0xA4, 126, 3, 1, weekday, 0xB4, 10, 0, 0, 0))
    return Outgoing(BROADCAST, npdu.encode(apdus.encode(PduType.UNCONFIRMED_REQUEST, body, service=6)))


def asked_without_reply_bit(mac: int) -> Outgoing:
    """A confirmed request whose network layer says that nothing is expected."""
    values = {"object-identifier": "analog-input,4", "property-identifier": "present-value"}
    body = codec.encode(services.CONFIRMED[READ_PROPERTY], values)
    apdu = apdus.encode(PduType.CONFIRMED_REQUEST, body, invoke_id=5, service=READ_PROPERTY, flags=2)
    return Outgoing(mac, npdu.encode(apdu, expects_reply=False), expects_reply=True)


def fault_input(device: Device) -> Device:
    """The same drive with a fault: its status input is on."""
    from dissectors.bacnet.values import Enumerated

    device.objects[ObjectId(3, 2)].properties[85] = Enumerated(1, "BinaryPV")
    return device
