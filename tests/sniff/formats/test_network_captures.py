"""Captures of gateways: serial traffic in TCP and UDP, each connection a bus; what is none is said."""

from __future__ import annotations

import contextlib
import json
import random
from collections.abc import Callable
from pathlib import Path

import pytest

from dissectors.checksums import crc16_modbus, lrc
from dissectors.frame import Chunk
from sniff.cli import main
from sniff.engine.capture import Capture, CaptureError
from sniff.engine.session import LineEvent, LineEventKind
from sniff.formats import read
from sniff.formats.linktypes import rtac_record
from sniff.formats.several_buses import SeveralBuses
from sniff.formats.telnet import Telnet
from tests.captures_shared import CAPTURES
from tests.sniff.formats.packets_made import CLIENT, SERVER, SYN, Packet, as_pcap, as_pcapng, tcp, udp
from tests.sniff.formats.written_anew import write_anew

START, MS = 1_772_359_200_000_000_000, 1_000_000


def _sealed(*octets: int) -> bytes:
    body = bytes(octets)
    return body + crc16_modbus(body).to_bytes(2, "little")


def _line(*octets: int) -> bytes:
    body = bytes(octets)
    return b":" + (body + bytes([lrc(body)])).hex().upper().encode() + b"\r\n"


def _talk(
    count: int = 8,
    server: tuple[bytes, int] = SERVER,
    client: tuple[bytes, int] = CLIENT,
    seal: Callable[..., bytes] = _sealed,
    greeting: bytes = b"",
) -> tuple[list[Packet], bytes]:
    """Polls and their answers over a connection; what is said on the bus."""
    said = b""
    sent = [100, 0xFFFFFFF0]  # the second wraps around
    packets = [(START, tcp(client, server, sent[0] - 1, b"", SYN)), (START, tcp(server, client, sent[1] - 1, b"", SYN))]
    for at in range(count):
        for side, octets in enumerate((seal(1, 3, 0, at, 0, 1), seal(1, 3, 2, 1, at))):
            said += octets
            payload = octets.replace(b"\xff", b"\xff\xff") if greeting else octets
            payload = (greeting if at == 0 else b"") + payload
            ends = (client, server) if side == 0 else (server, client)
            packets.append((START + (at * 100 + 20 * side) * MS, tcp(*ends, sent[side], payload, tagged=at % 2 == 1)))
            sent[side] += len(payload)
    return packets, said


def _octets(capture: Capture) -> bytes:
    return b"".join(item.octets for item in capture.items() if isinstance(item, Chunk))


@pytest.mark.parametrize("write", [as_pcap, as_pcapng])
@pytest.mark.parametrize(("seal", "protocol"), [(_sealed, "modbus-rtu"), (_line, "modbus-ascii")])
def test_serial_frames_over_tcp(
    tmp_path: Path, write: Callable[..., Path], seal: Callable[..., bytes], protocol: str
) -> None:
    packets, said = _talk(seal=seal)
    capture = read(write(tmp_path / "gateway.pcap", packets))
    assert capture.session.protocol == protocol
    assert capture.session.bus == "192.0.2.9:8899"
    assert "192.0.2.1:40000 to 192.0.2.9:8899" in capture.session.adapter.detail
    assert _octets(capture) == said
    assert capture.completeness().whole


def test_telnet_around_it_is_taken_away(tmp_path: Path) -> None:
    packets, said = _talk(30, greeting=b"\xff\xfb\x2c\xff\xfa\x2c\x01\x00\x00\x25\x80\xff\xf0")
    capture = read(as_pcap(tmp_path / "x.pcap", packets))
    assert _octets(capture) == said
    assert "telnet" in capture.session.adapter.detail


def test_telnet_cut_anywhere_is_the_same() -> None:
    stream = b"\xff\xfb\x2c12\xff\xff3\xff\xfa\x2c\x01\xff\xff\x00\xff\xf04\xff\xf15"
    for cut in range(len(stream)):
        telnet = Telnet()
        assert telnet.strip(stream[:cut]) + telnet.strip(stream[cut:]) == b"12\xff345"


