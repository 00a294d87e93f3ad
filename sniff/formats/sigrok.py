"""sigrok sessions (`.sr`): a zip with a description and the samples of all logic channels, in pieces.

Made to do harm it may be: a zip whose directory is beyond reason, or which says that more was packed into it than
packing can do, is refused before memory is taken; samples are unpacked a stretch at a time.
"""

from __future__ import annotations

import re
import zipfile
import zlib
from collections.abc import Iterator
from configparser import ConfigParser
from configparser import Error as IniError
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from dissectors.line import NS_PER_S
from sniff.engine.capture import CaptureError
from sniff.engine.session import Completeness
from sniff.formats.files import open_capture
from sniff.formats.waves import MOST_CHANNELS, Edges

if TYPE_CHECKING:
    from dissectors.columns import Octets, Times

MAGIC = b"PK\x03\x04"
LONGEST_DIRECTORY = 16 << 20
"""Octets of the list of what is in a zip, which is read whole."""
LONGEST_DESCRIPTION = 1 << 20
DENSEST = 1100
"""Octets that one octet of a zip can stand for; deflate reaches 1032."""
MOST_SAMPLES = 1 << 40
AT_ONCE = 1 << 18
"""Samples that are looked at together."""

_PACKED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_UNITS = {"": 1, "K": 1000, "M": 1_000_000, "G": 1_000_000_000}
_RATE = re.compile(r"\s*(\d{1,12}(?:\.\d{1,9})?)\s*([kKMG]?)(?:Hz)?\s*")
_DAMAGED = (
    zipfile.BadZipFile,
    zlib.error,
    EOFError,
    OSError,
    NotImplementedError,
    RuntimeError,
    ValueError,
    OverflowError,
)


