"""Voltages over time of oscilloscopes, as their makers export them."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path

import pytest

from dissectors.checksums import crc16_modbus
from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.engine.capture import Capture, CaptureError
from sniff.formats import read, scope

RATE, STEP = 9600, 1e-5  # Bd, s
PAUSE = 0.006  # s; longer than the silence that ends a frame, and no longer: each sample is a row
LINE = LineSettings.parse("9600,8E1")


def _sealed(*octets: int) -> bytes:
    return bytes(octets) + crc16_modbus(bytes(octets)).to_bytes(2, "little")


FRAMES = [
    octets for number in range(5) for octets in (_sealed(1, 3, 0, number, 0, 2), _sealed(1, 3, 4, 1, number, 0, 7))
]


def _levels() -> list[float]:
    """1 and 0 as the line has them; a half where nobody drives it."""
    levels: list[float] = []
    now = 0.0

    def hold(level: float, seconds: float) -> None:
        nonlocal now
        now += seconds
        levels.extend([level] * (round(now / STEP) - len(levels)))

    hold(0.5, 0.003)
    for frame in FRAMES:
        hold(1, 0.001)
        for octet in frame:
            for bit in (0, *((octet >> at) & 1 for at in range(8)), octet.bit_count() & 1, 1):
                hold(bit, 1 / RATE)
        hold(0.5, PAUSE)
    return levels


_CHANCE = random.Random(1)
VOLTS = [4.0 * level - 1.9 + _CHANCE.gauss(0, 0.05) for level in _levels()]
Write = Callable[[int, float], str]


def _seconds(at: int) -> float:
    return at * STEP - 0.003


HEADINGS: dict[str, tuple[str, Write]] = {
    "Rigol, numbered": (
        "X,CH1,Start,Increment,\nSequence,Volt,-3.000000e-03,1.000000e-05\n",
        lambda at, volts: f"{at},{volts:.2e},",
    ),
    "Rigol": ("Time(s),CH1(V)\n", lambda at, volts: f"{_seconds(at):.6e},{volts:.3e}"),
    "Siglent": (
        "Record Length,Analog:1\nSample Interval,Analog:1e-05\nVertical Units,CH1:V\n\nSource,CH1\nSecond,Volt\n",
        lambda at, volts: f"{_seconds(at):.6e},{volts:.5f}",
    ),
    "Tektronix": (
        "Model,MSO46\n\nWaveform Type,ANALOG\nHorizontal Units,s\nSample Interval,1e-05\nLabels,,\n\nTIME,CH1\n",
        lambda at, volts: f"{_seconds(at):.6e},{volts:.4f}",
    ),
    "Tektronix, with its heading beside": (
        f"Record Length,2500,,{-0.003 - STEP:.9f},0.10000\n",
        lambda at, volts: f",,,{_seconds(at):.9f},{volts:.5f}",
    ),
    "Keysight": ("x-axis,1\nsecond,Volt\n", lambda at, volts: f"{_seconds(at):+.7E},{volts:+.5E}"),
    "PicoScope": ("Time,Channel A\n(ms),(V)\n\n", lambda at, volts: f"{_seconds(at) * 1000:.8f},{volts:.8f}"),
    "PicoScope, German": (
        "Zeit;Kanal A\n(ms);(V)\n\n",
        lambda at, volts: f"{_seconds(at) * 1000:.8f};{volts:.8f}".replace(".", ","),
    ),
    "WaveForms": (
        "#Digilent WaveForms Oscilloscope Acquisition\n#Sample rate: 100000Hz\n\nTime (s),Channel 1 (V)\n",
        lambda at, volts: f"{_seconds(at):.8g},{volts:.8g}",
    ),
    "both wires": (
        "Time (s),CH1 (V),CH2 (V)\n",
        lambda at, volts: f"{_seconds(at):.6f},{2.5 + volts / 2:.3f},{2.5 - volts / 2:.3f}",
    ),
}


def _written(folder: Path, name: str) -> Path:
    heading, row = HEADINGS[name]
    path = folder / "scope.csv"
    path.write_text(heading + "".join(f"{row(at, volts)}\n" for at, volts in enumerate(VOLTS)))
    return path


def _octets(capture: Capture) -> bytes:
    return b"".join(item.octets for item in capture.items() if isinstance(item, Chunk))


@pytest.mark.parametrize("name", HEADINGS)
def test_the_octets_are_found(name: str, tmp_path: Path) -> None:
    capture = read(_written(tmp_path, name))
    assert _octets(capture) == b"".join(FRAMES)
    assert capture.session.line == LINE
    assert capture.completeness().whole


def test_rows_are_read_on_where_as_many_as_are_taken_at_once_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = _written(tmp_path, "Rigol")
    whole = list(read(path).items())
    monkeypatch.setattr(scope, "AT_ONCE", 1000)
    assert list(read(path).items()) == whole


def test_times_are_those_of_the_samples(tmp_path: Path) -> None:
    times = [item.time for item in read(_written(tmp_path, "Keysight")).items() if isinstance(item, Chunk)]
    assert abs((times[8] - times[7]) - (PAUSE + 0.001 + 11 / RATE) * 1e9) < 3 * STEP * 1e9


@pytest.mark.parametrize("odd", ["", "trigger", "1e999,nan", "nan,1", "-0.1", "x" * 10_000])
def test_rows_that_are_none(odd: str, tmp_path: Path) -> None:
    path = _written(tmp_path, "Rigol")
    lines = path.read_text().splitlines()
    lines.insert(200, odd)
    path.write_text("\n".join(lines))
    assert _octets(read(path))


def test_a_temperature_over_time_is_no_bus(tmp_path: Path) -> None:
    path = tmp_path / "oven.csv"
    path.write_text("Time (s),Channel 1 (V)\n" + "".join(f"{at},{20 + at / 7:.2f}\n" for at in range(500)))
    with pytest.raises(CaptureError, match="voltages 1 s apart, too far to see the bits"):
        read(path)


def test_levels_without_times_are_no_octets(tmp_path: Path) -> None:
    path = tmp_path / "sigrok.csv"
    path.write_text("; CSV generated by libsigrok\n; Samplerate: 100 kHz\nlogic\n" + "0\n1\n1\n" * 500)
    with pytest.raises(CaptureError, match="levels without times; export them with"):
        read(path)


def test_remarks_above_levels(tmp_path: Path) -> None:
    path = tmp_path / "waveforms.csv"
    rows = "".join(f"{_seconds(at):.8g},{int(volts > 0)}\n" for at, volts in enumerate(VOLTS) if abs(volts) > 0.5)
    path.write_text(f"#Digilent WaveForms Logic Analyzer Acquisition\n#Sample rate: 100000Hz\n\nTime (s),DIO 0\n{rows}")
    assert _octets(read(path)) == b"".join(FRAMES)
    path.write_text(path.read_text() + "x,y\n")
    capture = read(path)
    list(capture.items())
    assert f"line {path.read_text().count(chr(10))}" in capture.completeness().text


def test_volts_of_four_digits_are_no_octets(tmp_path: Path) -> None:
    """20.14 is a number in every row, and no two octets."""
    path = tmp_path / "volts.csv"
    rows = (f"{_seconds(at):.7f},{volts + 14:.2f}\n" for at, volts in enumerate(VOLTS))
    path.write_text("Time (s),Channel 1 (V)\n" + "".join(rows))
    assert _octets(read(path)) == b"".join(FRAMES)
