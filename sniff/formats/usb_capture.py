"""Captures of USB: what serial adapters heard and were given to send, each of their ports a bus.

Which device is a serial adapter, on which bus, and how it lays octets into packets is told by the octets, as
connections of a network are. The n-th endpoint that hears and the n-th that sends are one port.

An adapter heard octets before its transfer ended, as late as it and the host were, which nobody knows. What it was
given begins on the line behind the begin of the transfer, so its end is the length of the octets later; not after the
answer.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from dissectors import registry
from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.engine.capture import Capture, CaptureError
from sniff.engine.session import Adapter, Item, LineEvent, LineEventKind
from sniff.formats.bus_evidence import Evidence, evidence_of
from sniff.formats.packet_bus import PacketBus, Reader, RecordFile
from sniff.formats.records import FOREIGN_LATENCY, NOT_KEPT, PacketRecord
from sniff.formats.several_buses import one_or_several
from sniff.formats.usb import USB, Transfer, transfer_of
from sniff.formats.usb_serial import Laid

SAMPLE = 32_768
"""Octets of a device by which it is told."""
MOST_DEVICES = 256
ERRORS_TOLD = ("parity", "framing", "break", "overrun")

Device = tuple[int, int]


@dataclass(frozen=True, slots=True)
class Port:
    """One serial port of a device, by its endpoints; None for one that never had an octet."""

    device: Device
    hears: int | None
    sends: int | None

    def has(self, transfer: Transfer) -> bool:
        """Whether octets came through it."""
        return transfer.device == self.device and transfer.endpoint == (self.hears if transfer.to_host else self.sends)


@dataclass(slots=True)
class _Seen:
    """What is known of a device after the first look."""

    first: int
    hears: set[int] = field(default_factory=set)
    sends: set[int] = field(default_factory=set)
    sample: list[tuple[int, Transfer]] = field(default_factory=list)
    octets: int = 0
    transfers: int = 0

    def ports(self, device: Device) -> list[Port]:
        """Its ports."""
        hears, sends = sorted(self.hears), sorted(self.sends)
        return [
            Port(device, hears[at] if at < len(hears) else None, sends[at] if at < len(sends) else None)
            for at in range(max(len(hears), len(sends)))
        ]


def read(file: RecordFile) -> Capture:
    """The buses in a file. Raises CaptureError, saying what is in it, when there is none."""
    buses: list[PacketBus] = []
    passed: Counter[str] = Counter()
    for device, seen in _look(file).items():
        name = f"usb-{device[0]}.{device[1]}"
        ports = [(port, told) for port in seen.ports(device) if (told := _told(port, seen)) is not None]
        if not ports:
            passed[f"USB device {device[0]}.{device[1]}"] += seen.transfers
        for port, (laid, evidence) in ports:
            own = name if len(ports) == 1 else f"{name}-{port.hears if port.hears is not None else port.sends}"
            reader = _reader(port, laid, evidence.protocol)
            bus = PacketBus(file, own, evidence.protocol, seen.first, _adapter(port, laid), reader, "capture of USB")
            buses.append(bus)
    listed = f": {', '.join(f'{count} of {one}' for one, count in passed.most_common(8))} (transfers)" if passed else ""
    if not buses:
        raise CaptureError(f"{file.path}: a capture of USB in which no serial adapter heard a field bus{listed}")
    for bus in buses:
        bus.beside = f"complete; beside it{listed}" if passed else bus.beside
    return one_or_several(file.path, buses)


def _look(file: RecordFile) -> dict[Device, _Seen]:
    found: dict[Device, _Seen] = {}
    for time, transfer in _transfers(file.records()):
        seen = found.get(transfer.device)
        if seen is None:
            if len(found) >= MOST_DEVICES:
                continue
            seen = found[transfer.device] = _Seen(time)
        seen.transfers += 1
        (seen.hears if transfer.to_host else seen.sends).add(transfer.endpoint)
        if seen.octets < SAMPLE:
            seen.octets += len(transfer.octets)
            seen.sample.append((time, transfer))
    return found


def _transfers(records: Iterator[PacketRecord]) -> Iterator[tuple[int, Transfer]]:
    for record in records:
        transfer = transfer_of(record.link_type, record.data) if record.link_type in USB else None
        if transfer is not None:
            yield record.time, transfer


def _told(port: Port, seen: _Seen) -> tuple[Laid, Evidence] | None:
    """How a port lays its octets, and what they speak for; None where that is no field bus."""
    best: tuple[Laid, Evidence] | None = None
    for laid in Laid:
        heard = (laid.heard(one.octets)[0] if one.to_host else one.octets for _, one in seen.sample if port.has(one))
        evidence = evidence_of(Chunk(seen.first, octets) for octets in heard if octets)
        if evidence is not None and (
            best is None or (evidence.bits, evidence.covered) > (best[1].bits, best[1].covered)
        ):
            best = laid, evidence
    return best


def _adapter(port: Port, laid: Laid) -> Adapter:
    """What it can report is known of those that put the state of their line before the octets."""
    ends = [f"{one:#04x}" for one in (None if port.hears is None else port.hears | 0x80, port.sends) if one is not None]
    detail = f"USB device {port.device[0]}.{port.device[1]}, endpoints {' and '.join(ends)}"
    plain = Adapter("USB serial adapter", latency=FOREIGN_LATENCY, latency_from="assumed", detail=detail)
    if laid is Laid.PLAIN:
        return plain
    return replace(plain, name="FTDI adapter", reports=ERRORS_TOLD, packets=True)


def _reader(port: Port, laid: Laid, protocol: str) -> Reader:
    char = LineSettings.parse(registry.get(protocol).default_line).char

    def items(records: Iterator[PacketRecord]) -> Iterator[Item]:
        given: Chunk | None = None  # to be sent: its end lies ahead
        for time, transfer in _transfers(records):
            if not port.has(transfer):
                continue
            octets, marks = laid.heard(transfer.octets) if transfer.to_host else (transfer.octets, ())
            if not octets and not transfer.lost:
                continue
            if given is not None:
                yield replace(given, time=min(given.time, max(time, given.time - len(given.octets) * char)))
                given = None
            if transfer.to_host and octets:
                yield Chunk(time, octets, marks)
            elif octets:
                given = Chunk(time + len(octets) * char, octets)
            if transfer.lost:
                yield from (given,) if given is not None else ()
                given = None
                yield LineEvent(time, LineEventKind.DROPPED, NOT_KEPT, transfer.lost)
        if given is not None:
            yield given

    return items
