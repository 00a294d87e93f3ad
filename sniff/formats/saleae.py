"""Digital channels as Saleae Logic exports them: a CSV with a row for each change, or a binary file a channel.

| file | looks like |
|---|---|
| CSV | `Time [s],Channel 0,Channel 1`, then a time and 0 or 1 for each channel; also times of ISO 8601, remarks above |
| binary (`digital_0.bin`) | `<SALEAE>`, version 0, type 0, level, begin, end, count, then times as 64-bit floats |
"""

from __future__ import annotations

import csv
import re
import struct
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dissectors.line import NS_PER_S
from sniff.engine.capture import CaptureError
from sniff.engine.session import Completeness
from sniff.formats.files import explain, open_capture
from sniff.formats.table_cells import seconds
from sniff.formats.table_heading import heading_of
from sniff.formats.waves import MOST_CHANNELS, Edges

if TYPE_CHECKING:
    from dissectors.columns import Times

MAGIC = b"<SALEAE>"
HEADER = struct.Struct("<8siiIddQ")
LONGEST_LINE = 1 << 16
REMARKS = ("#", ";")
"""Begin lines above the heading, of WaveForms and sigrok."""
SAMPLED = re.compile(r"sample ?rate", re.IGNORECASE)
AT_ONCE = 1 << 16
"""Edges that are gathered."""
LATEST = float(1 << 33)


def _has_times(heading: str) -> bool:
    return heading.strip().strip('"').lower().startswith("time")


def is_digital_csv(lines: list[str]) -> bool:
    """Whether the first lines of a text are a table of levels over time."""
    rows = [line for line in lines if line.strip() and not line.startswith(REMARKS)]
    if len(rows) < 2:
        return False
    if not _has_times(rows[0]):
        is_sampled = any(SAMPLED.search(line) for line in lines if line.startswith(REMARKS))
        return is_sampled and all(cell.strip() in ("0", "1") for line in rows[1:] for cell in line.split(","))
    if heading_of(rows[0], ",", rows[1:]) is not None:
        return False
    names, first = rows[0].split(","), rows[1].split(",")
    return len(names) == len(first) >= 2 and all(value.strip() in ("0", "1") for value in first[1:])


