"""Captures of USB: what serial adapters heard and were given to send, each of their ports a bus.

Which device is a serial adapter, on which bus, and how it lays octets into packets is told by the octets, as
connections of a network are. The n-th endpoint that hears and the n-th that sends are one port.

An adapter heard octets before its transfer ended, as late as it and the host were, which nobody knows. What it was
given begins on the line behind the begin of the transfer, so its end is the length of the octets later; not after the
answer.

The line settings are those that the host set, where the capture has seen that (`usb_line.py`): before the first octet
they are the session's, afterwards a change of settings.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from dissectors import registry
from dissectors.frame import Chunk, Mark
from dissectors.line import MS, LineSettings
from sniff.engine.capture import Capture, CaptureError
from sniff.engine.event_texts import SettingsChange
from sniff.engine.session import LINE_NOTE, Adapter, Item, LineEvent, LineEventKind
from sniff.formats.bus_evidence import Evidence, evidence_of
from sniff.formats.packet_bus import PacketBus, Reader, RecordFile
from sniff.formats.records import FOREIGN_LATENCY, NOT_KEPT, PacketRecord
from sniff.formats.several_buses import one_or_several
from sniff.formats.usb import USB, Transfer, stage_of, transfer_of
from sniff.formats.usb_control import ControlTransfers
from sniff.formats.usb_line import Setting, Settings, Told, merged
from sniff.formats.usb_serial import Laid

SAMPLE = 32_768
"""Octets of a device by which it is told."""
MOST_DEVICES = 256
USB_FRAME = MS
MOST_SETTINGS = 4096
TOLD_BY_HOST = "as the host set it"
TOLD_IN_PART = "rate as the host set it, format assumed"
"""Notes of a session whose line settings are out of the capture."""
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

    def is_channel(self, number: int) -> bool:
        """Whether it is FTDI's channel of this number, from 1."""
        return self.hears == 2 * number - 1 if self.hears is not None else self.sends == 2 * number


@dataclass(frozen=True, slots=True)
class Named:
    """By which requests the settings of a port are its own. `place`: None for by none."""

    is_ftdi: bool
    place: int | None

    def has(self, setting: Setting) -> bool:
        """Whether it is one of the port's."""
        return setting.place == self.place and setting.is_ftdi is self.is_ftdi


@dataclass(frozen=True, slots=True)
class SettingOf:
    """What a host set of a device at a time (ns)."""

    time: int
    device: Device
    setting: Setting


Event = tuple[int, Transfer] | SettingOf
"""What a capture of USB says of serial adapters."""


@dataclass(slots=True)
class _Seen:
    """What is known of a device after the first look. `settings` and `began`, the first octets of each endpoint, have
    numbers in the order in which they stand in the file.
    """

    first: int
    hears: set[int] = field(default_factory=set)
    sends: set[int] = field(default_factory=set)
    sample: list[tuple[int, Transfer]] = field(default_factory=list)
    octets: int = 0
    transfers: int = 0
    settings: list[tuple[int, Setting]] = field(default_factory=list)
    began: dict[tuple[bool, int | None, Laid], int] = field(default_factory=dict)

    def named(self, port: Port, laid: Laid) -> Named:
        """How the settings of a port are named; where that is not certain, none are its own."""
        settings = [one for _, one in self.settings]
        is_ftdi = laid is not Laid.PLAIN or (port.hears is None and all(one.is_ftdi for one in settings))
        places = sorted({one.place for one in settings if one.is_ftdi is is_ftdi})
        ports = self.ports(port.device)
        if is_ftdi and places != [0]:
            return Named(is_ftdi, next((one for one in places if port.is_channel(one)), None))
        return Named(is_ftdi, places[ports.index(port)] if len(places) == len(ports) else None)

    def told_before(self, port: Port, laid: Laid) -> Told:
        """What was set of a port before its first octet."""
        named, told = self.named(port, laid), Told()
        ends = ((True, port.hears, laid), (False, port.sends, laid))
        begins = [self.began[end] for end in ends if end in self.began]
        for number, setting in self.settings:
            if named.has(setting) and number <= min(begins, default=number):
                told = merged(told, setting.told)
        return told

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
        ports = [(port, found) for port in seen.ports(device) if (found := _laid(port, seen)) is not None]
        if not ports:
            passed[f"USB device {device[0]}.{device[1]}"] += seen.transfers
        for port, (laid, evidence) in ports:
            own = name if len(ports) == 1 else f"{name}-{port.hears if port.hears is not None else port.sends}"
            told = seen.told_before(port, laid)
            usual = LineSettings.parse(registry.get(evidence.protocol).default_line)
            reader = _reader(port, laid, usual, told, seen.named(port, laid))
            adapter = _adapter(port, laid, told)
            bus = PacketBus(file, own, evidence.protocol, seen.first, adapter, reader, "capture of USB")
            line = told.line(usual)
            if line is not None:
                said = TOLD_BY_HOST if told.format is not None else TOLD_IN_PART
                bus.session = replace(bus.session, line=line, notes={**bus.session.notes, LINE_NOTE: said})
            buses.append(bus)
    listed = f": {', '.join(f'{count} of {one}' for one, count in passed.most_common(8))} (transfers)" if passed else ""
    if not buses:
        raise CaptureError(f"{file.path}: a capture of USB in which no serial adapter heard a field bus{listed}")
    for bus in buses:
        bus.beside = f"complete; beside it{listed}" if passed else bus.beside
    return one_or_several(file.path, buses)


