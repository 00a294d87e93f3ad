"""Files are told by what is in them; the suffix only breaks ties, and what is no capture is refused by its name."""

from __future__ import annotations

import bz2
import gzip
import lzma
import random
import shutil
import tarfile
from collections.abc import Callable
from pathlib import Path

import pytest
import zstandard

from dissectors.frame import Chunk
from sniff.bus.capture_writer import create
from sniff.engine.capture import Capture, CaptureError
from sniff.formats import compressed, read, table, unpacking
from sniff.formats.raw_dump import RawDump
from sniff.formats.text import TextCapture, parse

POLL = parse("#!sniff-capture 1\n# line: 19200,8E1\n+0 01 03 00 00 00 02 C4 0B\n+9 01 03 04 00 D7 00 00 4B C5\n")
PACKERS: dict[str, Callable[[bytes], bytes]] = {
    ".gz": gzip.compress,
    ".bz2": bz2.compress,
    ".xz": lzma.compress,
    ".zst": zstandard.ZstdCompressor().compress,
}


def octets(capture: Capture) -> bytes:
    return b"".join(item.octets for item in capture.items() if isinstance(item, Chunk))


def written(folder: Path, suffix: str) -> Path:
    path = folder / f"seed{suffix}"
    with create(path, POLL.session) as writer:
        for item in POLL.items():
            writer.write(item)
    return path


@pytest.mark.parametrize("name", ["x.mcap", "x.pcap", "x.pcapng", "x.cap.txt", "x.log", "x.bin", "x", "x.sr"])
@pytest.mark.parametrize("suffix", [".mcap", ".pcap", ".pcapng", ".cap.txt"])
def test_any_format_under_any_name(suffix: str, name: str, tmp_path: Path) -> None:
    shutil.copy(written(tmp_path, suffix), tmp_path / name)
    assert octets(read(tmp_path / name)) == octets(POLL)


@pytest.mark.parametrize("packed", PACKERS)
@pytest.mark.parametrize("suffix", [".mcap", ".pcap", ".pcapng", ".cap.txt"])
def test_packed_files(suffix: str, packed: str, tmp_path: Path) -> None:
    made = PACKERS[packed](written(tmp_path, suffix).read_bytes())
    for name in (f"x{suffix}{packed}", "x.bin", f"x{suffix}"):
        (tmp_path / name).write_bytes(made)
        assert octets(read(tmp_path / name)) == octets(POLL)


@pytest.mark.parametrize("packed", PACKERS)
def test_packed_files_cut_anywhere(packed: str, tmp_path: Path) -> None:
    made, path = PACKERS[packed](written(tmp_path, ".cap.txt").read_bytes()), tmp_path / f"x.cap.txt{packed}"
    for end in range(len(made)):
        path.write_bytes(made[:end])
        try:
            capture = read(path)
            list(capture.items())
        except CaptureError as error:
            assert str(error).count("\n") == 0  # noqa: PT017
        else:
            if not isinstance(capture, RawDump):  # too short to be told
                assert end > 12
                assert not capture.completeness().whole


