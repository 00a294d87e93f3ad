"""pcap and pcapng: what tshark makes of ours, what we make of others', and of damaged ones."""

from __future__ import annotations

import contextlib
import shutil
import struct
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.bus.capture_writer import PacketOptions, create
from sniff.bus.offline import settled
from sniff.cli import main
from sniff.engine.blocks import Block
from sniff.engine.capture import CaptureError
from sniff.engine.event_texts import SettingsChange, settings_change
from sniff.engine.session import Adapter, LineEvent, LineEventKind, Session
from sniff.formats import read
from sniff.formats.linktypes import USER1
from sniff.formats.pcapng import PcapngWriter
from sniff.formats.records import PacketRecord
from sniff.formats.text import parse
from tests.seeds import examples
from tests.sniff.formats.written_anew import write_anew

MODBUS = """\
#!sniff-capture 1
# line: 19200,8E1
# protocol: modbus-rtu
# start: 2026-03-01T10:00:00.123456789Z
+0        01 03 00 00 00 02 C4 0B
+8.2      01 03 04 00 D7 00 1A CB C0
+250      05 06 25 01 00 01 13 42
+9        05 06 25 01 00 01 13 42
+100      01 03 00 00 00 02 C4 0A
+250      01 03 00 00 00 02 C4 0B
+8.2      01 83 02 C0 F1
"""
POLL = bytes.fromhex("010300000002c40b")
TSHARK = shutil.which("tshark")
needs_tshark = pytest.mark.skipif(TSHARK is None, reason="tshark is not installed")


def converted(folder: Path, name: str, text: str = MODBUS, link_type: int | None = None) -> Path:
    capture = parse(text)
    path = folder / name
    with create(path, capture.session, PacketOptions(link_type)) as writer:
        for item in capture.items():
            writer.write(item)
    return path


def frames(path: Path) -> list[tuple[int, str]]:
    capture = read(path)
    return [(item.row.event.end, item.row.event.octets.hex()) for item in settled(capture.items(), capture.session)]


def tshark(path: Path, *names: str, options: tuple[str, ...] = ()) -> list[list[str]]:
    assert TSHARK is not None
    fields = [argument for name in names for argument in ("-e", name)]
    command = [TSHARK, "-n", "-r", str(path), *options, "-T", "fields", *fields]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    return [line.split("\t") for line in ran.stdout.splitlines()]


@pytest.mark.parametrize(
    ("name", "link_type"),
    [
        ("x.pcapng", None),
        ("x.pcapng", 147),
        ("x.pcapng", 250),
        ("x.pcap", None),
        ("x.pcap", 147),
    ],
)
def test_frames_and_their_ends_come_back(tmp_path: Path, name: str, link_type: int | None) -> None:
    before = [(item.time, item.octets.hex()) for item in parse(MODBUS).items() if isinstance(item, Chunk)]
    assert frames(converted(tmp_path, name, link_type=link_type)) == before


def test_our_pcapng_comes_back_with_its_session(tmp_path: Path) -> None:
    session = read(converted(tmp_path, "x.pcapng")).session
    assert (str(session.line), session.protocol, session.started) == (
        "19200,8E1", "modbus-rtu", 1772359200_123456789,
    )  # fmt: skip


def test_a_link_type_that_cannot_hold_the_protocol_is_refused(tmp_path: Path) -> None:
    with pytest.raises(CaptureError, match="link type 165 cannot hold modbus-rtu; possible: 252, 147, 250"):
        converted(tmp_path, "x.pcapng", link_type=165)
    assert list(tmp_path.iterdir()) == []


