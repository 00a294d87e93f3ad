"""Captures of USB: what serial adapters heard and were given, among other devices."""

from __future__ import annotations

import random
import struct
from collections.abc import Callable
from pathlib import Path

import pytest

from dissectors.frame import Chunk, LineError
from sniff.cli import main
from sniff.engine.capture import CaptureError
from sniff.engine.session import LineEvent, LineEventKind
from sniff.formats import read
from sniff.formats.several_buses import SeveralBuses
from sniff.formats.usb import transfer_of
from tests.sniff.formats.packets_made import Packet, as_pcap, as_pcapng
from tests.sniff.formats.test_network_captures import MS, START, _sealed

USBMON, LONG, USBPCAP = 189, 220, 249
IDLE = b"\x01\x60"
Spoken = list[tuple[int, bool, bytes]]


def _spoken(count: int = 20) -> Spoken:
    """ns, whether the adapter heard it, octets."""
    return [
        (START + (number * 100 + 20 * side) * MS, side == 1, octets)
        for number in range(count)
        for side, octets in enumerate((_sealed(1, 3, 0, number, 0, 2), _sealed(1, 3, 4, 0, number, 1, 2)))
    ]


def _linux(
    octets: bytes,
    heard: bool,
    *,
    link: int = LONG,
    order: str = "<",
    endpoint: int = 1,
    event: str = "",
    length: int = -1,
) -> bytes:
    """A record of usbmon."""
    event = event or ("C" if heard else "S")
    said = len(octets) if length < 0 else length
    why = 0 if octets else ord("<" if heard else ">")
    head = struct.pack(order + "QBBBBHBB", 77, ord(event), 3, endpoint | heard << 7, 5, 1, ord("-"), why)
    head += struct.pack(order + "qiiII", 0, 0, 0, said, len(octets)) + bytes(8)
    return head + (bytes(16) if link == LONG else b"") + octets


def _windows(octets: bytes, heard: bool, *, device: int = 5, kind: int = 3) -> bytes:
    """A record of USBPcap."""
    return struct.pack("<HQIHBHHBBI", 27, 7, 0, 9, heard, 1, device, 1 | heard << 7, kind, len(octets)) + octets


def _octets(path: Path) -> bytes:
    return b"".join(item.octets for item in read(path).items() if isinstance(item, Chunk))


def _said(spoken: Spoken) -> bytes:
    return b"".join(octets for _, _, octets in spoken)


@pytest.mark.parametrize("write", [as_pcap, as_pcapng])
@pytest.mark.parametrize(("link", "order"), [(LONG, "<"), (LONG, ">"), (USBMON, "<"), (USBMON, ">")])
def test_an_adapter_of_ftdi(link: int, order: str, write: Callable[..., Path], tmp_path: Path) -> None:
    spoken = _spoken()
    packets: list[Packet] = []
    for time, heard, octets in spoken:
        for at in range(0, len(octets), 5) if heard else (0,):
            part = IDLE + octets[at : at + 5] if heard else octets
            packets.append((time + at, _linux(part, heard, link=link, order=order)))
        packets.append((time + 9, _linux(b"", heard, link=link, order=order, event="S" if heard else "C", length=512)))
        packets.append((time + 10, _linux(IDLE, True, link=link, order=order)))
    path = write(tmp_path / "x.pcap", packets, link)
    assert _octets(path) == _said(spoken)
    session = read(path).session
    assert (session.protocol, session.adapter.name, session.bus) == ("modbus-rtu", "FTDI adapter", "usb-1.5")


@pytest.mark.parametrize("size", [64, 512])
def test_packets_of_ftdi_that_came_together(size: int, tmp_path: Path) -> None:
    said = _said(_spoken(100))
    parts = [said[at : at + size - 2] for at in range(0, len(said), size - 2)]
    packets = [
        (START + at * MS, _linux(b"".join(IDLE + part for part in parts[at : at + 3]), True))
        for at in range(0, len(parts), 3)
    ]
    assert _octets(as_pcap(tmp_path / "x.pcap", packets, LONG)) == said


