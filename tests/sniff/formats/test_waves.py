"""Captures of logic analysers: settings found, errors marked, channels of one bus joined; every kind of file."""

from __future__ import annotations

import contextlib
import random
import zipfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from dissectors.checksums import crc16_modbus
from dissectors.frame import Chunk, LineError
from dissectors.line import LineSettings
from sniff.cli import main
from sniff.engine.capture import Capture, CaptureError
from sniff.formats import logic_capture, read, vcd
from sniff.formats.saleae import DigitalBinary, is_digital_csv
from sniff.formats.several_buses import SeveralBuses, chosen
from sniff.formats.uart import Decoder, Uart
from sniff.formats.uart_finding import decoded, find
from tests.captures_shared import CAPTURES
from tests.seeds import IS_SEARCH
from tests.sniff.formats.waves_made import as_binary, as_csv, as_sigrok, as_vcd, edges_of
from tests.sniff.formats.written_anew import write_anew

MS = 1_000_000
RTU = LineSettings.parse("19200,8E1")


def _sealed(*octets: int) -> bytes:
    body = bytes(octets)
    return body + crc16_modbus(body).to_bytes(2, "little")


def _polls(count: int, station: int = 1, period: int = 30 * MS) -> tuple[list, list]:
    asked = [(MS + at * period, _sealed(station, 3, 0, at, 0, 1)) for at in range(count)]
    answers = [(MS + at * period + 8 * MS, _sealed(station, 3, 2, at, 7 * at & 255)) for at in range(count)]
    return asked, answers


def _random_frames(count: int = 40) -> list[tuple[int, bytes]]:
    some = random.Random(3)
    return [(MS + at * 80 * MS, some.randbytes(12)) for at in range(count)]


def _octets(capture: Capture) -> bytes:
    return b"".join(item.octets for item in capture.items() if isinstance(item, Chunk))


@pytest.mark.parametrize(
    "token", ["9600,8N1", "19200,8E1", "38400,8O1", "115200,8N1", "9600,7E1", "9600,7O1", "2400,8E1"]
)
@pytest.mark.parametrize("level", [1, 0], ids=["idle high", "idle low"])
@pytest.mark.parametrize("fast", [1.0, 0.98, 1.02])
def test_settings_are_found(token: str, level: int, fast: float) -> None:
    line = LineSettings.parse(token)
    frames = [(begin, bytes(octet & ((1 << line.data_bits) - 1) for octet in some)) for begin, some in _random_frames()]
    edges = np.array(edges_of(frames, line, fast=fast), np.int64)
    uart = find(edges, level)
    assert uart is not None
    assert (uart.line, uart.inverted) == (line, level == 0)
    found = decoded(uart, edges, level)
    assert found.octets.tobytes().hex() == b"".join(octets for _, octets in frames).hex()
    assert not found.errors.any()
    assert abs(found.starts[0] - frames[0][0]) <= 1


def test_an_unusual_rate_is_said_as_measured() -> None:
    edges = np.array(edges_of(_random_frames(), LineSettings(13_333)), np.int64)
    uart = find(edges, 1)
    assert uart is not None
    assert abs(uart.line.baud - 13_333) < 20


def test_a_clock_and_a_slow_signal_are_no_characters() -> None:
    assert find(np.arange(0, 10_000_000, 1000), 1) is None
    assert find(np.arange(0, 100) * 37_123_457, 1) is None
    assert find(np.sort(np.random.default_rng(1).integers(0, 10**9, 5000)), 1) is None


def test_errors_are_marked() -> None:
    edges = np.array(edges_of(_random_frames(), RTU, wrong_parity=[20, 33], no_stop=[59]), np.int64)
    uart = find(edges, 1)
    assert uart is not None
    assert uart.line == RTU
    errors = decoded(uart, edges, 1).errors
    assert [LineError(int(errors[at])) for at in (20, 33, 59)] == [
        LineError.PARITY,
        LineError.PARITY,
        LineError.FRAMING,
    ]
    assert np.count_nonzero(errors) == 3


def test_a_break_is_one() -> None:
    frames = _random_frames()
    edges = [*edges_of(frames, RTU), 10**10, 10**10 + 5 * MS]
    uart = find(np.array(edges, np.int64), 1)
    assert uart is not None
    found = decoded(uart, np.array(edges, np.int64), 1)
    assert LineError(int(found.errors[-1])) == LineError.FRAMING | LineError.BREAK