@needs_tshark
def test_wireshark_reads_exported_modbus_without_set_up(tmp_path: Path) -> None:
    path = converted(tmp_path, "x.pcapng")
    rows = tshark(
        path, "frame.time_epoch", "mbrtu.unit_id", "modbus.func_code", "mbrtu.crc16.status", "_ws.malformed",
        "frame.packet_flags_crc_error", "frame.comment", "ip.src",
        options=("-o", "mbrtu.tcp.port:502", "-o", "mbrtu.crc_verification:TRUE"),
    )  # fmt: skip
    assert [row[1] for row in rows] == ["1", "1", "5", "5", "1", "1", "1"]
    assert [row[2] for row in rows] == ["3", "3", "6", "6", "3", "3", "3"]
    assert [row[3] for row in rows] == ["1", "1", "1", "1", "0", "1", "1"]
    assert all(not row[4] for row in rows)
    assert [row[5] for row in rows] == ["", "", "", "", "1", "", ""]
    assert rows[0][0] == "1772359200.123456789"
    assert "response after 3.0 ms" in rows[1][6]
    assert "CRC" in rows[4][6]


@needs_tshark
def test_wireshark_tells_request_from_response_by_the_synthetic_ports(tmp_path: Path) -> None:
    assert TSHARK is not None
    command = [TSHARK, "-n", "-r", str(converted(tmp_path, "x.pcapng")), "-o", "mbrtu.tcp.port:502"]
    lines = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True).stdout.splitlines()
    assert ["Query" in line for line in lines][:4] == [True, False, True, False]
    assert "10.0.0.5 → 10.0.0.254" in lines[3]


@needs_tshark
def test_wireshark_reads_rtac_with_decode_as(tmp_path: Path) -> None:
    text = MODBUS.replace("01 03 04 00 D7 00 1A", "01 03 04 00 D7 00!P 1A")
    path = converted(tmp_path, "x.pcapng", text, 250)
    rows = tshark(path, "rtacser.eventtype", "mbrtu.unit_id", "_ws.malformed", options=("-d", "rtacser.data,mbrtu"))
    assert [row[0] for row in rows][:3] == ["0x01", "0x08", "0x02"]  # request, parity error, response
    assert [row[1] for row in rows if row[1]] == ["1", "1", "5", "5", "1", "1", "1"]
    assert all(not row[2] for row in rows)


@needs_tshark
@pytest.mark.parametrize("suffix", ["pcap", "pcapng"])
def test_wireshark_reads_our_mstp_as_the_original(tmp_path: Path, suffix: str) -> None:
    original = Path(__file__).parents[4] / "shared/captures/mstp-kargs-2009/mstp_20090227094623.pcap"
    if not original.exists():
        pytest.skip("shared captures are not here")
    capture = read(original)
    with create(tmp_path / f"x.{suffix}", capture.session) as writer:
        for item in capture.items():
            writer.write(item)
    names = ("frame.time_epoch", "mstp.frame_type", "mstp.src", "mstp.dst", "mstp.len", "mstp.checksum.status",
             "bacapp.invoke_id", "_ws.malformed", "data.data")  # fmt: skip
    assert tshark(tmp_path / f"x.{suffix}", *names) == tshark(original, *names)


def test_microseconds_and_the_other_byte_order_are_read(tmp_path: Path) -> None:
    frame = bytes.fromhex("55ff000502000042")
    for order, tick in ((">", 1000), ("<", 1000), (">", 1), ("<", 1)):
        magic = 0xA1B2C3D4 if tick == 1000 else 0xA1B23C4D
        data = struct.pack(order + "IHHiIII", magic, 2, 4, 0, 0, 65535, 165)
        data += struct.pack(order + "IIII", 7, 5, len(frame), len(frame)) + frame
        path = tmp_path / "x.pcap"
        write_anew(path, data)
        assert list(read(path).items()) == [Chunk(7_000_000_000 + 5 * tick, frame)]


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    folder = tmp_path_factory.mktemp("small")
    return {name: converted(folder, name).read_bytes() for name in ("x.pcap", "x.pcapng")}


def octets_of(path: Path) -> tuple[bytes, bool]:
    capture = read(path)
    found = b"".join(item.octets for item in capture.items() if isinstance(item, Chunk))
    return found, capture.completeness().whole


