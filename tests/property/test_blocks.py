"""Blocks of a capture are its items: same octets, times, reads, marks and line events at the same places, whatever the
format, wherever the file is cut or damaged."""

from __future__ import annotations

import random
import struct
from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dissectors.frame import Chunk, LineError, Mark
from dissectors.line import LineSettings
from sniff import formats
from sniff.bus import capture_writer
from sniff.engine.blocks import BLOCK_OCTETS, BLOCK_READS, Block, blocks_of, plain_reads
from sniff.engine.capture import Capture, CaptureError
from sniff.engine.event_texts import SettingsChange
from sniff.engine.session import Item, LineEvent, LineEventKind, Session
from sniff.formats import pcap_walk, pcapng, pcapng_walk
from sniff.formats.linktypes import RTAC, rtac_record
from sniff.formats.table import suffixes
from sniff.recording.rotated import RotatedCapture
from sniff.recording.rotation import Rotation
from sniff.recording.writer import Recorder
from tests.captures_shared import CAPTURES as SHARED
from tests.seeds import IS_SEARCH, MOST_READS, some

OWN = Path(__file__).parents[2] / "captures"
LARGE = 1 << 20
"""Octets of a file that is only read where one searches."""

BASE = 1_772_359_200_000_000_000
MS = 1_000_000
LINE = LineSettings(38400, 8, "N", 1)
SESSION = Session("/dev/ttyUSB0", LINE, "mstp", BASE, "bus")
TOKEN = bytes.fromhex("55ff0002010000") + b"\x8a"
LONG = 1 << (20 if IS_SEARCH else 16)
"""Octets from which on only MOST_READS items of a text are compared."""

RELAXED = settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


# -- what is compared ------------------------------------------------------------------------------------------


def unpacked(blocks: Iterable[Block | LineEvent]) -> Iterator[Item]:
    """Items of blocks that keep to their contract."""
    for block in blocks:
        if isinstance(block, LineEvent):
            yield block
            continue
        reads = block.reads
        assert len(reads)
        assert reads.lengths.min() > 0
        assert reads.before is None
        assert reads.octets.dtype == np.uint8
        assert reads.times.dtype == reads.lengths.dtype == np.int64
        assert len(reads.octets) == reads.lengths.sum()
        assert len(reads.times) == len(reads.lengths) == len(reads.marked)
        assert np.flatnonzero(reads.marked).tolist() == sorted(block.marks)
        assert len(reads) < 2 * BLOCK_READS
        assert len(reads.octets) < 2 * BLOCK_OCTETS or reads.lengths.max() > BLOCK_OCTETS
        yield from block.chunks()


def told(items: Iterable[Item]) -> list[Item | str]:
    """Items that say something, and the error that ended them."""
    found: list[Item | str] = []
    try:
        for item in items:
            if isinstance(item, LineEvent) or item.octets:
                found.append(item)
    except CaptureError as error:
        found.append(str(error))
    return found


def same(capture: Capture) -> list[Item | str]:
    """What a capture holds, which it gives both ways."""
    items = told(capture.items())
    whole = capture.completeness()
    assert told(unpacked(capture.blocks())) == items
    assert capture.completeness() == whole
    return items


def same_file(path: Path) -> list[Item | str]:
    try:
        capture = formats.read(path)
    except CaptureError:
        return []
    if path.suffix == ".txt" and path.stat().st_size > LONG:  # its lines are all read alike
        items = told(islice(capture.items(), MOST_READS))
        assert told(islice(unpacked(capture.blocks()), MOST_READS)) == items
        return items
    return same(capture)


# -- buses -----------------------------------------------------------------------------------------------------