class DigitalTable:
    """A CSV of changes. A `WaveFile`. Raises CaptureError."""

    kind = "table of levels"
    resolution = ""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._passed = self._first_passed = self._above = 0
        rows = self._rows()
        heading = next(rows, (0, []))[1]
        first = next(rows, (0, []))[1]
        if heading and not _has_times(heading[0]):
            raise CaptureError(f"{path}: levels without times; export them with a time in each row, or as .sr or .vcd")
        if len(heading) < 2 or len(first) < 2:
            raise CaptureError(f"{path}: no table of levels: expected a heading with a time and channels")
        self.channels = [name.strip()[:60] or f"channel {at}" for at, name in enumerate(heading[1:])][:MOST_CHANNELS]
        self.levels = [0 if value.strip() == "0" else 1 for value in first[1 : 1 + len(self.channels)]]
        self.levels += [1] * (len(self.channels) - len(self.levels))
        self._is_clock = "-" in first[0].strip()[1:] and ":" in first[0]
        try:
            self.started = self._absolute(first[0]) if self._is_clock else 0
        except ValueError as error:
            raise CaptureError(f"{path}: {error}") from None

    def stretches(self) -> Iterator[Edges]:
        """All edges. Raises CaptureError."""
        self._passed = self._first_passed = 0
        levels = list(self.levels)
        found: list[list[int]] = [[] for _ in levels]
        count, time = 0, -(1 << 62)
        rows = self._rows()
        next(rows, None)
        for number, row in rows:
            if not row:
                continue
            values = [value.strip() for value in row[1 : 1 + len(levels)]]
            try:
                now = self._time(row[0])
            except ValueError:
                now = time - 1
            if now < time or len(values) < len(levels) or not all(value in ("0", "1") for value in values):
                self._passed += 1
                self._first_passed = self._first_passed or number
                continue
            if count >= AT_ONCE and now > time:
                yield _edges(time, found)
                found, count = [[] for _ in levels], 0
            time = now
            for channel, value in enumerate(values):
                if levels[channel] != (value == "1"):
                    levels[channel] ^= 1
                    found[channel].append(now)
                    count += 1
        yield _edges(time, found)

    def completeness(self) -> Completeness:
        """Whether every row was understood; a text has no end mark."""
        if not self._passed:
            return Completeness(True)
        rows = "1 row was" if self._passed == 1 else f"{self._passed} rows were"
        return Completeness(False, f"{rows} not understood, the first is line {self._first_passed}")

    def _rows(self) -> Iterator[tuple[int, list[str]]]:
        reader = csv.reader(self._lines())
        while True:
            try:
                row = next(reader, None)
            except csv.Error:
                row = [""]
            if row is None:
                return
            yield reader.line_num + self._above, row

    def _lines(self) -> Iterator[str]:
        with open_capture(self.path) as stream:
            try:
                is_above, self._above = True, 0
                while line := stream.readline(LONGEST_LINE):
                    text = line.decode("utf-8", "replace").rstrip("\r\n").removeprefix("\ufeff")
                    is_above = is_above and (not text.strip() or text.startswith(REMARKS))
                    if is_above:
                        self._above += 1
                    else:
                        yield text
            except OSError as error:
                raise explain(self.path, error) from None

    def _time(self, text: str) -> int:
        return self._absolute(text) if self._is_clock else seconds(text)

    def _absolute(self, text: str) -> int:
        """ns since the epoch, to the last digit. Raises ValueError."""
        text = text.strip()
        whole, point, rest = text.partition(".")
        digits = rest[: len(rest) - len(rest.lstrip("0123456789"))] if point else ""
        try:
            clock = datetime.fromisoformat(whole + rest[len(digits) :].replace("Z", "+00:00"))
            if clock.tzinfo is None:
                clock = datetime.fromisoformat(f"{whole}+00:00")
            if not 0 <= clock.timestamp() <= LATEST:
                raise ValueError
            return int(clock.timestamp()) * NS_PER_S + int(digits[:9].ljust(9, "0"))
        except (ValueError, OverflowError):
            raise ValueError(f"time {text[:40]!r}: expected ISO 8601") from None


class DigitalBinary:
    """One channel as 64-bit floats. A `WaveFile`. Raises CaptureError."""

    kind = "binary export of Saleae Logic"
    resolution = ""
    started = 0

    def __init__(self, path: Path) -> None:
        self.path = path
        self._complete = Completeness(True)
        with open_capture(path) as stream:
            header = stream.read(HEADER.size)
        if len(header) < HEADER.size or not header.startswith(MAGIC):
            raise CaptureError(f"{path}: no binary export of Saleae Logic, or cut inside its header")
        _, version, kind, level, _, end, count = HEADER.unpack(header)
        if version != 0 or kind != 0:
            what = "analog" if kind == 1 else f"of version {version}"
            raise CaptureError(f"{path}: a binary export of Saleae Logic, {what}; export digital channels as CSV")
        self.channels, self.levels = [path.stem[:60]], [int(level != 0)]
        self._count, self._end = count, end

    def stretches(self) -> Iterator[Edges]:
        """All edges. Raises CaptureError."""
        self._complete = Completeness(True)
        read, last = 0, -(1 << 62)
        with open_capture(self.path) as stream:
            stream.seek(HEADER.size)
            while read < self._count:
                octets = stream.read(8 * min(AT_ONCE, self._count - read))
                times = _from_seconds(np.frombuffer(octets[: len(octets) // 8 * 8], "<f8"))
                if not len(times):
                    text = f"cut behind {read} of {self._count} changes"
                    self._complete = Completeness(False, text)
                    break
                read += len(times)
                times = np.maximum.accumulate(np.maximum(times, last))
                last = int(times[-1])
                yield Edges(last, [times])

    def completeness(self) -> Completeness:
        """Whether all changes are there."""
        return self._complete


def _from_seconds(times: Times) -> Times:
    """ns; what is no time, or none of this age, is as near as it comes."""
    found: Times = np.rint(np.clip(np.nan_to_num(times), -LATEST, LATEST) * NS_PER_S).astype(np.int64)
    return found


def _edges(until: int, found: list[list[int]]) -> Edges:
    return Edges(until, [np.array(times, np.int64) for times in found])
