"""Voltages over time as oscilloscopes export them (CSV): Rigol, Siglent, Tektronix, Keysight, PicoScope, WaveForms.

Their headings differ, and are not read but for the unit of time: what counts are rows of numbers of which the first
rises evenly and others are voltages. A Rigol may number its samples instead, and say the increment above.

A level is what a voltage last was for certain: in the upper or lower third between the extremes. So a line that nobody
drives, half way between both, stays as its last stop bit left it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path

import numpy as np
import numpy.typing as npt

from dissectors.line import NS_PER_S
from sniff.engine.capture import CaptureError
from sniff.engine.session import Completeness
from sniff.formats.files import explain, open_capture
from sniff.formats.table_heading import heading_of
from sniff.formats.waves import MOST_CHANNELS, Edges

LONGEST_LINE = 1 << 12
HEADING = 40
"""Lines in which the numbers must begin."""
LEAST_ROWS = 12
SAMPLE = 200_000
"""Rows whose extremes tell the levels."""
AT_ONCE = 1 << 16
SHORTEST, LONGEST = 1e-12, 2e-3
"""s between two samples; of a bit at 300 Bd two."""
LOWER, UPPER = 1 / 3, 2 / 3
TRIMMED = 0.2
"""Per cent of the samples at either end that are spikes."""

_OF_VOLTS = re.compile(r"volt|analog|\(m?V\)|\bm?V\b|\bCH ?\d|channel|kanal|canal|voie|record length", re.IGNORECASE)
_UNIT = re.compile(r"\((?P<unit>ns|us|µs|ms|s)\)|\b(?P<word>ms|us|µs|ns)\b", re.IGNORECASE)
_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}
_INCREMENT = re.compile(r"increment", re.IGNORECASE)
_EVEN = 0.6
"""Part of a step by which steps may differ, since times are written with few digits."""

Row = list[float | None]


def is_voltages(lines: list[str]) -> bool:
    """Whether the first lines of a text are voltages over even times."""
    try:
        layout = _Layout(lines)
    except ValueError:
        return False
    heading = next((line for line in reversed(lines[: layout.first]) if line.strip()), "")
    octets = heading_of(
        heading, layout.delimiter, lines[layout.first :]
    )  # one with even times, unless it has fractions
    return octets is None or octets.octet in layout.columns


class _Layout:
    """Where the numbers of a table stand. Raises ValueError when it is none."""

    def __init__(self, lines: list[str]) -> None:
        self.delimiter = next(
            (one for one in ("\t", ";", ",") if sum(one in line for line in lines) > len(lines) // 2), ""
        )
        if not self.delimiter:
            raise ValueError("no table")
        rows = [self.row(line) for line in lines]
        self.first = next((at for at in range(len(rows)) if self._are_numbers(rows[at:])), -1)
        if not 0 <= self.first <= HEADING:
            raise ValueError("no rows of numbers")
        said = "\n".join(lines[: self.first]) or "\n".join(lines[:4])
        numbers = rows[self.first :]
        places = [
            at for at, cell in enumerate(numbers[0]) if cell is not None and all(_has(row, at) for row in numbers)
        ]
        self.time = next((at for at in places if _is_even([_cell(row, at) for row in numbers])), -1)
        fractions = [at for at in places if at > self.time >= 0 and any(_cell(row, at) % 1 for row in numbers)]
        if self.time < 0 or not fractions or not _OF_VOLTS.search("\n".join(lines)):
            raise ValueError("no voltages over time")
        self.columns = fractions[:MOST_CHANNELS]
        unit = _UNIT.search(said)
        self.scale = _UNITS[(unit["unit"] or unit["word"]).lower()] if unit is not None else 1.0
        self.names = self._names(lines[: self.first])
        times = [_cell(row, self.time) for row in numbers]
        is_count = times == [times[0] + at for at in range(len(times))]
        self.increment = self._increment(lines[: self.first]) if is_count else None
        if is_count and self.increment is None and unit is None:
            raise ValueError("samples are numbered, and nobody says how far apart they are")

    def row(self, line: str) -> Row:
        """The numbers of a line; None for what is none."""
        return [_number(cell, self.delimiter == ";") for cell in line.split(self.delimiter)]

    def _are_numbers(self, rows: list[Row]) -> bool:
        """Whether rows from here on have the same numbers, at least two."""
        some = rows[:LEAST_ROWS]
        if len(some) < LEAST_ROWS:
            return False
        counts = [sum(cell is not None for cell in row) for row in some]
        return min(counts) >= 2 and len({len(row) for row in some}) == 1

    def _names(self, heading: list[str]) -> list[str]:
        """Names of the channels: the last line of the heading that has one for each."""
        for line in reversed(heading):
            cells = [cell.strip().strip('"') for cell in line.split(self.delimiter)]
            if len(cells) > max(self.columns) and all(re.search(r"[A-Za-z]{2}", cells[at]) for at in self.columns):
                return [cells[at][:60] for at in self.columns]
        return [f"channel {at}" for at, _ in enumerate(self.columns, 1)]

    def _increment(self, heading: list[str]) -> float | None:
        """s between samples that are numbered."""
        named = next((at for at, line in enumerate(heading) if _INCREMENT.search(line)), None)
        if named is None:
            return None
        cells = heading[named].split(self.delimiter)
        place = next(at for at, cell in enumerate(cells) if _INCREMENT.search(cell))
        values = self.row(heading[named + 1]) if named + 1 < len(heading) else []
        found = values[place] if place < len(values) else None
        return found if found is not None and found > 0 else None


class VoltageTable:
    """A CSV of voltages. A `WaveFile`. Raises CaptureError."""

    kind = "table of voltages"

    def __init__(self, path: Path) -> None:
        self.path = path
        self.started = 0
        self._passed = self._first_passed = 0
        try:
            self._layout = layout = _Layout(list(islice(self._lines(), HEADING + 2 * LEAST_ROWS)))
        except ValueError as error:
            raise CaptureError(f"{path}: no table of voltages: {error}") from None
        self.channels = layout.names
        times, voltages = self._sample()
        step = layout.increment or (times[-1] - times[0]) / max(1, len(times) - 1) * layout.scale
        if not SHORTEST <= step <= LONGEST:
            raise CaptureError(f"{path}: voltages {_shown(step)} apart, too far to see the bits of a serial line")
        self._step = step * NS_PER_S
        self.resolution = f"samples {_shown(step)} apart"
        self._limits = [_limits(voltages[:, at]) for at in range(len(self.channels))]
        self.levels = [int(voltages[0, at] > sum(self._limits[at]) / 2) for at in range(len(self.channels))]

    def stretches(self) -> Iterator[Edges]:
        """All edges. Raises CaptureError."""
        self._passed = self._first_passed = 0
        levels, before = list(self.levels), 0
        for _, voltages in self._rows():
            edges = []
            for at, (lower, upper) in enumerate(self._limits):
                changes, levels[at] = _changes(voltages[:, at], lower, upper, levels[at])
                edges.append(((changes + before) * self._step).astype(np.int64))
            before += len(voltages)
            yield Edges(int(before * self._step), edges)

    def completeness(self) -> Completeness:
        """Whether every row was understood; a text has no end mark."""
        if not self._passed:
            return Completeness(True)
        rows = "1 row was" if self._passed == 1 else f"{self._passed} rows were"
        return Completeness(False, f"{rows} not understood, the first is line {self._first_passed}")

    def _sample(self) -> tuple[list[float], npt.NDArray[np.float64]]:
        times: list[float] = []
        parts = []
        for own, voltages in self._rows():
            times += own
            parts.append(voltages)
            if len(times) >= SAMPLE:
                break
        if not times:
            raise CaptureError(f"{self.path}: a table of voltages without a row")
        return times, np.concatenate(parts)

    def _rows(self) -> Iterator[tuple[list[float], npt.NDArray[np.float64]]]:
        """Times as they are written, and voltages, many rows at a time."""
        layout = self._layout
        times: list[float] = []
        voltages: list[list[float]] = []
        for number, line in enumerate(self._lines(), 1):
            if number <= layout.first or not line.strip():
                continue
            row = layout.row(line)
            if not all(_has(row, at) for at in (layout.time, *layout.columns)):
                self._passed += 1
                self._first_passed = self._first_passed or number
                continue
            times.append(_cell(row, layout.time))
            voltages.append([_cell(row, at) for at in layout.columns])
            if len(times) >= AT_ONCE:
                yield times, np.array(voltages)
                times, voltages = [], []
        if times:
            yield times, np.array(voltages)

    def _lines(self) -> Iterator[str]:
        with open_capture(self.path) as stream:
            try:
                while line := stream.readline(LONGEST_LINE):
                    yield line.decode("utf-8", "replace").rstrip("\r\n").removeprefix("\ufeff")
            except OSError as error:
                raise explain(self.path, error) from None


def _changes(
    voltages: npt.NDArray[np.float64], lower: float, upper: float, level: int
) -> tuple[npt.NDArray[np.int64], int]:
    """At which samples the level changes, and what it is after the last."""
    certain = (voltages >= upper) | (voltages <= lower)
    newest = np.maximum.accumulate(np.where(certain, np.arange(len(voltages)), -1))
    levels = np.where(newest >= 0, voltages[newest] >= upper, bool(level)).astype(np.int8)
    changes = np.flatnonzero(np.diff(levels, prepend=np.int8(level)))
    return changes, int(levels[-1])


def _limits(voltages: npt.NDArray[np.float64]) -> tuple[float, float]:
    """Voltages below and above which a level is certain."""
    sane = voltages[np.isfinite(voltages)]
    low, high = np.percentile(sane, [TRIMMED, 100 - TRIMMED]) if len(sane) else (0.0, 0.0)
    return float(low + LOWER * (high - low)), float(low + UPPER * (high - low))


def _is_even(times: Iterable[float]) -> bool:
    """Whether numbers rise by the same each time, as far as their digits say it."""
    numbers = np.array(list(times))
    if not np.isfinite(numbers).all():
        return False
    steps = np.diff(numbers)
    mean = float(steps.mean()) if len(steps) else 0.0
    return mean > 0 and bool((steps >= 0).all()) and bool((np.abs(steps - mean) <= _EVEN * mean).all())


def _number(cell: str, is_comma: bool) -> float | None:
    text = cell.strip().strip('"')
    if not text or not (text[0].isdigit() or text[0] in "+-."):
        return None
    try:
        return float(text.replace(",", ".") if is_comma else text)
    except ValueError:
        return None


def _has(row: Row, at: int) -> bool:
    return at < len(row) and row[at] is not None


def _cell(row: Row, at: int) -> float:
    cell = row[at]
    assert cell is not None
    return cell


def _shown(step: float) -> str:
    name, size = next(
        ((name, size) for name, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)) if step >= size), ("ns", 1e-9)
    )
    return f"{step / size:.4g} {name}"