class SigrokSession:
    """The first device of a session. A `WaveFile`. Raises CaptureError."""

    kind = "sigrok session"

    def __init__(self, path: Path) -> None:
        self.path = path
        self.started = 0
        self._complete = Completeness(True)
        with open_capture(path) as stream, self._zip(stream) as held:
            names = held.namelist()
            if "metadata" not in names:
                what = "a DSView file; save it as sigrok session or CSV" if "header" in names else "no sigrok session"
                raise CaptureError(f"{path}: a zip, but {what}")
            device = self._device(held)
            self._entries = self._samples(held, device.get("capturefile", ""))
            if not self._entries:
                raise CaptureError(f"{path}: no samples of logic channels in it")
            self.rate = self._rate(device.get("samplerate", ""))
            self._unit = _whole(device.get("unitsize", "1"), 1, 8)
            self._bits, self.channels = self._names(device)
            self.resolution = f"{device['samplerate'].strip()[:40]} samples"
            first = self._read(held, self._entries[0], self._unit)
        rows = np.frombuffer(first.ljust(self._unit, b"\xff"), np.uint8)
        self.levels = [int(rows[bit // 8] >> bit % 8 & 1) for bit in self._bits]

    def stretches(self) -> Iterator[Edges]:
        """All edges. Raises CaptureError."""
        self._complete = Completeness(True)
        if self._absent:
            self._complete = Completeness(False, f"pieces of its samples are missing ({self._absent} or more)")
        before: Octets | None = None
        passed = 0
        with open_capture(self.path) as stream, self._zip(stream) as held:
            for name in self._entries:
                try:
                    with held.open(name) as samples:
                        while octets := samples.read(AT_ONCE * self._unit):
                            rows = np.frombuffer(octets[: len(octets) // self._unit * self._unit], np.uint8)
                            rows = rows.reshape(-1, self._unit)
                            if not len(rows):
                                break
                            yield self._edges(rows, before, passed)
                            passed += len(rows)
                            before = rows[-1]
                            if passed > MOST_SAMPLES:
                                raise CaptureError(f"{self.path}: more than {MOST_SAMPLES} samples")
                except _DAMAGED as error:
                    self._complete = Completeness(False, f"damaged in {name!r} at sample {passed}: {error}")
                    return

    def completeness(self) -> Completeness:
        """Whether all samples could be unpacked."""
        return self._complete

    def _edges(self, rows: Octets, before: Octets | None, passed: int) -> Edges:
        joined = np.vstack((rows[0] if before is None else before, rows))
        if self._unit in (1, 2, 4, 8):
            values = joined.view(f"u{self._unit}").ravel()
            places = np.flatnonzero(values[1:] != values[:-1])
        else:
            places = np.flatnonzero((joined[1:] != joined[:-1]).any(axis=1))
        changed = joined[places + 1] ^ joined[places]
        return Edges(
            self._time(np.array([passed + len(rows) - 1], np.int64))[0],
            [self._time(places[changed[:, bit // 8] >> bit % 8 & 1 != 0] + passed) for bit in self._bits],
        )

    def _time(self, samples: Times) -> Times:
        """ns, exactly: neither step leaves 64 bits."""
        seconds, rest = samples // self.rate, samples % self.rate
        times: Times = seconds * NS_PER_S + rest * NS_PER_S // self.rate
        return times

    # -- what the file says ------------------------------------------------------------------------------------

    def _zip(self, stream: BinaryIO) -> zipfile.ZipFile:
        stream.seek(0, 2)
        size = stream.tell()
        stream.seek(max(0, size - 66_000))
        tail = stream.read()
        at = tail.rfind(b"PK\x05\x06")
        if at < 0:
            raise CaptureError(f"{self.path}: a zip that was cut: its directory, at the end, is missing")
        directory = int.from_bytes(tail[at + 12 : at + 16], "little")
        if directory > LONGEST_DIRECTORY:
            raise CaptureError(f"{self.path}: a zip with a directory of {directory} octets is no capture")
        stream.seek(0)
        try:
            held = zipfile.ZipFile(stream)
        except _DAMAGED as error:
            raise CaptureError(f"{self.path}: a zip that was damaged: {error}") from None
        packed = sum(entry.file_size for entry in held.infolist())
        if packed > DENSEST * size:
            raise CaptureError(f"{self.path}: a zip of {size} octets that says it holds {packed}, which cannot be")
        return held

    def _read(self, held: zipfile.ZipFile, name: str, size: int) -> bytes:
        try:
            with held.open(name) as entry:
                return entry.read(size)
        except _DAMAGED as error:
            raise CaptureError(f"{self.path}: a zip that was damaged: {error}") from None

    def _device(self, held: zipfile.ZipFile) -> dict[str, str]:
        if held.getinfo("metadata").file_size > LONGEST_DESCRIPTION:
            raise CaptureError(f"{self.path}: a zip, but no sigrok session: its description is too long")
        try:
            text = self._read(held, "metadata", LONGEST_DESCRIPTION).decode("utf-8", "replace")
            parser = ConfigParser(interpolation=None, strict=False)
            parser.read_string(text)
        except (*_DAMAGED, IniError) as error:
            raise CaptureError(
                f"{self.path}: its description cannot be read: {' '.join(str(error).split())[:200]}"
            ) from None
        for section in parser.sections():
            if section.startswith("device"):
                return dict(parser[section])
        raise CaptureError(f"{self.path}: no device in its description")

    def _samples(self, held: zipfile.ZipFile, name: str) -> list[str]:
        """The entries with samples, in order."""
        found: list[tuple[int, str]] = []
        for entry in held.infolist():
            match = re.fullmatch(re.escape(name) + r"(?:-(\d{1,9}))?", entry.filename) if name else None
            if match is None:
                continue
            if entry.compress_type not in _PACKED or entry.flag_bits & 1:
                raise CaptureError(
                    f"{self.path}: {entry.filename!r} is packed in a way that this program does not read"
                )
            found.append((int(match[1] or 0), entry.filename))
        numbers = {number for number, _ in found if number}
        self._absent = max(numbers, default=0) - len(numbers)
        return [name for _, name in sorted(found)]

    def _rate(self, text: str) -> int:
        match = _RATE.fullmatch(text)
        try:
            rate = int(Decimal(match[1]) * _UNITS[match[2].upper()]) if match is not None else 0
        except InvalidOperation:
            rate = 0
        if not 0 < rate < 9_000_000_000:
            raise CaptureError(
                f"{self.path}: no sample rate in it ({text[:20]!r}), so no baud rate; set it and save again"
            )
        return rate

    def _names(self, device: dict[str, str]) -> tuple[list[int], list[str]]:
        """Bits of a sample and the names of their channels."""
        named = {}
        for key, value in device.items():
            match = re.fullmatch(r"probe(\d{1,3})", key)
            if match is not None and 1 <= int(match[1]) <= 8 * self._unit:
                named[int(match[1]) - 1] = value.strip()[:60]
        if not named:
            named = {bit: f"D{bit}" for bit in range(8 * self._unit)}
        bits = sorted(named)[:MOST_CHANNELS]
        return bits, [named[bit] for bit in bits]


def _whole(text: str, least: int, most: int) -> int:
    text = text.strip()
    return min(most, max(least, int(text))) if text.isascii() and text.isdigit() and len(text) < 10 else least