@pytest.mark.parametrize("packed", PACKERS)
def test_a_bomb_is_refused(packed: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(unpacking, "LITTLE", 1 << 20)
    path = tmp_path / f"x.log{packed}"
    path.write_bytes(PACKERS[packed](bytes(20 << 20)))
    with pytest.raises(CaptureError, match="unpack it yourself"):
        read(path)


def test_packed_without_end(tmp_path: Path) -> None:
    path, made = tmp_path / "x", b"01 03\n"
    for _ in range(compressed.DEEPEST):
        made = gzip.compress(made)
    path.write_bytes(made)
    assert octets(read(path)) == b"\x01\x03"
    path.write_bytes(gzip.compress(made))
    with pytest.raises(CaptureError, match="gzip in gzip"):
        read(path)


@pytest.mark.parametrize(("magic", "what"), table.UNREADABLE)
def test_what_is_no_capture_is_refused_by_its_name(magic: bytes, what: str, tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    path.write_bytes(magic + random.Random(1).randbytes(400))
    with pytest.raises(CaptureError, match=what.split(";")[0].replace("(", ".")):
        read(path)


@pytest.mark.parametrize("wrapped", [False, True])
def test_a_tar_archive_is_refused_by_its_name(wrapped: bool, tmp_path: Path) -> None:
    (tmp_path / "night.log").write_text("10:00:00.100 01 03 00 00 00 02 C4 0B\n")
    path = tmp_path / ("x.tar.gz" if wrapped else "x.log")
    with tarfile.open(path, "w:gz" if wrapped else "w") as archive:
        archive.add(tmp_path / "night.log", "night.log")
    with pytest.raises(CaptureError, match="a tar archive; unpack it"):
        read(path)


def test_raw_dumps(tmp_path: Path) -> None:
    heard = octets(POLL) * 700
    for name in ("x.bin", "x", "x.log", "x.txt"):
        (tmp_path / name).write_bytes(heard)
        capture = read(tmp_path / name)
        assert isinstance(capture, RawDump)
        assert octets(capture) == heard
    heading = b"=~=~=~=~=~=~=~=~=~=~=~= PuTTY log 2026.03.01 10:00:00 =~=~=~=~=~=~=~=~=~=~=~=\r\n"
    for frames in (heard, b":010300000002FA\r\n:0183027A\r\n", b">01429131\r\r"):
        (tmp_path / "putty.log").write_bytes(heading + frames)
        assert octets(read(tmp_path / "putty.log")) == frames


def test_a_text_capture_in_a_text_file(tmp_path: Path) -> None:
    (tmp_path / "x.txt").write_text("# a poll\n+0 01 03\n")
    assert isinstance(read(tmp_path / "x.txt"), TextCapture)


def test_every_format_has_a_name_a_suffix_and_a_way_in_or_out() -> None:
    for one in table.formats():
        assert one.name
        assert one.suffixes or one.content
        assert all(suffix.startswith(".") and suffix == suffix.lower() for suffix in one.suffixes)
        assert one.magics or one.content
        for target in (one.reader, one.items_writer, one.frames_writer, one.content):
            assert not target or callable(table.function(target))


@pytest.mark.parametrize("name", ["x.log", "x.pcap", "x.mcap", "x.cap.txt", "x"])
def test_an_empty_file_is_said_whatever_its_name_is(name: str, tmp_path: Path) -> None:
    (tmp_path / name).touch()
    with pytest.raises(CaptureError, match="an empty file"):
        read(tmp_path / name)


@pytest.mark.parametrize(
    "around", ["\x1b]0;root@pi: ~\x07", "\x1b]0;pi\x1b\\", "\x1b[?2004h\x1b[0;36m", "\x1b(B\x1b[m"]
)
def test_the_output_of_a_terminal_is_text(around: str, tmp_path: Path) -> None:
    path = tmp_path / "typescript"
    path.write_text("".join(f"{around}10:00:0{at}.000 RX: 01 03 00 00 00 02 C4 0B\x1b[0m\r\n" for at in range(8)))
    assert [item.octets.hex() for item in read(path).items() if isinstance(item, Chunk)] == ["010300000002c40b"] * 8


@pytest.mark.parametrize("packed", PACKERS)
@pytest.mark.parametrize("padding", [0, 512, 70_000])
def test_packed_files_of_several_streams(packed: str, padding: int, tmp_path: Path) -> None:
    """As programs make them that pack with several processors, and tapes that fill up with zeros."""
    if packed == ".zst" and padding:
        return
    made, path = written(tmp_path, ".cap.txt").read_bytes(), tmp_path / f"x.cap.txt{packed}"
    pack = PACKERS[packed]
    path.write_bytes(pack(made[:-30]) + bytes(padding) + pack(made[-30:]) + bytes(padding))
    assert octets(read(path)) == octets(POLL)
    assert read(path).completeness().whole


@pytest.mark.parametrize("packed", PACKERS)
def test_behind_a_packed_file_something_else(packed: str, tmp_path: Path) -> None:
    path = tmp_path / f"x.cap.txt{packed}"
    path.write_bytes(PACKERS[packed](written(tmp_path, ".cap.txt").read_bytes()) + b"something else")
    assert octets(read(path)) == octets(POLL)
    assert "damaged or cut" in read(path).completeness().text