def test_spikes_begin_nothing() -> None:
    frames = _random_frames()
    spikes = [edge for at in range(30) for edge in (70 * MS + at * 80 * MS, 70 * MS + at * 80 * MS + 5000)]
    edges = np.array(sorted([*edges_of(frames, RTU), *spikes]), np.int64)
    assert decoded(Uart(RTU, 1e9 / 19200), edges, 1).octets.tobytes() == b"".join(octets for _, octets in frames)


def test_cutting_the_edges_changes_nothing() -> None:
    edges = np.array(edges_of(_random_frames(), RTU, no_stop=[7, 90], wrong_parity=[4]), np.int64)
    uart = Uart(RTU, 1e9 / 19200)
    whole = decoded(uart, edges, 1)
    some = random.Random(5)
    for _ in range(50):
        cuts = sorted(some.sample(range(len(edges)), 9))
        decoder = Decoder(uart, 1)
        octets, errors, before = [], [], 0
        for cut in (*cuts, len(edges)):
            until = int(edges[cut - 1]) if cut < len(edges) else 1 << 62
            found = decoder.feed(edges[before:cut], until - int(13 * uart.bit) if cut < len(edges) else until)
            octets.append(found.octets)
            errors.append(found.errors)
            before = cut
        assert np.array_equal(np.concatenate(octets), whole.octets)
        assert np.array_equal(np.concatenate(errors), whole.errors)


# -- which channels are one bus --------------------------------------------------------------------------------


def _buses(tmp_path: Path, channels: dict[str, tuple[int, Sequence[int]]]) -> list[Capture]:
    capture = read(as_sigrok(tmp_path / "made.sr", channels))
    return list(capture.buses) if isinstance(capture, SeveralBuses) else [capture]


def test_two_sides_of_a_conversation_are_one_bus(tmp_path: Path) -> None:
    asked, answers = _polls(20)
    (bus,) = _buses(tmp_path, {"M": (1, edges_of(asked, RTU)), "S": (1, edges_of(answers, RTU)), "DE": (0, [])})
    both = sorted([*asked, *answers])
    assert _octets(bus) == b"".join(octets for _, octets in both)
    assert bus.session.bus == "M+S"
    assert bus.session.line == RTU
    assert "DE never changes" in bus.session.adapter.detail
    assert bus.session.sample  # of which its protocol is told


def test_a_and_b_of_a_pair_are_one_line(tmp_path: Path) -> None:
    edges = edges_of(_random_frames(), RTU)
    (bus,) = _buses(tmp_path, {"A": (1, edges), "B": (0, edges)})
    assert bus.session.bus == "A"
    assert "the same on B" in bus.session.adapter.detail


def test_what_a_receiver_hears_holds_what_the_driver_says(tmp_path: Path) -> None:
    asked, answers = _polls(20)
    heard = edges_of(sorted([*asked, *answers]), RTU)
    (bus,) = _buses(tmp_path, {"DI": (1, edges_of(asked, RTU)), "RO": (1, heard)})
    assert bus.session.bus == "RO"
    assert "the same on DI" in bus.session.adapter.detail