def bus(reads: int, seed: int = 1, strange: float = 0.0) -> list[Item]:
    """Tokens and longer frames, a read each; a share of them marked, long, empty, backwards, or after an event."""
    dice = random.Random(seed)
    now = BASE
    items: list[Item] = []
    for number in range(reads):
        now += dice.randrange(2 * MS, 5 * MS)
        octets = TOKEN if dice.random() < 0.7 else dice.randbytes(dice.randrange(1, 60))
        marks: tuple[Mark, ...] = ()
        if dice.random() < strange:
            match dice.randrange(6):
                case 0:
                    marks = (Mark(dice.randrange(len(octets)), LineError.PARITY), Mark(0, LineError.BREAK))
                case 1:
                    items.append(LineEvent(now, LineEventKind.DROPPED, "too busy", number))
                case 2:
                    octets = dice.randbytes(dice.choice((66_000, 140_000)))
                    marks = (Mark(65_540, LineError.FRAMING),)
                case 3:
                    now -= dice.randrange(3_000 * MS)
                case 4:
                    octets = b""
                case 5:
                    change = SettingsChange(LINE, searching=dice.random() < 0.5)
                    items.append(LineEvent(now, LineEventKind.SETTINGS, str(change)))
        items.append(Chunk(now, octets, marks))
    return items


def written(path: Path, items: Iterable[Item], session: Session = SESSION, link_type: int | None = None) -> Path:
    with capture_writer.create(path, session, capture_writer.PacketOptions(link_type)) as writer:
        for item in items:
            writer.write(item)
    return path


