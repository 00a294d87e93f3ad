"""Packet files as other programs write them: packets cut short, blocks of former times, several sections."""

from __future__ import annotations

import struct
from itertools import pairwise
from pathlib import Path

import pytest

from dissectors import registry
from dissectors.checksums import crc16_modbus
from dissectors.frame import Chunk
from sniff.bus.model import BusModel
from sniff.bus.offline import survey
from sniff.cli import main
from sniff.devices import Devices
from sniff.engine.blocks import Block
from sniff.engine.session import LineEvent, LineEventKind
from sniff.formats import read

START, MS = 1_772_359_200_000_000, 1_000  # in µs
USER0 = 147
SIMPLE, ENHANCED, OBSOLETE = 3, 6, 2
KEPT = 8
"""Octets of a packet, of which an answer has one more."""


def _sealed(*octets: int) -> bytes:
    return bytes(octets) + crc16_modbus(bytes(octets)).to_bytes(2, "little")


SAID = [
    (START + (number * 100 + side * 20) * MS, octets)
    for number in range(60)
    for side, octets in enumerate((_sealed(1 + number % 3, 3, 0, 0, 0, 2), _sealed(1 + number % 3, 3, 4, 1, 0, 0, 7)))
]


def _block(order: str, kind: int, body: bytes) -> bytes:
    body += bytes(-len(body) % 4)
    size = struct.pack(order + "I", len(body) + 12)
    return struct.pack(order + "I", kind) + size + body + size


def _pcapng(kind: int, kept: int = 0, order: str = "<") -> bytes:
    written = _block(order, 0x0A0D0D0A, struct.pack(order + "IHHq", 0x1A2B3C4D, 1, 0, -1))
    written += _block(order, 1, struct.pack(order + "HHI", USER0, 0, kept))
    for time, octets in SAID:
        held = octets[: kept or None]
        head = struct.pack(order + "III", time & 0xFFFFFFFF, len(held), len(octets))
        if kind == SIMPLE:
            head = struct.pack(order + "I", len(octets))
        elif kind == OBSOLETE:
            head = struct.pack(order + "HHI", 0, 0, time >> 32) + head
        else:
            head = struct.pack(order + "II", 0, time >> 32) + head
        written += _block(order, kind, head + held)
    return written


def _pcap(kept: int = 0, order: str = "<") -> bytes:
    written = struct.pack(order + "IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, kept or 65535, USER0)
    for time, octets in SAID:
        held = octets[: kept or None]
        written += struct.pack(order + "IIII", time // 1_000_000, time % 1_000_000, len(held), len(octets)) + held
    return written


@pytest.mark.parametrize("order", ["<", ">"])
def test_blocks_of_former_times(order: str, tmp_path: Path) -> None:
    path = tmp_path / "x.pcapng"
    path.write_bytes(_pcapng(OBSOLETE, order=order))
    assert list(read(path).items()) == [Chunk(time * 1000, octets) for time, octets in SAID]


CUT = {
    "pcap": _pcap(KEPT),
    "pcap of the other order": _pcap(KEPT, ">"),
    "enhanced": _pcapng(ENHANCED, KEPT),
    "obsolete": _pcapng(OBSOLETE, KEPT),
    "simple": _pcapng(SIMPLE, KEPT),
}


@pytest.mark.parametrize("name", CUT)
def test_ends_of_packets_that_were_not_kept_are_counted(name: str, tmp_path: Path) -> None:
    path = tmp_path / ("x.pcap" if name.startswith("pcap") else "x.pcapng")
    path.write_bytes(CUT[name])
    items = list(read(path).items())
    lost = [item for item in items if isinstance(item, LineEvent)]
    assert {(item.kind, item.count) for item in lost} == {(LineEventKind.DROPPED, 1)}
    heard = sum(len(item.octets) for item in items if isinstance(item, Chunk))
    assert heard + sum(item.count for item in lost) == sum(len(octets) for _, octets in SAID)
    blocks = list(read(path).blocks())
    assert [item for item in blocks if isinstance(item, LineEvent)] == lost
    assert sum(len(item.reads.octets) for item in blocks if isinstance(item, Block)) == heard


@pytest.mark.parametrize("name", CUT)
@pytest.mark.parametrize("how", [[], ["--reference"]])
def test_nobody_is_blamed_for_them(
    name: str, how: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / ("x.pcap" if name.startswith("pcap") else "x.pcapng")
    path.write_bytes(CUT[name])
    main(["check", str(path), "-p", "modbus-rtu", "-s", "19200,8E1", *how])
    said = capsys.readouterr().out
    assert "octets missing from the capture  [LN005]" in said
    assert "[MB" not in said.replace("[MB303]", "")


def test_a_length_that_cannot_be_is_no_number_of_octets(tmp_path: Path) -> None:
    path = tmp_path / "x.pcap"
    time, octets = SAID[0]
    head = struct.pack("<IIII", time // 1_000_000, 0, len(octets), 0xFFFFFFFF)
    path.write_bytes(_pcap()[:24] + head + octets)
    events = [item for item in read(path).items() if isinstance(item, LineEvent)]
    assert [event.count for event in events] == [-1]


def test_a_hole_is_told_before_the_rows_that_it_ends(tmp_path: Path) -> None:
    """An answer whose end the first hole of a file took is nobody's fault; the same live."""
    path = tmp_path / "x.pcapng"
    whole = _pcapng(ENHANCED)
    cut = SAID[41][1]
    place = whole.index(cut, whole.index(struct.pack("<I", SAID[41][0] & 0xFFFFFFFF)))
    one = bytearray(whole)
    one[place - 8 : place + 12] = struct.pack("<II", 8, 9) + cut[:8] + bytes(4)
    path.write_bytes(one)
    for reference in (False, True):
        capture = read(path)
        model = BusModel(capture.session, registry.get("modbus-rtu"), Devices())
        survey(capture, capture.session, model, reference=reference)
        assert "MB005" not in {one.code for one in model.findings()}


def test_packets_without_times_say_nothing_of_response_times(tmp_path: Path) -> None:
    path = tmp_path / "x.pcapng"
    path.write_bytes(_pcapng(SIMPLE))
    capture = read(path)
    times = [item.time for item in capture.items()]
    assert all(later > earlier for earlier, later in pairwise(times))
    assert [item.reads.times.tolist() for item in capture.blocks() if isinstance(item, Block)] == [times]
    assert "no times" in capture.session.adapter.latency_from
    assert capture.session.adapter.latency > 300_000_000
