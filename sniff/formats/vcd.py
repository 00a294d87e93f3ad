"""Value change dumps (`.vcd`, IEEE 1364-2005 clause 18), as logic analysers and simulators write them.

Read are wires of one bit. Words of several bits and real numbers are passed over; what is unknown or not driven
changes nothing.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import BinaryIO

import numpy as np

from dissectors.line import NS_PER_S
from sniff.engine.capture import CaptureError
from sniff.engine.session import Completeness
from sniff.formats.files import explain, open_capture
from sniff.formats.waves import MOST_CHANNELS, Edges

UNITS = {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9, "ps": 10**12, "fs": 10**15}
LONGEST_LINE = 1 << 16
MOST_HEADER = 100_000  # words
AT_ONCE = 1 << 16
"""Edges that are gathered."""
LATEST = 1 << 62
_SCALE = re.compile(r"(1|10|100)(s|ms|us|ns|ps|fs)")


class ValueChanges:
    """A value change dump. A `WaveFile`. Raises CaptureError."""

    kind = "value change dump"

    def __init__(self, path: Path) -> None:
        self.path = path
        self.started = 0
        self._complete = Completeness(True)
        self._scale: tuple[int, int] = (1, 1)  # ns = time * scale[0] // scale[1]
        self.resolution = ""
        self._wires: dict[str, int] = {}
        self.channels: list[str] = []
        with open_capture(path) as stream:
            words = self._words(stream)
            self._header(words)
            self.levels = self._first_levels(words)
        if not self.channels:
            raise CaptureError(f"{path}: no wire of one bit in it")

    def stretches(self) -> Iterator[Edges]:
        """All edges. Raises CaptureError."""
        self._complete = Completeness(True)
        levels = list(self.levels)
        found: list[list[int]] = [[] for _ in self.channels]
        count, time = 0, -1
        with open_capture(self.path) as stream:
            words = self._words(stream)
            self._header(words)
            for word in words:
                kind, name = word[0], word[1:]
                if kind in "01":
                    wire = self._wires.get(name)
                    if wire is not None and levels[wire] != int(kind):
                        levels[wire] ^= 1
                        found[wire].append(max(0, time))
                        count += 1
                elif kind == "#":
                    before = time
                    time = max(before, self._time(name))
                    if count >= AT_ONCE and time > before:
                        yield _edges(before, found)
                        found, count = [[] for _ in self.channels], 0
        yield _edges(max(0, time), found)

    def completeness(self) -> Completeness:
        """A text has no end mark."""
        return self._complete

    def _words(self, stream: BinaryIO) -> Iterator[str]:
        """All words; a line may be longer than what is read at once, and be cut in one of them."""
        begun = ""
        try:
            while line := stream.readline(LONGEST_LINE):
                text = begun + line.decode("ascii", "replace")
                words = text.split()
                begun = words.pop() if words and not text[-1].isspace() and len(words[-1]) < LONGEST_LINE else ""
                yield from words
            if begun:
                yield begun
        except OSError as error:
            raise explain(self.path, error) from None

    def _header(self, words: Iterator[str]) -> None:
        """Take the declarations; a second time they are the same."""
        wires: dict[str, int] = {}
        channels: list[str] = []
        for word in islice(words, MOST_HEADER):
            if word == "$enddefinitions":
                self._wires, self.channels = wires, channels
                return
            if word in ("$var", "$timescale"):
                said = [*_until_end(words)]
                if word == "$timescale":
                    self._take_scale("".join(said))
                elif len(said) >= 4 and said[1] == "1" and len(channels) < MOST_CHANNELS and said[2] not in wires:
                    wires[said[2]] = len(channels)
                    channels.append("".join(said[3:])[:60])
        raise CaptureError(f"{self.path}: no value change dump: its declarations do not end")

    def _take_scale(self, said: str) -> None:
        match = _SCALE.fullmatch(said)
        if match is None:
            raise CaptureError(f"{self.path}: timescale {said[:20]!r}: expected 1, 10 or 100 and s … fs")
        number, unit = int(match[1]), UNITS[match[2]]
        self._scale = (number * NS_PER_S // unit, 1) if unit <= NS_PER_S else (number, unit // NS_PER_S)
        self.resolution = f"times in {match[1]} {match[2]}"

    def _first_levels(self, words: Iterator[str]) -> list[int]:
        """What the wires are before time goes on; idle where that is not said."""
        levels = [1] * len(self.channels)
        times = 0
        for word in islice(words, 16 * MOST_CHANNELS):
            times += word[0] == "#"
            if times > 1:
                break
            wire = self._wires.get(word[1:])
            if word[0] in "01" and wire is not None:
                levels[wire] = int(word[0])
        return levels

    def _time(self, digits: str) -> int:
        if not (digits.isascii() and digits.isdigit() and len(digits) < 25):
            return -1
        return min(LATEST, int(digits) * self._scale[0] // self._scale[1])


def _until_end(words: Iterator[str]) -> Iterator[str]:
    for word in islice(words, 64):
        if word == "$end":
            return
        yield word


def _edges(until: int, found: list[list[int]]) -> Edges:
    return Edges(until, [np.array(times, np.int64) for times in found])