@pytest.mark.parametrize("name", ["x.pcap", "x.pcapng"])
def test_cut_anywhere_gives_what_was_before_the_cut(tmp_path: Path, small: dict[str, bytes], name: str) -> None:
    path = tmp_path / name
    write_anew(path, small[name])
    everything, _ = octets_of(path)
    whole = 0
    for size in range(len(small[name])):
        write_anew(path, small[name][:size])
        try:
            found, is_whole = octets_of(path)
        except CaptureError:
            continue
        assert everything.startswith(found)
        whole += is_whole
    assert whole < 20  # only a cut between two records looks whole


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=examples(300), deadline=None)
@given(name=st.sampled_from(["x.pcap", "x.pcapng"]), place=st.floats(0, 0.999), octet=st.integers(0, 255))
def test_any_octet_changed_is_no_traceback(
    tmp_path: Path, small: dict[str, bytes], name: str, place: float, octet: int
) -> None:
    data = bytearray(small[name])
    data[int(place * len(data))] = octet
    path = tmp_path / name
    write_anew(path, data)
    with contextlib.suppress(CaptureError):
        octets_of(path)


def test_what_is_no_frame_is_kept_in_pcapng(tmp_path: Path) -> None:
    text = MODBUS + "+300 AA BB CC\n"
    path = converted(tmp_path, "x.pcapng", text)
    everything = b"".join(item.octets for item in parse(text).items() if isinstance(item, Chunk))
    assert octets_of(path) == (everything, True)


def test_a_session_of_any_protocol_can_be_written(tmp_path: Path) -> None:
    session = Session("x", LineSettings(), "n2", 5, adapter=Adapter())
    with create(tmp_path / "x.pcapng", session) as writer:
        writer.write(Chunk(10**9, b">0104C5\r"))
    assert read(tmp_path / "x.pcapng").session.protocol == "n2"


def test_findings_stand_in_the_comments_of_their_packets(tmp_path: Path) -> None:
    from sniff.cli import main
    from sniff.formats.pcapng import PcapngCapture

    source, target = tmp_path / "x.cap.txt", tmp_path / "x.pcapng"
    source.write_text(MODBUS)
    assert main(["convert", str(source), str(target)]) == 0
    with target.open("rb") as stream:
        comments = [record.comment for record in PcapngCapture(target)._records(stream)]
    assert "MB008 station 1: exception 2 (illegal data address)" in comments[-1]
    assert "MB008" not in comments[0]


def test_what_a_search_heard_is_told_by_a_value_and_not_by_the_words_of_a_comment(tmp_path: Path) -> None:
    session = replace(parse(MODBUS).session, unknown=("line",))
    path, words = tmp_path / "x.pcapng", "10 octets heard while searching for the settings, with 4800,8N1"
    tried = LineSettings.parse("4800,8N1")
    with contextlib.closing(PcapngWriter(path, session, 147)) as writer:
        writer.put([PacketRecord(1000, USER1, b"ab", words, searched=tried), PacketRecord(2000, USER1, b"cd", words)])
    items = list(read(path).items())
    assert [settings_change(item) for item in items if isinstance(item, LineEvent)] == [
        SettingsChange(tried, searching=True),
        SettingsChange(session.line),
        SettingsChange(session.line, session.protocol, found=True),
    ]


def block(kind: int, body: bytes) -> bytes:
    size = struct.pack("<I", len(body) + 12)
    return struct.pack("<I", kind) + size + body + size


def option(code: int, value: bytes = b"") -> bytes:
    return struct.pack("<HH", code, len(value)) + value + b"\0" * (-len(value) % 4)


def made(path: Path, comment: bytes = b"", interface: bytes = b"", ticks: int = 1) -> Path:
    """A pcapng file of one poll, with options as somebody hostile would write them."""
    about = option(1, comment) + option(0) if comment else b""
    packet = struct.pack("<IIIII", 0, ticks >> 32, ticks & 0xFFFFFFFF, len(POLL), len(POLL)) + POLL
    write_anew(
        path,
        block(0x0A0D0D0A, struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1) + about)
        + block(1, struct.pack("<HHI", 147, 0, 0) + interface + option(0))
        + block(6, packet),
    )
    return path