def test_errors_of_the_line_are_those_of_their_packet(tmp_path: Path) -> None:
    spoken = _spoken()
    packets = [(time, _linux(IDLE + octets, True)) for time, _, octets in spoken]
    packets[8] = packets[8][0], _linux(b"\x01\x64" + spoken[8][2], True)
    capture = read(as_pcap(tmp_path / "x.pcap", packets, LONG))
    marked = [item for item in capture.items() if isinstance(item, Chunk) and item.marks]
    assert [item.octets for item in marked] == [spoken[8][2]]
    assert [(mark.offset, mark.error) for mark in marked[0].marks] == [(at, LineError.PARITY) for at in range(8)]
    assert capture.session.adapter.packets
    assert capture.session.adapter.reports is not None


def test_an_adapter_without_status_among_other_devices(tmp_path: Path) -> None:
    chance = random.Random(1)
    spoken = _spoken()
    packets: list[Packet] = []
    for time, heard, octets in spoken:
        packets += [
            (time, _windows(octets, heard)),
            (time + 1, _windows(b"", not heard)),
            (time + 2, _windows(bytes(8), True, device=3, kind=1)),
            (time + 3, _windows(chance.randbytes(512), True, device=4)),
        ]
    path = as_pcap(tmp_path / "x.pcap", packets, USBPCAP)
    capture = read(path)
    assert _octets(path) == _said(spoken)
    assert capture.session.adapter.reports is None
    assert "40 of USB device 1.4" in capture.completeness().text
    others = [packet for packet in packets if packet[1][19] != 5]
    with pytest.raises(CaptureError, match=r"no serial adapter heard a field bus: 40 of USB device 1\.4"):
        read(as_pcap(tmp_path / "y.pcap", others, USBPCAP))


def test_each_port_is_a_bus(tmp_path: Path) -> None:
    spoken = _spoken()
    packets = [
        (time + port, _linux(IDLE + octets if heard else octets, heard, endpoint=2 * port + 1 + (not heard)))
        for time, heard, octets in spoken
        for port in range(2)
    ]
    capture = read(as_pcap(tmp_path / "x.pcap", packets, LONG))
    assert isinstance(capture, SeveralBuses)
    assert capture.names == ("usb-1.5-1", "usb-1.5-3")
    for bus in capture.buses:
        assert b"".join(item.octets for item in bus.items() if isinstance(item, Chunk)) == _said(spoken)


def test_what_was_given_to_send_ends_before_its_answer(tmp_path: Path) -> None:
    for early in (1, 100):  # ms between what is sent and the answer; eight characters last 4.6 ms
        spoken = [
            (time - early * MS if not heard else time - 20 * MS, heard, octets) for time, heard, octets in _spoken()
        ]
        packets = [(time, _linux(octets, heard)) for time, heard, octets in sorted(spoken)]
        times = [item.time for item in read(as_pcap(tmp_path / f"{early}.pcap", packets, LONG)).items()]
        assert times == sorted(times)
        assert times[0] == packets[0][0] + min(early * MS, 4_583_328)


def test_what_was_not_captured_is_a_hole(tmp_path: Path) -> None:
    spoken = _spoken()
    packets = [(time, _linux(octets, heard)) for time, heard, octets in spoken]
    packets[5] = packets[5][0], _linux(spoken[5][2][:-3], True, length=len(spoken[5][2]))
    items = list(read(as_pcap(tmp_path / "x.pcap", packets, LONG)).items())
    lost = [item for item in items if isinstance(item, LineEvent)]
    assert [(item.kind, item.count) for item in lost] == [(LineEventKind.DROPPED, 3)]


def test_any_octets_are_no_error() -> None:
    chance = random.Random(2)
    records = [_linux(b"12345", True), _linux(b"12345", False, link=USBMON), _windows(b"12345", True)]
    for _ in range(3000):
        record = bytearray(chance.choice(records))
        record[chance.randrange(len(record))] = chance.randrange(256)
        for link in (USBMON, LONG, USBPCAP):
            transfer_of(link, bytes(record[: chance.randrange(len(record) + 1)]))


def test_commands_read_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    packets = [(time, _linux(IDLE + octets, True)) for time, _, octets in _spoken()]
    path = str(as_pcap(tmp_path / "x.pcap", packets, LONG))
    assert main(["check", path]) == 0
    assert main(["convert", path, str(tmp_path / "x.mcap")]) == 0
    capsys.readouterr()
    assert main(["show", str(tmp_path / "x.mcap"), "--json"]) == 0
    assert capsys.readouterr().out.count('"verdict": "answered"') == 40