def pcap_of(records: Iterable[tuple[int, bytes]], order: str = "<", nanoseconds: bool = True, link_type: int = 165,
            longer: int = 0) -> bytes:  # fmt: skip
    """A pcap file; `longer`: how much longer than what was kept each record was on the wire."""
    magic = 0xA1B23C4D if nanoseconds else 0xA1B2C3D4
    tick = 1 if nanoseconds else 1000
    parts = [struct.pack(order + "IHHiIII", magic, 2, 4, 0, 0, 65535, link_type)]
    for time, data in records:
        seconds, rest = divmod(time, 1_000_000_000)
        parts += [struct.pack(order + "IIII", seconds, rest // tick, len(data), len(data) + longer), data]
    return b"".join(parts)


def ng_block(order: str, kind: int, body: bytes) -> bytes:
    size = struct.pack(order + "I", len(body) + 12 + -len(body) % 4)
    return struct.pack(order + "I", kind) + size + body + bytes(-len(body) % 4) + size


def ng_section(order: str, *interfaces: tuple[int, bytes]) -> bytes:
    """A section's head and its interfaces: link type and options."""
    head = ng_block(order, pcapng.SECTION, struct.pack(order + "IHHq", 0x1A2B3C4D, 1, 0, -1))
    return head + b"".join(
        ng_block(order, pcapng.INTERFACE, struct.pack(order + "HHI", link_type, 0, 0) + options)
        for link_type, options in interfaces
    )


def ng_packet(order: str, interface: int, stamp: int, data: bytes, options: bytes = b"") -> bytes:
    head = struct.pack(order + "IIIII", interface, stamp >> 32, stamp & 0xFFFFFFFF, len(data), len(data))
    return ng_block(order, pcapng.ENHANCED, head + data + bytes(-len(data) % 4) + options)


def records(many: int, seed: int = 1) -> list[tuple[int, bytes]]:
    return [(item.time, item.octets) for item in bus(many, seed) if isinstance(item, Chunk)]


# -- captures that are here ------------------------------------------------------------------------------------


def _captures(folder: Path) -> list[Path]:
    return sorted(
        path for path in folder.rglob("*") if path.name.endswith(suffixes()) and not path.name.endswith(".expect.txt")
    )


@pytest.mark.parametrize("path", some(_captures(OWN), 3), ids=lambda path: path.name)
def test_own_captures(path: Path) -> None:
    same_file(path)


def _shared() -> list[Path]:
    return list(some([path for path in _captures(SHARED) if IS_SEARCH or path.stat().st_size < LARGE], 2))


@pytest.mark.parametrize("path", _shared() or [None], ids=lambda path: path.name if path else "none")
def test_shared_captures(path: Path | None) -> None:
    if path is None:
        pytest.skip("shared captures are not here")
    try:
        same_file(path)
    except CaptureError as error:
        if "--bus NAME" not in str(error):
            raise
        pytest.skip("several buses: each is read by its name")


# -- written and read ------------------------------------------------------------------------------------------

SUFFIXES = (".mcap", ".pcap", ".pcapng", ".cap.txt")


@pytest.mark.parametrize("strange", [0.0, 0.01, 0.3])
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_every_writable_format(tmp_path: Path, suffix: str, strange: float) -> None:
    items = bus(300 if suffix == ".cap.txt" and strange == 0.3 else 900, 3, strange)  # long reads make a long text
    found = same_file(written(tmp_path / f"bus{suffix}", items))
    if suffix == ".mcap" and strange <= 0.01:
        assert found == told(items)


@pytest.mark.parametrize(("protocol", "link_type"), [("modbus-rtu", 250), ("modbus-rtu", 252), ("n2", 147)])
@pytest.mark.parametrize("suffix", [".pcap", ".pcapng"])
def test_link_types(tmp_path: Path, suffix: str, protocol: str, link_type: int) -> None:
    source = formats.read(OWN / ("rtu-usual-faults.cap.txt" if protocol == "modbus-rtu" else "n2-usual-faults.cap.txt"))
    path = written(tmp_path / f"bus{suffix}", source.items(), source.session, link_type)
    same_file(path)


def test_a_record_that_lacks_the_header_of_its_link_type(tmp_path: Path) -> None:
    data = [rtac_record(number, 1 if number % 50 else 7 + number % 4, TOKEN[: number % 9]) for number in range(400)]
    data[60:62] = [b"", b"short"]
    path = tmp_path / "rtac.pcap"
    path.write_bytes(pcap_of([(BASE + n * MS, each) for n, each in enumerate(data)], link_type=RTAC))
    capture = formats.read(path)
    capture.session = replace(capture.session, protocol="modbus-rtu")
    assert any(isinstance(item, LineEvent) for item in same(capture))


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("nanoseconds", [True, False])
@pytest.mark.parametrize("longer", [0, 5])
def test_pcap_of_others(tmp_path: Path, order: str, nanoseconds: bool, longer: int) -> None:
    path = tmp_path / "bus.pcap"
    some = records(700)
    path.write_bytes(pcap_of(some, order, nanoseconds, longer=longer))
    assert [item.octets for item in same_file(path) if isinstance(item, Chunk)] == [octets for _, octets in some]


def test_octets_that_look_like_records(tmp_path: Path) -> None:
    inner = pcap_of(records(20, 2))[24:]
    some = [(BASE + number * MS, inner if number % 5 == 2 else TOKEN) for number in range(300)]
    path = tmp_path / "bus.pcap"
    path.write_bytes(pcap_of(some))
    assert len(same_file(path)) == 300
    inner = b"".join(ng_packet("<", 0, BASE // 1000, TOKEN) for _ in range(20))
    path = tmp_path / "bus.pcapng"
    packets = (ng_packet("<", 0, time // 1000, inner if n % 5 == 2 else TOKEN) for n, (time, _) in enumerate(some))
    path.write_bytes(ng_section("<", (165, b"")) + b"".join(packets))
    assert len(same_file(path)) == 300


def test_windows_end_anywhere_in_a_record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    some = records(400, 4)
    path, other = tmp_path / "bus.pcap", tmp_path / "bus.pcapng"
    path.write_bytes(pcap_of(some))
    other.write_bytes(
        ng_section("<", (165, b"")) + b"".join(ng_packet("<", 0, time // 1000, octets) for time, octets in some)
    )
    for window in (100, 101, 350, 1024, 4999):
        monkeypatch.setattr(pcap_walk, "WINDOW", window)
        monkeypatch.setattr(pcapng_walk, "WINDOW", window)
        assert len(same_file(path)) == len(same_file(other)) == 400


RESOLUTIONS = [b"", b"\x09\x00\x01\x00\x09\0\0\0", b"\x09\x00\x01\x00\x94\0\0\0", b"\x09\x00\x01\x00\x1e\0\0\0",
               b"\x0e\x00\x08\x00\x10\x0e\0\0\0\0\0\0"]  # fmt: skip


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("resolution", RESOLUTIONS)
def test_pcapng_of_others(tmp_path: Path, order: str, resolution: bytes) -> None:
    comment = struct.pack(order + "HH", 1, 5) + b"hello\0\0\0" + bytes(4)
    said = b"sniff485 search: 9600,8N1"
    searched = struct.pack(order + "HH", 1, len(said)) + said + bytes(-len(said) % 4 + 4)
    parts = [ng_section(order, (165, resolution), (148, resolution), (1, b""), (165, RESOLUTIONS[1]))]
    for number, (time, octets) in enumerate(records(800)):
        interface = 0 if number % 90 else (number // 90) % 5  # that of the last one does not exist
        stamp = time if number != 400 else (1 << 64) - 1
        if interface == 0 and resolution == b"":
            stamp //= 1000
        options = comment if number % 100 == 7 else searched if 300 <= number < 310 else b""
        parts.append(ng_packet(order, interface, stamp, octets if number % 50 else b"", options))
        if number == 500:
            parts.append(ng_block(order, pcapng.SIMPLE, struct.pack(order + "I", 8) + TOKEN))
            parts.append(ng_block(order, 0x0BAD, b"what nobody knows"))
        if number == 600:  # a section in the other order
            order = "<" if order == ">" else ">"
            parts.append(ng_section(order, (165, b"")))
            comment = searched = b""
    path = tmp_path / "bus.pcapng"
    path.write_bytes(b"".join(parts))
    assert len(same_file(path)) > 700


def test_blocks_larger_than_a_window(tmp_path: Path) -> None:
    large = ng_block("<", 0x0BAD, bytes(3 << 20)), ng_packet("<", 0, BASE // 1000, bytes(1 << 20))
    parts = [ng_section("<", (165, b""))]
    for number in range(100):
        parts.append(ng_packet("<", 0, BASE // 1000 + number, TOKEN))
        if number % 40 == 20:
            parts += large
    path = tmp_path / "bus.pcapng"
    path.write_bytes(b"".join(parts))
    assert len(same_file(path)) == 102


# -- recordings ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("strange", [0.0, 0.05])
def test_rotated_parts(tmp_path: Path, strange: float) -> None:
    recorder = Recorder(tmp_path / "night.mcap", SESSION, Rotation(count=150))
    for item in bus(1000, 5, strange):
        recorder.line(item) if isinstance(item, LineEvent) else recorder.chunk(item)
    recorder.close()
    parts = [formats.read(path) for path in sorted(tmp_path.glob("night-*.mcap"))]
    assert len(parts) >= 4
    for part in parts:
        same(part)
    same(RotatedCapture(parts))  # type: ignore[arg-type]
    same(RotatedCapture(parts[:2] + parts[3:]))  # type: ignore[arg-type]


@pytest.mark.parametrize("strange", [0.0, 0.05])
def test_from_a_time_on(tmp_path: Path, strange: float) -> None:
    from sniff.recording import reader

    items = bus(3000, 6, strange)
    capture = reader.read(written(tmp_path / "bus.mcap", items))
    capture.completeness()
    for item in items[:: len(items) // 7]:
        for since in (item.time, item.time + 1):
            assert told(unpacked(capture.blocks(since))) == told(capture.items(since))


def test_a_recording_that_begins_within_a_search(tmp_path: Path) -> None:
    session = replace(SESSION, protocol="", line=LINE)
    for strange in (0.0, 0.1):
        path = written(tmp_path / "bus.mcap", bus(600, 7, strange), session)
        same_file(path)


# -- cut and damaged -------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The same bus in every format, and packet files with a header before each frame."""
    folder = tmp_path_factory.mktemp("files")
    found = {}
    for suffix in SUFFIXES:  # a read of 66 000 octets is in the first bus: as text it is nearly all of the file
        items = bus(600, 9 if suffix == ".cap.txt" else 8, 0.01)
        found[f"bus{suffix}"] = written(folder / f"bus{suffix}", items).read_bytes()
    found["plain.mcap"] = written(folder / "plain.mcap", bus(5000, 9)).read_bytes()
    source = formats.read(OWN / "rtu-usual-faults.cap.txt")
    for link_type in (250, 252):
        for suffix in (".pcap", ".pcapng"):
            path = folder / f"{link_type}{suffix}"
            found[path.name] = written(path, source.items(), source.session, link_type).read_bytes()
    return found


NAMES = [*(f"bus{suffix}" for suffix in SUFFIXES), "plain.mcap", "250.pcap", "250.pcapng", "252.pcap", "252.pcapng"]


@pytest.mark.parametrize("name", NAMES)
def test_cut_at_any_octet(tmp_path: Path, files: dict[str, bytes], name: str) -> None:
    whole = files[name]
    dice = random.Random(10)
    ends = [*range(len(whole) - 10, len(whole)), *(dice.randrange(len(whole)) for _ in range(10))]
    for end in ends:
        path = tmp_path / name
        path.write_bytes(whole[:end])
        same_file(path)


@settings(RELAXED, max_examples=1000 if IS_SEARCH else 12)
@given(data=st.data())
@pytest.mark.parametrize("name", NAMES)
def test_damaged_octets(tmp_path: Path, files: dict[str, bytes], name: str, data: st.DataObject) -> None:
    octets = bytearray(files[name])
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(octets) - 1))
        octets[at : at + 1] = data.draw(st.binary(max_size=4))
    path = tmp_path / name
    path.write_bytes(octets)
    same_file(path)


# -- no object a read ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".mcap", ".pcap", ".pcapng"])
@pytest.mark.parametrize("link_type", [165, 250, 252])
def test_a_clean_capture_is_never_read_item_by_item(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str, link_type: int
) -> None:
    if link_type == 165:
        items, session, of_type = bus(2000), SESSION, None
    else:
        clean = formats.read(OWN / "rtu-clean.cap.txt")
        items, session, of_type = list(clean.items()), clean.session, link_type
    path = written(tmp_path / f"bus{suffix}", items, session, of_type if suffix != ".mcap" else None)
    capture = formats.read(path)
    expected = told(capture.items())

    def never(*_: object) -> Iterator[Item]:
        raise AssertionError("an object a read")

    for place in ("formats.pcap.items_of", "formats.pcapng.items_of", "formats.packet_columns.items_of"):
        monkeypatch.setattr(f"sniff.{place}", never)
    monkeypatch.setattr("sniff.recording.joiner.Joiner.raw", never)
    assert told(unpacked(capture.blocks())) == expected


# -- pieces ----------------------------------------------------------------------------------------------------


def test_columns_and_chunks_and_events_join_in_their_order() -> None:
    columns = plain_reads(np.frombuffer(b"abc", np.uint8), np.array([1, 2]), np.array([1, 2]))
    mark = (Mark(0, LineError.PARITY),)
    event = LineEvent(4, LineEventKind.DROPPED, "x", 1)
    items = [Chunk(0, b"z", mark), columns, Chunk(3, b""), Chunk(3, b"d", mark), event, columns]
    blocks = list(blocks_of(items))
    assert [len(block) if isinstance(block, Block) else block for block in blocks] == [4, event, 2]
    assert list(unpacked(blocks)) == [
        Chunk(0, b"z", mark), Chunk(1, b"a"), Chunk(2, b"bc"), Chunk(3, b"d", mark), event,
        Chunk(1, b"a"), Chunk(2, b"bc"),
    ]  # fmt: skip


def test_times_that_no_64_bits_hold() -> None:
    (block,) = blocks_of([Chunk(1 << 70, b"a"), Chunk(-(1 << 70), b"b")])
    assert isinstance(block, Block)
    assert block.reads.times.tolist() == [(1 << 63) - 1, -(1 << 63)]


@pytest.mark.parametrize("suffix", [".mcap", ".pcap", ".pcapng"])
def test_a_block_is_bounded(tmp_path: Path, suffix: str) -> None:
    many = 3 * BLOCK_READS
    path = tmp_path / f"bus{suffix}"
    if suffix == ".mcap":
        written(path, (Chunk(BASE + n * MS, TOKEN[: 1 + n % 8]) for n in range(many)))
    elif suffix == ".pcap":
        path.write_bytes(pcap_of((BASE + n * MS, b"\x55") for n in range(many)))
    else:
        path.write_bytes(ng_section("<", (165, b"")) + ng_packet("<", 0, BASE // 1000, b"\x55") * many)
    sizes = [len(block) for block in formats.read(path).blocks() if isinstance(block, Block)]
    assert sum(sizes) == many
    assert max(sizes) < 2 * BLOCK_READS