def test_buses_that_talk_at_once_are_two(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one = [frame for frames in _polls(20) for frame in frames]
    other = [frame for frames in _polls(30, 9, 23 * MS) for frame in frames]
    channels = {"north": (1, edges_of(sorted(one), RTU)), "south": (1, edges_of(sorted(other), RTU))}
    path = as_sigrok(tmp_path / "made.sr", channels)
    capture = read(path)
    assert isinstance(capture, SeveralBuses)
    assert sorted(capture.names) == ["north", "south"]
    with chosen("north"):
        assert _octets(read(path)) == b"".join(octets for _, octets in sorted(one))
    with chosen("west"), pytest.raises(CaptureError, match="no bus 'west'"):
        read(path)
    assert main(["show", str(path), "--bus", "south", "--json"]) == 0
    assert capsys.readouterr().out.count('"ok": true') == 60
    assert main(["show", str(path), "--json"]) == 0
    assert capsys.readouterr().out.count('"ok": true') == 100
    assert main(["info", str(path)]) == 0
    assert "[north]" in capsys.readouterr().out
    assert main(["convert", str(path), str(tmp_path / "out.mcap")]) == 2
    assert "--bus" in capsys.readouterr().err


def test_each_of_two_buses_tells_its_protocol(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    made = read(Path(__file__).parents[3] / "captures" / "mstp-clean.cap.txt")
    heard = [(chunk.time - made.session.started, chunk.octets) for chunk in made.items() if isinstance(chunk, Chunk)]
    line = LineSettings.parse("38400,8N1")
    ring = edges_of([(end - len(octets) * line.char, octets) for end, octets in heard], line)
    asked, answers = _polls(40)
    channels = {"north": (1, ring), "south": (1, edges_of(sorted([*asked, *answers]), RTU))}
    path = as_sigrok(tmp_path / "made.sr", channels)
    assert main(["show", str(path), "--json"]) == 0
    rows = capsys.readouterr().out.splitlines()
    assert sum('"proto": "mstp"' in row and '"ok": true' in row for row in rows) == len(heard)
    assert sum('"proto": "modbus-rtu"' in row and '"ok": true' in row for row in rows) == 80


def test_rates_that_differ_are_two_buses(tmp_path: Path) -> None:
    asked, answers = _polls(20)
    slow = LineSettings.parse("9600,8N1")
    assert len(_buses(tmp_path, {"1": (1, edges_of(asked, RTU)), "2": (1, edges_of(answers, slow))})) == 2


# -- files -----------------------------------------------------------------------------------------------------


def _made(tmp_path: Path, kind: str) -> tuple[Path, bytes]:
    asked, answers = _polls(12)
    frames = sorted([*asked, *answers])
    channels = {"D0": (1, edges_of(frames, RTU)), "D1": (0, ())}
    path = tmp_path / f"made.{kind}"
    if kind == "sr":
        as_sigrok(path, channels)
    elif kind == "vcd":
        as_vcd(path, channels)
    elif kind == "bin":
        as_binary(path, *channels["D0"])
    else:
        as_csv(path, channels, iso=kind == "iso")
    return path, b"".join(octets for _, octets in frames)


OPENERS = {
    "sr": logic_capture.read_sigrok,
    "vcd": logic_capture.read_vcd,
    "csv": logic_capture.read_digital_csv,
    "iso": logic_capture.read_digital_csv,
    "bin": logic_capture.read_digital_binary,
}


@pytest.mark.parametrize("kind", OPENERS)
def test_every_kind_of_file_gives_the_octets(tmp_path: Path, kind: str) -> None:
    path, octets = _made(tmp_path, kind)
    capture = OPENERS[kind](path)
    assert _octets(capture) == octets
    assert capture.session.line == RTU
    assert capture.completeness().whole
    chunks = [item for item in capture.items() if isinstance(item, Chunk)]
    origin = 1_772_359_200_000_000_000 if kind == "iso" else 0
    assert abs(chunks[0].time - origin - MS - RTU.char) < 3000
    blocks = [chunk for block in capture.blocks() for chunk in block.chunks()]  # type: ignore[union-attr]
    assert blocks == chunks


@pytest.mark.parametrize("kind", OPENERS)
def test_a_file_that_is_cut_or_damaged_is_read_or_refused(tmp_path: Path, kind: str) -> None:
    path, _ = _made(tmp_path, kind)
    whole = path.read_bytes()
    some = random.Random(7)
    many = 50 if IS_SEARCH else 20
    broken = [whole[:cut] for cut in range(0, len(whole), max(1, len(whole) // many))]
    for _ in range(many):
        mutated = bytearray(whole)
        for _ in range(some.choice((1, 1, 3, 30))):
            mutated[some.randrange(len(mutated))] = some.randrange(256)
        broken.append(bytes(mutated))
    for octets in broken:
        write_anew(path, octets)
        with contextlib.suppress(CaptureError):
            capture = OPENERS[kind](path)
            for _ in capture.items():
                pass
            capture.completeness()


def test_a_zip_that_says_more_than_can_be_is_refused(tmp_path: Path) -> None:
    path, _ = _made(tmp_path, "sr")
    octets = bytearray(path.read_bytes())
    directory = octets.rfind(b"PK\1\2")
    octets[directory + 24 : directory + 28] = (0xFFFFFFF0).to_bytes(4, "little")
    write_anew(path, bytes(octets))
    with pytest.raises(CaptureError, match="which cannot be"):
        read(path)


def test_a_description_as_large_as_a_house_is_not_unpacked(tmp_path: Path) -> None:
    path = tmp_path / "bomb.sr"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file, file.open("metadata", "w") as entry:
        entry.write(b"[device 1]\ncapturefile=logic-1\n")
        for _ in range(64):
            entry.write(b"x=1\n" * (1 << 18))
    with pytest.raises(CaptureError, match="too long"):
        read(path)


def test_a_zip_that_lacks_octets_in_its_middle_is_refused(tmp_path: Path) -> None:
    path, _ = _made(tmp_path, "sr")
    octets = path.read_bytes()
    path.write_bytes(octets[:60] + octets[101:])  # what its directory names begins before the file does
    with pytest.raises(CaptureError, match="damaged"):
        read(path)


def test_other_zips_are_refused_with_a_way_out(tmp_path: Path) -> None:
    for name, words in (("header", "DSView"), ("hello.txt", "no sigrok session")):
        path = tmp_path / "other.sr"
        with zipfile.ZipFile(path, "w") as file:
            file.writestr(name, "x")
        with pytest.raises(CaptureError, match=words):
            read(path)
    path = as_sigrok(tmp_path / "no-rate.sr", {"D0": (1, [])}, rate="")
    with pytest.raises(CaptureError, match="no sample rate"):
        read(path)


def test_channels_without_characters_are_named(tmp_path: Path) -> None:
    path = as_sigrok(tmp_path / "idle.sr", {"D0": (1, []), "DE": (0, [MS, 2 * MS])})
    with pytest.raises(CaptureError, match="D0 never changes, DE has 2 edges"):
        read(path)


def test_a_newer_binary_export_is_refused_with_a_way_out(tmp_path: Path) -> None:
    path, _ = _made(tmp_path, "bin")
    octets = bytearray(path.read_bytes())
    octets[8] = 1
    write_anew(path, bytes(octets))
    with pytest.raises(CaptureError, match="as CSV"):
        DigitalBinary(path)


def test_a_table_of_octets_is_no_table_of_levels() -> None:
    assert is_digital_csv(["Time [s],Channel 0", "0.0,1"])
    assert not is_digital_csv(["Time [s],Value,Parity Error", "0.1,0x01,"])
    assert not is_digital_csv(["time,voltage", "0.0,3.31"])


@pytest.mark.parametrize(
    ("name", "frames", "line"),
    [
        ("sigrok-flowmeter-graph_tool", 18, "9600,8N1"),
        ("sigrok-flowmeter-target_0liter_per_min", 112, "9600,8N1"),
        ("sigrok-flowmeter-target_20liter_per_min", 66, "9600,8N1"),
        ("sigrok-brainchild-io16do", 30, "19200,8E1"),
    ],
)
def test_captures_of_others_give_the_frames_beside_them(name: str, frames: int, line: str) -> None:
    folder = CAPTURES / name
    if not folder.is_dir():
        pytest.skip("the shared captures are not here")
    capture = read(next(folder.glob("*.sr")))
    assert str(capture.session.line) == line
    listed = [line.split(";")[0].split() for line in (folder / "frames.txt").read_text().splitlines() if line[0] != "#"]
    assert len(listed) == frames
    assert _octets(capture) == b"".join(bytes.fromhex("".join(words[1:])) for words in listed)


@pytest.mark.parametrize("kind", OPENERS)
def test_every_kind_is_told_by_its_content(tmp_path: Path, kind: str) -> None:
    path, octets = _made(tmp_path, kind)
    for name in (path.name, "night.log", "x"):
        moved = path.rename(tmp_path / name)
        assert _octets(read(moved)) == octets
        path = moved


@pytest.mark.parametrize("longest", [1 << 16, 101])
def test_a_value_change_dump_on_one_line(longest: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """White space is all alike in it; a line may be longer than what is read at once, and be cut in a time."""
    monkeypatch.setattr(vcd, "LONGEST_LINE", longest)
    asked, answers = _polls(8)
    path = as_vcd(tmp_path / "x.vcd", {"A": (1, edges_of(sorted([*asked, *answers]), RTU))})
    several = _octets(read(path))
    path.write_text(" ".join(path.read_text().split()))
    assert (
        _octets(read(path))
        == several
        == b"".join(some for pair in zip(asked, answers, strict=True) for _, some in pair)
    )
