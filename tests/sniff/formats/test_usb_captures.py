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
from sniff.formats.usb import stage_of, transfer_of
from sniff.formats.usb_control import ControlTransfers, Request
from sniff.formats.usb_line import Settings
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


def _asked(kind: int, number: int, value: int, index: int = 0, octets: bytes = b"", status: int = 0) -> list[bytes]:
    """The two records of usbmon of a control transfer. With `kind` to the host `octets` are the answer."""
    setup = struct.pack("<BBHHH", kind, number, value, index, len(octets))
    sent, answered = (b"", octets) if kind & 0x80 else (octets, b"")
    begin = struct.pack("<QBBBBHBBqiiII", 88, ord("S"), 2, kind & 0x80, 5, 1, 0, 0, 0, 0, -115, len(octets), len(sent))
    end = struct.pack(
        "<QBBBBHBBqiiII", 88, ord("C"), 2, kind & 0x80, 5, 1, ord("-"), 0, 0, 0, status, len(octets), len(answered)
    )
    return [begin + setup + bytes(16) + sent, end + bytes(24) + answered]


def _asked_of_windows(
    kind: int, number: int, value: int, index: int = 0, octets: bytes = b"", apart: bool = False
) -> list[bytes]:
    """The same as USBPcap has them; `apart`: the octets sent are a stage of their own."""
    setup = struct.pack("<BBHHH", kind, number, value, index, len(octets))

    def record(stage: int, ended: bool, data: bytes) -> bytes:
        return struct.pack("<HQIHBHHBBIB", 28, 7, 0, 8, ended, 1, 5, 0, 2, len(data), stage) + data

    if kind & 0x80:
        return [record(0, False, setup), record(3, True, octets)]
    if apart:
        return [record(0, False, setup), record(1, False, octets), record(3, True, b"")]
    return [record(0, False, setup + octets), record(3, True, b"")]


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


FTDI_CASES = [
    (_asked(0x40, 3, 0x4138) + _asked(0x40, 4, 0x0208), "9600,8E1"),
    (_asked(0x40, 3, 0x809C) + _asked(0x40, 4, 0x1008), "19200,8N2"),
    (_asked(0x40, 4, 0x0008) + _asked(0x40, 3, 0xC04E), "38400,8N1"),
    (_asked(0x40, 3, 0x001A) + _asked(0x40, 4, 0x0107), "115200,7O1"),
    (_asked(0x40, 3, 0x0018, 1) + _asked(0x40, 4, 8), "123077,8N1"),  # 24 and three eighths
    (_asked(0x40, 0, 0, 1) + _asked(0x40, 3, 0x04E2, 0x0201) + _asked(0x40, 4, 8, 1), "9600,8N1"),  # high speed
    (_asked(0x40, 0, 0, 1) + _asked(0x40, 3, 0x001A, 1) + _asked(0x40, 4, 8, 1), "115200,8N1"),
]
OTHER_CASES = [
    (_asked(0x41, 0x1E, 0, 0, struct.pack("<I", 19200)) + _asked(0x41, 3, 0x0820), "19200,8E1"),
    (_asked(0x41, 1, 384) + _asked(0x41, 3, 0x0802), "9600,8N2"),
    (_asked(0xC1, 0x1D, 0, 0, struct.pack("<I", 9600)) + _asked(0xC1, 4, 0, 0, b"\x10\x07"), "9600,7O1"),
    (_asked(0x40, 0x9A, 0x1312, 0xB282) + _asked(0x40, 0x9A, 0x2518, 0xDB), "9600,8E1"),
    (_asked(0x40, 0xA1, 0xC39C, 0xCC83), "115200,8N1"),
    (_asked(0x21, 0x20, 0, 0, struct.pack("<IBBB", 19200, 2, 0, 8)), "19200,8N2"),
    (_asked(0xA1, 0x21, 0, 0, struct.pack("<IBBB", 4800, 0, 2, 8)), "4800,8E1"),
]


@pytest.mark.parametrize(("asked", "line"), FTDI_CASES + OTHER_CASES)
def test_the_line_is_what_the_host_set(asked: list[bytes], line: str, tmp_path: Path) -> None:
    idle = IDLE if (asked, line) in FTDI_CASES else b""
    packets = [(START - MS, packet) for packet in asked]
    packets += [(time, _linux(idle + octets if heard else octets, heard)) for time, heard, octets in _spoken()]
    session = read(as_pcap(tmp_path / "x.pcap", packets, LONG)).session
    assert str(session.line) == line
    assert not session.line_is_assumed
    assert "host" in session.notes["line"]


@pytest.mark.parametrize("apart", [False, True])
def test_the_line_in_captures_of_windows(apart: bool, tmp_path: Path) -> None:
    coding = struct.pack("<IBBB", 38400, 0, 1, 8)
    asked = _asked_of_windows(0xA1, 0x21, 0, 0, struct.pack("<IBBB", 9600, 0, 0, 8))
    asked += _asked_of_windows(0x21, 0x20, 0, 0, coding, apart)
    packets = [(START - MS, packet) for packet in asked]
    packets += [(time, _windows(octets, heard)) for time, heard, octets in _spoken()]
    assert str(read(as_pcap(tmp_path / "x.pcap", packets, USBPCAP)).session.line) == "38400,8O1"