@pytest.mark.parametrize("nested", [b"[" * 60_000, b'{"a":' * 10_000], ids=["list", "object"])
def test_a_session_nested_without_end_is_no_session(tmp_path: Path, nested: bytes) -> None:
    capture = read(made(tmp_path / "deep.pcapng", b"sniff485 session: " + nested))
    assert [item.octets for item in capture.items() if isinstance(item, Chunk)] == [POLL]


@pytest.mark.parametrize(
    ("interface", "ticks"),
    [
        (option(9, b"\0"), (1 << 64) - 1),
        (option(14, struct.pack("<q", (1 << 63) - 1)), 1),
        (option(14, struct.pack("<q", -1 << 63)), 1),
    ],
    ids=["seconds", "late", "early"],
)
def test_times_beyond_all_clocks(tmp_path: Path, interface: bytes, ticks: int) -> None:
    from sniff.cli import main

    path = made(tmp_path / "far.pcapng", interface=interface, ticks=ticks)
    assert main(["check", str(path), "--fail-on", "never"]) == 0
    for name in ("far.mcap", "far.cap.txt", "far2.pcapng", "far.pcap"):
        assert main(["convert", str(path), str(tmp_path / name)]) == 0
        assert [item.octets for item in read(tmp_path / name).items() if isinstance(item, Chunk)] == [POLL]


def test_times_in_microseconds_for_readers_that_know_no_nanoseconds(tmp_path: Path) -> None:
    source = Path(__file__).parents[3] / "captures/mstp-clean.cap.txt"
    fine, coarse = tmp_path / "fine.pcap", tmp_path / "coarse.pcap"
    assert main(["convert", str(source), str(fine)]) == 0
    assert main(["convert", str(source), str(coarse), "--microseconds"]) == 0
    assert coarse.read_bytes()[:4] == b"\xd4\xc3\xb2\xa1"
    one, two = ([item for item in read(path).items() if isinstance(item, Chunk)] for path in (fine, coarse))
    assert [chunk.octets for chunk in one] == [chunk.octets for chunk in two]
    assert [chunk.time // 1000 * 1000 for chunk in one] == [chunk.time for chunk in two]
    assert main(["convert", str(source), str(tmp_path / "x.pcapng"), "--microseconds"]) == 2


def test_packets_that_the_capturing_host_dropped_are_a_hole_before_the_next(tmp_path: Path) -> None:
    head = struct.pack("<IIII", 0, 0, 1000, len(POLL)) + struct.pack("<I", len(POLL)) + POLL + b"\0" * (-len(POLL) % 4)
    dropped = head + option(4, struct.pack("<Q", 3)) + option(0)
    old = struct.pack("<HHIIII", 0, 2, 0, 2000, len(POLL), len(POLL)) + POLL + b"\0" * (-len(POLL) % 4)
    unsaid = struct.pack("<HHIIII", 0, 0xFFFF, 0, 3000, len(POLL), len(POLL)) + POLL + b"\0" * (-len(POLL) % 4)
    path = tmp_path / "dropped.pcapng"
    write_anew(
        path,
        block(0x0A0D0D0A, struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1))
        + block(1, struct.pack("<HHI", 147, 0, 0) + option(0))
        + block(6, head) * 40
        + block(6, dropped)
        + block(6, head) * 40
        + block(2, old)
        + block(2, unsaid),
    )
    capture = read(path)
    row_by_row = list(capture.items())
    holes = [at for at, item in enumerate(row_by_row) if not isinstance(item, Chunk)]
    assert holes == [40, 82]
    assert [row_by_row[at].text for at in holes] == [f"{n} packets dropped by who captured" for n in (3, 2)]
    assert all(row_by_row[at].kind is LineEventKind.DROPPED and row_by_row[at].count == -1 for at in holes)
    parts = (one.chunks() if isinstance(one, Block) else [one] for one in capture.blocks())
    assert [item for part in parts for item in part] == row_by_row