def test_segments_out_of_order_and_twice_are_put_right(tmp_path: Path) -> None:
    packets, said = _talk()
    times = [time for time, _ in packets]
    datas = [data for _, data in packets]
    for first, second in ((2, 4), (6, 8)):  # two of the client
        datas[first], datas[second] = datas[second], datas[first]
    datas.insert(7, datas[3])
    times.insert(7, times[6])
    heard = _octets(read(as_pcap(tmp_path / "x.pcap", list(zip(times, datas, strict=True)))))
    assert sorted(heard) == sorted(said)


def test_a_segment_that_was_not_captured_is_a_hole(tmp_path: Path) -> None:
    packets, said = _talk(100)
    del packets[20]
    capture = read(as_pcap(tmp_path / "x.pcap", packets))
    events = [item for item in capture.items() if isinstance(item, LineEvent)]
    assert [event.count for event in events] == [8]
    assert len(_octets(capture)) == len(said) - 8


def test_each_connection_is_a_bus(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one, said = _talk()
    other, _ = _talk(5, server=(SERVER[0], 4001), seal=_line)
    again, _ = _talk(3, client=(CLIENT[0], 40001))
    web = [(START, tcp(CLIENT, (SERVER[0], 80), 1, b"GET / HTTP/1.1\r\n\r\n"))]
    path = as_pcapng(tmp_path / "site.pcapng", sorted([*one, *other, *again, *web], key=lambda packet: packet[0]))
    capture = read(path)
    assert isinstance(capture, SeveralBuses)
    assert len(capture.buses) == 3
    assert "192.0.2.9:4001" in capture.names
    assert "192.0.2.1:40001-192.0.2.9:8899" in capture.names
    for command in (["stats", str(path)], ["stats", str(path), "polls"], ["merge", str(path), "-o", f"{path}.mcap"]):
        assert main(command) == 2  # they are of one bus: what three make together is nobody's
        assert "3 buses in it" in capsys.readouterr().err
    main(["detect", str(path)])
    assert f"next: sniff485 open {path} --bus 192.0.2.9:4001 -p " in capsys.readouterr().out
    assert main(["show", str(path), "--bus", "192.0.2.1:40000-192.0.2.9:8899", "--json"]) == 0
    assert capsys.readouterr().out.count('"ok": true') == 16
    assert "TCP port 80" in capture.completeness().text
    assert _octets(capture.buses[0]) == said


def test_datagrams_are_read_too(tmp_path: Path) -> None:
    packets = []
    for at in range(6):
        packets.append((START + at * 100 * MS, udp(CLIENT, SERVER, _sealed(1, 3, 0, at, 0, 1))))
        packets.append((START + (at * 100 + 9) * MS, udp(SERVER, CLIENT, _sealed(1, 3, 2, 0, at))))
    assert len(_octets(read(as_pcap(tmp_path / "x.pcap", packets)))) == 6 * 15


@pytest.mark.parametrize("write", [as_pcap, as_pcapng])
def test_a_network_without_any_is_said(tmp_path: Path, write: Callable[..., Path]) -> None:
    packets = [
        (START, tcp(CLIENT, (SERVER[0], 443), 1, random.Random(1).randbytes(900))),
        (START, udp(CLIENT, (SERVER[0], 47808), b"\x82\x0a\x00\x08\x01\x20\xff\xff")),  # of IPv6
        (START, tcp(CLIENT, (SERVER[0], 502), 1, bytes.fromhex("000100010006010300000002"))),  # of another protocol
    ]
    path = write(tmp_path / "x.pcap", packets)
    with pytest.raises(CaptureError) as refused:
        read(path)
    for words in (
        "no connection carries a field bus",
        "TCP port 443",
        "UDP port 47808 (BACnet/IP)",
        "502 (Modbus TCP)",
    ):
        assert words in str(refused.value)
    assert main(["check", str(path)]) == 3


@pytest.mark.parametrize("write", [as_pcap, as_pcapng])
def test_modbus_tcp_is_paired_by_its_transactions(
    tmp_path: Path, write: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    server, other = (SERVER[0], 502), (b"\xc0\0\2\2", 40001)
    said = (
        "000700000006010300100002",
        "000800000006020300200001",
        "0008000000050203020009",
        "000700000007010304000A000B",
    )
    packets = [(START, tcp(CLIENT, server, 1, b"", SYN))]
    number = {CLIENT: 2, server: 1, other: 1}
    for place, text in enumerate(said):
        source, target = (CLIENT, server) if place < 2 else (server, CLIENT)
        octets = bytes.fromhex(text)
        packets.append((START + place * 10_000_000, tcp(source, target, number[source], octets)))
        number[source] += len(octets)
    packets.append((START + 90_000_000, tcp(other, server, 1, bytes.fromhex("000100000006030100000001"))))
    path = write(tmp_path / "x.pcap", packets)
    capture = read(path)
    assert isinstance(capture, SeveralBuses)
    assert [bus.session.protocol for bus in capture.buses] == ["modbus-tcp", "modbus-tcp"]
    assert main(["show", str(path), "--bus", capture.names[0]]) == 0
    shown = capsys.readouterr().out.splitlines()
    assert [line.split("  #")[1].split()[0] for line in shown] == ["7", "8", "8", "7"]
    assert "1 → 2 registers: 10 11" in shown[3]
    assert main(["stats", str(path), "--bus", capture.names[0]]) == 0
    assert main(["convert", str(path), str(tmp_path / "y.mcap"), "--bus", capture.names[0]]) == 0
    assert read(tmp_path / "y.mcap").session.protocol == "modbus-tcp"


def test_octets_of_a_packet_come_at_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """At the rate of a line a long answer would have begun before it was asked for, and no response time were right."""
    server = (SERVER[0], 502)
    asked, answer = bytes.fromhex("000700000006010300000078"), bytes.fromhex("0007000000F30103F0") + bytes(240)
    said = [
        (0, tcp(CLIENT, server, 1, b"", SYN)),
        (1, tcp(CLIENT, server, 2, asked)),
        (31, tcp(server, CLIENT, 1, answer)),
    ]
    path = as_pcap(tmp_path / "x.pcap", [(START + time * MS, packet) for time, packet in said])
    assert main(["show", str(path), "--json"]) == 0
    ran = capsys.readouterr()
    assert json.loads(ran.out.splitlines()[1])["latency_ms"] == pytest.approx(30, abs=0.3)
    assert ran.err == ""  # there is no line whose settings were to be named
    assert main(["info", str(path)]) == 0
    out = capsys.readouterr().out
    assert "Modbus TCP, no serial line" in out
    assert "load" not in out
    main(["detect", str(path)])
    out = capsys.readouterr().out
    assert "Modbus TCP, no serial line" in out
    assert "cannot tell" not in out


@pytest.mark.parametrize("write", [as_pcap, as_pcapng])
def test_bacnet_ip_of_all_hosts_is_one_bus(
    tmp_path: Path, write: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    here, there, all_of_them = ((bytes((192, 0, 2, last)), 47808) for last in (1, 9, 255))
    said = [
        (here, all_of_them, "810b000c0120ffff00ff1008"),
        (here, there, "810a001101040005010c0c000000011955"),
        (there, here, "810a0017010030010c0c0000000119553e4441b800003f"),
    ]
    packets = [
        (START + place * 10_000_000, udp(source, target, bytes.fromhex(text)))
        for place, (source, target, text) in enumerate(said)
    ]
    path = write(tmp_path / "x.pcap", packets)
    capture = read(path)
    assert (capture.session.protocol, capture.session.bus) == ("bacnet-ip", "hosts")
    assert main(["show", str(path)]) == 0
    out = capsys.readouterr().out
    assert "analog-input,1 present-value = 23" in out
    assert "ms" in out.splitlines()[2]  # paired
    assert main(["points", str(path)]) == 0
    assert "analog-input/1" in capsys.readouterr().out


def test_a_log_of_a_gateway_is_told_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "x.log"
    frames = ("000700000006010300100002", "000700000007010304000A000B") * 4
    lines = [f"{'RX' if no % 2 else 'TX'}: {bytes.fromhex(text).hex(' ')}\n" for no, text in enumerate(frames)]
    path.write_text("".join(lines))
    assert main(["show", str(path)]) == 0
    out, err = capsys.readouterr()
    assert out.count("2 registers: 10 11") == 4
    assert "Modbus TCP (sure" in err


def test_cut_and_mutated_files_are_read_or_refused(tmp_path: Path) -> None:
    packets, _ = _talk(6)
    some = random.Random(2)
    for write in (as_pcap, as_pcapng):
        path = write(tmp_path / "x.pcap", packets)
        whole = path.read_bytes()
        broken = [whole[:cut] for cut in range(0, len(whole), 7)]
        for _ in range(200):
            mutated = bytearray(whole)
            for _ in range(some.choice((1, 4, 40))):
                mutated[some.randrange(24, len(mutated))] = some.randrange(256)
            broken.append(bytes(mutated))
        for octets in broken:
            write_anew(path, octets)
            with contextlib.suppress(CaptureError):
                capture = read(path)
                for bus in capture.buses if isinstance(capture, SeveralBuses) else (capture,):
                    for _ in bus.items():
                        pass
                    bus.completeness()


def test_frames_in_ethernet_snap(tmp_path: Path) -> None:
    folder = CAPTURES / "mstp-cimetrics-snap-mixed"
    if not folder.is_dir():
        pytest.skip("the shared captures are not here")
    capture = read(folder / "BACnet-MSTP-SNAP-Mixed.cap")
    assert isinstance(capture, SeveralBuses)
    line, network = capture.buses
    assert (line.session.protocol, network.session.protocol) == ("mstp", "bacnet-ip")
    assert _octets(line) == _octets(read(folder / "derived_linktype165.pcap"))
    assert len([item for item in network.items() if isinstance(item, Chunk)]) == 68


@pytest.mark.parametrize("in_snap", [False, True])
def test_ends_of_frames_that_were_not_kept_are_holes(in_snap: bool, tmp_path: Path) -> None:
    """Whatever carries one each."""
    if in_snap:
        whole = bytes(12) + bytes.fromhex("001f aaaa03 0010900001 000080 0001720000 84")
    else:
        told = bytes.fromhex("810a0017010030010c0c0000000119553e4441b800003f")
        whole = udp((bytes((192, 0, 2, 1)), 47808), (bytes((192, 0, 2, 9)), 47808), told)
    path = as_pcap(tmp_path / "x.pcap", [(START + at * 10 * MS, whole) for at in range(40)])
    octets = bytearray(path.read_bytes())
    kept = len(whole) - 3
    at = len(octets) - len(whole)
    octets[at - 8 : at - 4] = kept.to_bytes(4, "little")
    path.write_bytes(octets[:-3])
    items = [item for item in read(path).items() if isinstance(item, LineEvent)]
    assert [(item.kind, item.count) for item in items] == [(LineEventKind.DROPPED, 3)]


@pytest.mark.parametrize("link_type", [147, 148, 149, 155, 162])
@pytest.mark.parametrize("write", [as_pcap, as_pcapng])
def test_bare_frames_of_any_user_link_type(tmp_path: Path, write: Callable[..., Path], link_type: int) -> None:
    frames = [_sealed(1, 3, 0, at, 0, 1) for at in range(40)]
    packets = [(START + at * 50 * MS, frame) for at, frame in enumerate(frames)]
    capture = read(write(tmp_path / "x.pcap", packets, link_type))
    assert _octets(capture) == b"".join(frames)
    held = b"".join(block.reads.octets.tobytes() for block in capture.blocks())  # type: ignore[union-attr]
    assert held == b"".join(frames)


@pytest.mark.parametrize("write", [as_pcap, as_pcapng])
def test_a_link_type_of_a_protocol_names_it(tmp_path: Path, write: Callable[..., Path]) -> None:
    frames = [bytes.fromhex(one) for one in ("dc0302", "100302494e16", "dc0203", "dc0302")]
    capture = read(write(tmp_path / "x.pcap", [(START + at * MS, one) for at, one in enumerate(frames)], 257))
    assert capture.session.protocol == "profibus"
    assert _octets(capture) == b"".join(frames)


def test_any_protocol_may_lie_in_rtac_records(tmp_path: Path) -> None:
    token = bytes.fromhex("55ff000172000084")
    records = [(START + at * 20 * MS, rtac_record(at * 20 * MS, 1 + at % 2, token)) for at in range(40)]
    path = as_pcap(tmp_path / "x.pcap", records, 250)
    assert _octets(read(path)) == token * 40
    assert main(["show", str(path), "-p", "mstp", "--json"]) == 0
