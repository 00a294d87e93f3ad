"""Captures of a network: the serial traffic that gateways carry over it, each connection a bus of its own.

Which connections carry a field bus, and which, is told by their octets: the protocol whose good frames say most for it,
over most of what was said at first. Telnet around them is taken away. Both directions are one bus, in order of time;
an octet is as late as the network and its buffers made it, which nobody knows.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from dissectors import registry
from dissectors.frame import Chunk, Frame
from dissectors.line import LineSettings, Timing
from sniff.engine.capture import Capture, CaptureError
from sniff.engine.session import Adapter, Item, LineEvent, LineEventKind
from sniff.formats import telnet
from sniff.formats.bus_evidence import evidence_of
from sniff.formats.network import Address, Segment, Snap, shown
from sniff.formats.network_packets import carried_by
from sniff.formats.packet_bus import PacketBus, Reader, RecordFile
from sniff.formats.records import FOREIGN_LATENCY, NOT_KEPT, PacketRecord
from sniff.formats.several_buses import one_or_several
from sniff.formats.tcp_order import Said, TcpOrder

if TYPE_CHECKING:
    pass

SAMPLE = 16_384
"""Octets of a connection by which it is told."""
MOST_CONNECTIONS = 4096
Key = tuple[bool, Address, Address]
"""TCP or not; the lower of two ends; the other."""


@dataclass(slots=True)
class _Talk:
    """What is known of a connection after the first look."""

    client: Address
    server: Address
    first: int
    sample: list[Chunk] = field(default_factory=list)
    octets: int = 0
    is_telnet: bool = False
    packets: int = 0


def read(file: RecordFile) -> Capture:
    """The buses in a file. Raises CaptureError, saying what is in it, when there is none."""
    talks, snaps, others = _look(file)
    hosts = _of_hosts(file)
    buses: list[PacketBus] = []
    passed: Counter[str] = others
    names = Counter(shown(talk.server) for talk in talks.values())
    for key, talk in talks.items():
        protocol = protocol_of(talk.sample)
        if protocol is None and not key[0] and any(_holds(one, key, talk) for one in hosts):
            continue
        if protocol is None:
            passed[_named(key)] += talk.packets
            continue
        server, client = shown(talk.server), shown(talk.client)
        name = server if names[server] == 1 else f"{client}-{server}"
        via = "telnet over TCP" if talk.is_telnet else "TCP" if key[0] else "UDP"
        buses.append(_bus(file, name, protocol, talk.first, f"{via}, {client} to {server}", _talk_reader(key, talk)))
    for protocol, first in hosts.items():
        told = _datagram_reader(protocol)
        buses.append(_bus(file, "hosts", protocol, first, "UDP, all hosts", told))
    for kind, (protocol, first) in snaps.items():
        buses.append(_bus(file, f"snap-{kind.hex()}", protocol, first, "Ethernet SNAP", _snap_reader(kind)))
    buses.sort(key=lambda bus: bus.session.protocol in registry.RELATIVES)  # buses of lines first
    if not buses:
        raise CaptureError(
            f"{file.path}: a capture of a network in which no connection carries a field bus{_list(passed)}"
        )
    for bus in buses:
        if passed:
            bus.beside = f"complete; beside it{_list(passed)}"
    return one_or_several(file.path, buses)


def _bus(file: RecordFile, name: str, protocol: str, started: int, via: str, reader: Reader) -> PacketBus:
    adapter = Adapter("gateway on a network", latency=FOREIGN_LATENCY, latency_from="assumed", detail=via)
    return PacketBus(file, name, protocol, started, adapter, reader, "capture of a network")


def _of_hosts(file: RecordFile) -> dict[str, int]:
    """Protocols whose frames are datagrams among all hosts, with the time of the first; told by their first octets."""
    samples: dict[str, list[Chunk]] = {}
    left = dict.fromkeys(_by_datagram(), SAMPLE)
    for record, segment in carried_by(file.records()):
        for name, begin in _by_datagram().items():
            if isinstance(segment, Segment) and left[name] > 0 and (octets := _with_ends(segment, begin)):
                samples.setdefault(name, []).append(Chunk(record.time, octets))
                left[name] -= len(octets)
    return {name: chunks[0].time for name, chunks in samples.items() if _says(name, chunks)}


def _says(protocol: str, chunks: list[Chunk]) -> bool:
    """Whether nearly all of these are whole frames of a protocol."""
    framer = registry.get(protocol).framer(Timing(LineSettings.parse(registry.get(protocol).default_line), 0))
    events = [event for chunk in chunks for event in framer.feed(chunk)] + framer.close()
    good = sum(len(event.octets) for event in events if isinstance(event, Frame) and event.ok)
    return 2 * good > sum(len(chunk.octets) for chunk in chunks)


def _with_ends(segment: Segment, begin: bytes) -> bytes | None:
    """A datagram behind who sends it and who is spoken to; None of anything else than IPv4 that begins so."""
    if segment.sequence is not None or not segment.payload.startswith(begin) or len(segment.source[0]) != 4:
        return None
    ends = (segment.source, segment.destination)
    return b"".join(address + port.to_bytes(2, "big") for address, port in ends) + segment.payload


def _holds(protocol: str, _key: Key, talk: _Talk) -> bool:
    """Whether datagrams of a pair of hosts belong to the bus of all hosts."""
    begin = _by_datagram()[protocol]
    return bool(talk.sample) and all(chunk.octets.startswith(begin) for chunk in talk.sample)


def _by_datagram() -> dict[str, bytes]:
    held = [(one.name, one.packet_file) for one in registry.relatives()]
    return {name: file.datagrams for name, file in held if file is not None and file.datagrams}


def _datagram_reader(protocol: str) -> Reader:
    def items(records: Iterator[PacketRecord]) -> Iterator[Item]:
        begin = _by_datagram()[protocol]
        for record, segment in carried_by(records):
            octets = _with_ends(segment, begin) if isinstance(segment, Segment) else None
            if octets:
                yield Chunk(record.time, octets)
                yield from _cut_off(record.time, segment.lost if isinstance(segment, Segment) else 0)

    return items


def protocol_of(sample: list[Chunk]) -> str | None:
    """The protocol of a connection; None where none says enough."""
    said = evidence_of(sample, [one for one in registry.relatives() if one.name not in _by_datagram()])
    return said.protocol if said is not None else None


# -- the first look --------------------------------------------------------------------------------------------


def _look(file: RecordFile) -> tuple[dict[Key, _Talk], dict[bytes, tuple[str, int]], Counter[str]]:
    """Connections, kinds of SNAP that hold serial frames, and how many packets of other kinds there are."""
    talks: dict[Key, _Talk] = {}
    snaps: dict[bytes, tuple[str, int]] = {}
    others: Counter[str] = Counter()
    for record, found in carried_by(file.records()):
        if isinstance(found, Snap):
            protocol = _by_snap().get(found.kind)
            if protocol is not None:
                snaps.setdefault(found.kind, (protocol, record.time))
                continue
        if not isinstance(found, Segment):
            others["other packets"] += 1
            continue
        if not found.payload and not found.begins:
            continue
        key = _key(found)
        talk = talks.get(key)
        if talk is None:
            if len(talks) >= MOST_CONNECTIONS:
                others["packets of further connections"] += 1
                continue
            talk = talks[key] = _new_talk(found, record.time)
        talk.packets += 1
        if found.payload and talk.octets < SAMPLE:
            if not talk.octets:
                talk.is_telnet = key[0] and telnet.begins(found.payload)
            talk.octets += len(found.payload)
    for key, sample in _samples(file, talks).items():
        talks[key].sample = sample
    return talks, snaps, others


def _samples(file: RecordFile, talks: dict[Key, _Talk]) -> dict[Key, list[Chunk]]:
    """The first octets of each connection, put in order."""
    readers = {key: _Both(talk.is_telnet) for key, talk in talks.items()}
    found: dict[Key, list[Chunk]] = {key: [] for key in talks}
    left = dict.fromkeys(talks, SAMPLE)
    for record, segment in carried_by(file.records()):
        if not isinstance(segment, Segment):
            continue
        key = _key(segment)
        if left.get(key, 0) <= 0:
            continue
        for item in readers[key].add(record.time, segment):
            if isinstance(item, Chunk):
                found[key].append(item)
                left[key] -= len(item.octets)
        if not any(count > 0 for count in left.values()):
            break
    return found


def _new_talk(segment: Segment, time: int) -> _Talk:
    """Who opens a connection is its client; where that was not seen, the one with the higher port."""
    ends = segment.source, segment.destination
    if not segment.begins and ends[0][1] < ends[1][1]:
        ends = ends[1], ends[0]
    return _Talk(*ends, time)


def _key(segment: Segment) -> Key:
    low, high = sorted((segment.source, segment.destination))
    return segment.sequence is not None, low, high


def _named(key: Key) -> str:
    """The kind of a connection that carries no field bus: by a port that is known for something, else the lower."""
    ports = sorted((key[1][1], key[2][1]))
    port = next((one for one in ports if one in _by_port()), ports[0])
    known = _by_port().get(port)
    return f"{'TCP' if key[0] else 'UDP'} port {port}{f' ({known})' if known else ''}"


def _list(passed: Counter[str]) -> str:
    said = [f"{count} of {name}" if "port" in name else f"{count} {name}" for name, count in passed.most_common(8)]
    return f": {', '.join(said)} (packets)" if said else ""


def _by_snap() -> dict[bytes, str]:
    held = [(one, one.packet_file) for one in registry.usable()]
    return {file.snap: one.name for one, file in held if file is not None and file.snap}


def _by_port() -> dict[int, str]:
    held = [one.packet_file for one in registry.usable()]
    return {port: name for file in held if file is not None for port, name in file.ports}


# -- one bus ---------------------------------------------------------------------------------------------------


class _Both:
    """Both directions of a connection."""

    def __init__(self, is_telnet: bool) -> None:
        self._is_telnet = is_telnet
        self._order = TcpOrder()
        self._telnets: dict[Address, telnet.Telnet] = {}

    def add(self, time: int, segment: Segment) -> Iterator[Item]:
        """What a packet completes."""
        if segment.sequence is not None:
            yield from self._items(self._order.add(time, segment))
            return
        if segment.payload:
            yield Chunk(time, segment.payload)
        yield from _cut_off(time, segment.lost)

    def close(self, time: int) -> Iterator[Item]:
        """What waits for packets that were not captured."""
        yield from self._items(self._order.close(time))

    def _items(self, said: Iterator[Said]) -> Iterator[Item]:
        for time, source, one in said:
            if isinstance(one, int):
                yield LineEvent(time, LineEventKind.DROPPED, "not captured", one)
                continue
            if self._is_telnet:
                one = self._telnets.setdefault(source, telnet.Telnet()).strip(one)
            if one:
                yield Chunk(time, one)


def _talk_reader(key: Key, talk: _Talk) -> Reader:
    def items(records: Iterator[PacketRecord]) -> Iterator[Item]:
        both, time = _Both(talk.is_telnet), talk.first
        for record, segment in carried_by(records):
            if isinstance(segment, Segment) and _key(segment) == key:
                time = record.time
                yield from both.add(time, segment)
        yield from both.close(time)

    return items


def _snap_reader(kind: bytes) -> Reader:
    def items(records: Iterator[PacketRecord]) -> Iterator[Item]:
        held = next(file for one in registry.usable() if (file := one.packet_file) is not None and file.snap == kind)
        for record, found in carried_by(records):
            if isinstance(found, Snap) and found.kind == kind and len(found.payload) > held.snap_header:
                yield Chunk(record.time, held.snap_before + found.payload[held.snap_header :])
                yield from _cut_off(record.time, record.cut)

    return items


def _cut_off(time: int, lost: int) -> Iterator[LineEvent]:
    if lost:
        yield LineEvent(time, LineEventKind.DROPPED, NOT_KEPT, lost)
