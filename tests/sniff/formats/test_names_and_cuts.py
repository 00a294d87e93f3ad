"""Files whose name lies, whose packing is cut, whose times have no date."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from pathlib import Path

import pytest
import zstandard

from dissectors.frame import Chunk
from sniff.cli import main
from sniff.engine.capture import CaptureError
from sniff.formats import read

LOGS = Path(__file__).parents[3] / "captures" / "logs"
HEARD = b"".join(bytes.fromhex(line) for line in (LOGS / "qmodmaster.frames").read_text().splitlines())


@pytest.mark.parametrize("suffix", [".pcap", ".pcapng", ".mcap", ".sr", ".vcd", ".cap"])
def test_octets_as_they_were_heard_under_any_name(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"x{suffix}"
    path.write_bytes(HEARD)
    capture = read(path)
    assert b"".join(item.octets for item in capture.items() if isinstance(item, Chunk)) == HEARD
    assert "its name says" in capture.completeness().text


def test_what_is_no_frames_is_not_taken_from_its_format(tmp_path: Path) -> None:
    path = tmp_path / "x.pcap"
    path.write_bytes(bytes((number * 7919 >> 3) & 255 for number in range(5000)))
    with pytest.raises(CaptureError, match=r"not a pcap file.*name it \.bin"):
        read(path)


def in_blocks_of_zstd(text: bytes) -> bytes:
    """Some blocks, as of a long file: of a cut one all before the last is there."""
    packing = zstandard.ZstdCompressor().compressobj()
    parts = (text[at : at + 4000] for at in range(0, len(text), 4000))
    blocks = [packing.compress(part) + packing.flush(zstandard.COMPRESSOBJ_FLUSH_BLOCK) for part in parts]
    return b"".join(blocks) + packing.flush()


@pytest.mark.parametrize("pack", [gzip.compress, in_blocks_of_zstd], ids=["gzip", "zstd"])
def test_a_cut_packing_gives_all_before_and_exit_code_3(
    pack: Callable[[bytes], bytes], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (LOGS / "qmodmaster.log").read_bytes() * 12
    packed = pack(text)
    path = tmp_path / "x.log.packed"
    path.write_bytes(packed[: len(packed) - 8])
    for command in ("show", "info"):
        assert main([command, str(path)]) == 3
        out, err = capsys.readouterr()
        assert len(out.splitlines()) > 2
        assert f"{path}: " in err
        assert "damaged or cut" in err
    assert main(["convert", str(path), str(tmp_path / "y.mcap")]) == 3
    assert any(isinstance(item, Chunk) for item in read(tmp_path / "y.mcap").items())


def test_a_file_without_a_date_shows_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "x.log"
    path.write_text(
        "-0.5 TX 01 03 00 00 00 02 C4 0B\n0.25 RX 01 03 04 00 D7 00 1A CB C0\n0.5 TX 01 03 00 00 00 02 C4 0B\n"
    )
    times = [item.time for item in read(path).items()]
    assert min(times) >= 0
    assert times[1] - times[0] == 750_000_000
    assert main(["info", str(path)]) == 0
    out = capsys.readouterr().out
    assert "no date" in out
    assert "19" not in [word[:2] for word in out.split() if word.count("-") == 2]
