"""What lies between the begin of a packet and what it carries: links, tags, headers, pieces, ends that are not kept."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from dissectors.line import NS_PER_S
from sniff.engine.session import LineEvent, LineEventKind
from sniff.formats import read
from sniff.formats.network import Fragment
from sniff.formats.network_packets import MOST_OPEN, Pieces
from tests.sniff.formats.packets_made import CLIENT, SERVER, Packet, as_pcap
from tests.sniff.formats.test_network_captures import MS, START, _sealed

MAC = b"\2" * 12
HOSTS_6 = bytes.fromhex("20010db8000000000000000000000001"), bytes.fromhex("20010db8000000000000000000000002")
Bodies = list[tuple[int, int, bytes]]


def _datagrams(count: int = 8) -> tuple[Bodies, bytes]:
    """UDP datagrams with polls and answers: time, side, headers and payload; what was said."""
    found: Bodies = []
    said = b""
    for number in range(count):
        for side, octets in enumerate((_sealed(1, 3, 0, number, 0, 1), _sealed(1, 3, 2, 1, number))):
            ends = (CLIENT, SERVER) if side == 0 else (SERVER, CLIENT)
            head = struct.pack(">HHHH", ends[0][1], ends[1][1], 8 + len(octets), 0)
            found.append((START + (number * 100 + side * 20) * MS, side, head + octets))
            said += octets
    return found, said


def _ip4(side: int, body: bytes, number: int = 1, at: int = 0, more: bool = False) -> bytes:
    ends = (CLIENT[0], SERVER[0]) if side == 0 else (SERVER[0], CLIENT[0])
    place = (0x2000 if more else 0) | at // 8
    return struct.pack(">BBHHHBBH", 0x45, 0, 20 + len(body), number, place, 64, 17, 0) + ends[0] + ends[1] + body


def _ip6(side: int, body: bytes, extension: bytes = b"", kind: int = 17) -> bytes:
    ends = HOSTS_6 if side == 0 else HOSTS_6[::-1]
    return struct.pack(">IHBB", 0x60000000, len(extension + body), kind, 64) + ends[0] + ends[1] + extension + body


def _octets(path: Path) -> bytes:
    return b"".join(item.octets for item in read(path).items() if isinstance(item, Chunk))


LINKS: dict[str, tuple[int, Callable[[bytes], bytes]]] = {
    "PPP": (9, lambda packet: b"\xff\x03\x00\x21" + packet),
    "PPP, bare": (9, lambda packet: b"\x21" + packet),
    "raw, BSD": (12, lambda packet: packet),
    "raw, OpenBSD": (14, lambda packet: packet),
    "Ethernet with the length of its check sum": (0x1400_0001, lambda packet: MAC + b"\x08\x00" + packet),
    "two tags": (1, lambda packet: MAC + b"\x88\xa8\0\5\x81\0\0\6\x08\x00" + packet),
    "PPPoE": (1, lambda packet: MAC + struct.pack(">HBBHHH", 0x8864, 0x11, 0, 1, len(packet) + 2, 0x21) + packet),
    "cooked": (113, lambda packet: bytes(14) + b"\x81\0\0\5\x08\0" + packet),
    "cooked, newer": (276, lambda packet: b"\x81\0" + bytes(18) + b"\0\5\x08\0" + packet),
}


@pytest.mark.parametrize("link", LINKS)
def test_links_and_tags(link: str, tmp_path: Path) -> None:
    number, around = LINKS[link]
    bodies, said = _datagrams()
    packets = [(time, around(_ip4(side, body))) for time, side, body in bodies]
    assert _octets(as_pcap(tmp_path / "x.pcap", packets, number)) == said


@pytest.mark.parametrize("kind", [0, 43, 60])
def test_headers_of_ipv6_before_what_it_carries(kind: int, tmp_path: Path) -> None:
    bodies, said = _datagrams()
    extension = b"\x3c\x00\x01\x04\0\0\0\0" + b"\x11\x01" + bytes(14)  # of 8 octets, then one of 16
    packets = [(time, _ip6(side, body, extension, kind)) for time, side, body in bodies]
    assert _octets(as_pcap(tmp_path / "x.pcap", packets, 101)) == said


@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("is_newer", [False, True])
def test_packets_in_pieces(swapped: bool, is_newer: bool, tmp_path: Path) -> None:
    bodies, said = _datagrams()
    packets: list[Packet] = []
    for number, (time, side, body) in enumerate(bodies):
        if is_newer:
            pieces = [
                _ip6(side, body[at : at + 8], struct.pack(">BBHI", 17, 0, at | (at == 0), number), 44) for at in (0, 8)
            ]
            pieces[1] = _ip6(side, body[8:], struct.pack(">BBHI", 17, 0, 8, number), 44)
        else:
            pieces = [_ip4(side, body[:8], number, 0, more=True), _ip4(side, body[8:], number, 8)]
        packets += [(time + after, piece) for after, piece in enumerate(pieces[::-1] if swapped else pieces)]
    assert _octets(as_pcap(tmp_path / "x.pcap", packets, 101)) == said


def test_pieces_without_the_rest_are_given_up(tmp_path: Path) -> None:
    bodies, said = _datagrams()
    lone = [(START, _ip4(0, bytes(8), number, 0, more=True)) for number in range(1000, 1000 + 3 * MOST_OPEN)]
    packets = lone + [(time, _ip4(side, body)) for time, side, body in bodies]
    assert _octets(as_pcap(tmp_path / "x.pcap", packets, 101)) == said


def test_the_end_of_a_datagram_that_was_not_kept_is_a_hole(tmp_path: Path) -> None:
    bodies, said = _datagrams(20)
    packets = [(time, _ip4(side, body)) for time, side, body in bodies]
    packets[7] = packets[7][0], packets[7][1][:-2]
    items = list(read(as_pcap(tmp_path / "x.pcap", packets, 101)).items())
    lost = [item for item in items if isinstance(item, LineEvent)]
    assert [(item.kind, item.count) for item in lost] == [(LineEventKind.DROPPED, 2)]
    assert sum(len(item.octets) for item in items if isinstance(item, Chunk)) == len(said) - 2


def test_a_piece_of_another_packet_of_the_same_number_is_not_joined() -> None:
    """Numbers of packets come again; a piece that was lost leaves the others waiting."""

    def piece(at: int, octets: bytes, is_last: bool) -> Fragment:
        return Fragment(b"\x0a\0\0\1", b"\x0a\0\0\2", 7, 17, at, is_last, octets)

    pieces = Pieces()
    head = bytes((0, 1, 0, 2, 0, 16, 0, 0))
    assert pieces.add(0, piece(0, head + b"earlier.", False)) is None
    assert pieces.add(100 * NS_PER_S, piece(0, head + b"newer...", False)) is None
    whole = pieces.add(100 * NS_PER_S, piece(16, b"end", True))
    assert whole is not None
    assert whole.payload == b"newer...end"