def test_what_is_not_certain_is_not_taken(tmp_path: Path) -> None:
    coding = struct.pack("<IBBB", 38400, 0, 1, 8)
    unsure = [
        _asked(0x21, 0x20, 0, 0, coding, status=-32),  # refused
        _asked(0x21, 0x20, 0, 0, coding)[:1],  # not known to have been carried out
        _asked(0x21, 0x20, 0, 0, coding[:4]),
        _asked(0x21, 0x20, 0, 0, struct.pack("<IBBB", 0, 0, 0, 8)),
        _asked(0x40, 3, 0x4138),  # FTDI's, of an adapter that has no status
        _asked(0x21, 0x20, 0, 0, coding) + _asked(0x21, 0x20, 0, 2, coding),  # two interfaces, of one port
    ]
    for asked in unsure:
        packets = [(START - MS, packet) for packet in asked]
        packets += [(time, _linux(octets, heard)) for time, heard, octets in _spoken()]
        assert read(as_pcap(tmp_path / "x.pcap", packets, LONG)).session.line_is_assumed


def test_only_the_rate_is_known(tmp_path: Path) -> None:
    packets = [(START - MS, packet) for packet in _asked(0x40, 3, 0x809C)]
    packets += [(time, _linux(IDLE + octets, True)) for time, _, octets in _spoken()]
    session = read(as_pcap(tmp_path / "x.pcap", packets, LONG)).session
    assert (session.line.baud, session.notes["line"]) == (19200, "rate as the host set it, format assumed")


def test_settings_that_change_are_an_event(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    spoken = _spoken()
    packets = [(START - MS, packet) for packet in _asked(0x40, 3, 0x4138) + _asked(0x40, 4, 8) + _asked(0x40, 9, 4)]
    packets += [(time, _linux(IDLE + octets if heard else octets, heard)) for time, heard, octets in spoken]
    at = spoken[10][0] - 5 * MS
    packets += [(at, packet) for packet in _asked(0x40, 3, 0x809C) + _asked(0x40, 4, 0x0208)]
    path = as_pcap(tmp_path / "x.pcap", sorted(packets, key=lambda one: one[0]), LONG)
    capture = read(path)
    items = list(capture.items())
    changes = [item for item in items if isinstance(item, LineEvent)]
    assert str(capture.session.line) == "9600,8N1"
    assert capture.session.adapter.latency == 5 * MS
    assert [(item.kind, item.text, item.time) for item in changes] == [(LineEventKind.SETTINGS, "line=19200,8E1", at)]
    assert [item.time for item in items] == sorted(item.time for item in items)
    assert _octets(path) == _said(spoken)
    assert main(["info", str(path)]) == 0
    assert "9600,8N1 (as the host set it)" in capsys.readouterr().out


def test_settings_after_an_idle_port_was_opened_are_no_change(tmp_path: Path) -> None:
    packets = [(START - 4 * MS, packet) for packet in _asked(0x40, 3, 0x4138) + _asked(0x40, 4, 8)]
    packets += [(START - 3 * MS, _linux(IDLE, True))]
    packets += [(START - 2 * MS, packet) for packet in _asked(0x40, 3, 0x809C) + _asked(0x40, 4, 0x0208)]
    packets += [(time, _linux(IDLE + octets, True)) for time, _, octets in _spoken()]
    capture = read(as_pcap(tmp_path / "x.pcap", packets, LONG))
    assert str(capture.session.line) == "19200,8E1"
    assert all(isinstance(item, Chunk) for item in capture.items())


def test_each_channel_has_its_own_line(tmp_path: Path) -> None:
    packets = [(START - MS, packet) for channel in (1, 2) for packet in _asked(0x40, 4, 8, channel)]
    rates = _asked(0x40, 3, 0x001A, 1) + _asked(0x40, 3, 0x4138, 2)
    packets += [(START - MS, packet) for packet in rates]
    packets += [
        (time + port, _linux(IDLE + octets if heard else octets, heard, endpoint=2 * port + 1 + (not heard)))
        for time, heard, octets in _spoken()
        for port in range(2)
    ]
    capture = read(as_pcap(tmp_path / "x.pcap", packets, LONG))
    assert isinstance(capture, SeveralBuses)
    assert [bus.session.line.baud for bus in capture.buses] == [115200, 9600]


def test_any_octets_are_no_error() -> None:
    chance = random.Random(2)
    transfers, settings = ControlTransfers(), Settings()
    for kind, number in ((0x40, 3), (0x40, 4), (0x40, 0x9A), (0x40, 0xA1), (0x41, 1), (0x41, 3), (0x21, 0x20)):
        for _ in range(300):
            value, index = chance.randrange(65536), chance.randrange(65536)
            settings.take(Request((1, 5), kind, number, value, index, chance.randbytes(7)))
    records = [
        *_asked(0x40, 3, 5),
        *_asked_of_windows(0x40, 3, 5),
        _linux(b"12345", True),
        _linux(b"12345", False, link=USBMON),
        _windows(b"12345", True),
    ]
    for _ in range(3000):
        record = bytearray(chance.choice(records))
        record[chance.randrange(len(record))] = chance.randrange(256)
        for link in (USBMON, LONG, USBPCAP):
            cut = bytes(record[: chance.randrange(len(record) + 1)])
            transfer_of(link, cut)
            stage = stage_of(link, cut)
            request = transfers.take(stage) if stage is not None else None
            if request is not None:
                settings.take(request)


def test_commands_read_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    packets = [(time, _linux(IDLE + octets, True)) for time, _, octets in _spoken()]
    path = str(as_pcap(tmp_path / "x.pcap", packets, LONG))
    assert main(["check", path]) == 0
    assert main(["convert", path, str(tmp_path / "x.mcap")]) == 0
    capsys.readouterr()
    assert main(["show", str(tmp_path / "x.mcap"), "--json"]) == 0
    assert capsys.readouterr().out.count('"verdict": "answered"') == 40