def _look(file: RecordFile) -> dict[Device, _Seen]:
    found: dict[Device, _Seen] = {}
    asked: dict[Device, list[tuple[int, Setting]]] = {}
    for number, event in enumerate(_events(file.records())):
        if isinstance(event, SettingOf):
            known = asked.setdefault(event.device, []) if len(asked) < MOST_DEVICES else asked.get(event.device, [])
            if len(known) < MOST_SETTINGS:
                known.append((number, event.setting))
            continue
        time, transfer = event
        seen = found.get(transfer.device)
        if seen is None:
            if len(found) >= MOST_DEVICES:
                continue
            seen = found[transfer.device] = _Seen(time)
        seen.transfers += 1
        for laid in Laid:
            key = transfer.to_host, transfer.endpoint, laid
            if key not in seen.began and (_octets(transfer, laid)[0] or transfer.lost):
                seen.began[key] = number
        (seen.hears if transfer.to_host else seen.sends).add(transfer.endpoint)
        if seen.octets < SAMPLE:
            seen.octets += len(transfer.octets)
            seen.sample.append((time, transfer))
    for device, seen in found.items():
        seen.settings = asked.get(device, [])
    return found


def _events(records: Iterator[PacketRecord]) -> Iterator[Event]:
    control: dict[Device, Settings] = {}
    transfers = ControlTransfers()
    for record in records:
        if record.link_type not in USB:
            continue
        transfer = transfer_of(record.link_type, record.data)
        if transfer is not None:
            yield record.time, transfer
            continue
        stage = stage_of(record.link_type, record.data)
        request = transfers.take(stage) if stage is not None else None
        if request is None:
            continue
        setting = control.setdefault(request.device, Settings()).take(request)
        if setting is not None:
            yield SettingOf(record.time, request.device, setting)


def _laid(port: Port, seen: _Seen) -> tuple[Laid, Evidence] | None:
    """How a port lays its octets, and what they speak for; None where that is no field bus."""
    best: tuple[Laid, Evidence] | None = None
    for laid in Laid:
        heard = (_octets(one, laid)[0] for _, one in seen.sample if port.has(one))
        evidence = evidence_of(Chunk(seen.first, octets) for octets in heard if octets)
        if evidence is not None and (
            best is None or (evidence.bits, evidence.covered) > (best[1].bits, best[1].covered)
        ):
            best = laid, evidence
    return best


def _octets(transfer: Transfer, laid: Laid) -> tuple[bytes, tuple[Mark, ...]]:
    """The octets of the line in a transfer, and those among which there was an error."""
    return laid.heard(transfer.octets) if transfer.to_host else (transfer.octets, ())


def _adapter(port: Port, laid: Laid, told: Told) -> Adapter:
    """What it can report is known of those that put the state of their line before the octets."""
    ends = [f"{one:#04x}" for one in (None if port.hears is None else port.hears | 0x80, port.sends) if one is not None]
    detail = f"USB device {port.device[0]}.{port.device[1]}, endpoints {' and '.join(ends)}"
    plain = Adapter("USB serial adapter", latency=FOREIGN_LATENCY, latency_from="assumed", detail=detail)
    if laid is Laid.PLAIN:
        return plain
    adapter = replace(plain, name="FTDI adapter", reports=ERRORS_TOLD, packets=True)
    if told.timer is None:
        return adapter
    return replace(
        adapter,
        latency=told.timer * MS + USB_FRAME,
        latency_from=f"latency timer {told.timer} ms, {TOLD_BY_HOST}, + 1 ms USB",
    )


def _reader(port: Port, laid: Laid, usual: LineSettings, told: Told, named: Named) -> Reader:
    def items(records: Iterator[PacketRecord]) -> Iterator[Item]:
        given: Chunk | None = None  # to be sent: its end lies ahead
        known, line, changed = told, told.line(usual), 0
        char = (line or usual).char
        has_begun = False
        for event in _events(records):
            if isinstance(event, SettingOf):
                if has_begun and event.device == port.device and named.has(event.setting):
                    known, changed = merged(known, event.setting.told), event.time
                continue
            time, transfer = event
            if not port.has(transfer):
                continue
            octets, marks = _octets(transfer, laid)
            if not octets and not transfer.lost:
                continue
            has_begun = True
            if given is not None:
                given = replace(given, time=min(given.time, max(time, given.time - len(given.octets) * char)))
                yield given
                changed, given = max(changed, given.time), None
            if known.line(usual) != line:  # only what octets came with is a change
                line = known.line(usual)
                char = (line or usual).char
                yield LineEvent(changed, LineEventKind.SETTINGS, str(SettingsChange(line)))
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
