"""Rotation: when a recording goes on in a new file, what the files are called, and which are kept.

Every part carries its final name from the start (`night-0007.mcap`): it can be opened while it is written, and after
a power cut nothing needs to be renamed. Whether it is whole, its own end says.
"""

from __future__ import annotations

import contextlib
import os
import re
import shutil
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

_UNITS = {
    "size": {"": 1, "kb": 10**3, "mb": 10**6, "gb": 10**9, "kib": 1 << 10, "mib": 1 << 20, "gib": 1 << 30},
    "time": {"s": 10**9, "min": 60 * 10**9, "m": 60 * 10**9, "h": 3600 * 10**9, "d": 86400 * 10**9},
    "count": {"": 1, "k": 10**3},
}
_LEAST = {"size": 64_000, "time": 10**9, "count": 1}
_RULE = re.compile(r"(size|time|count):([0-9]{1,9}(?:\.[0-9]{1,3})?)\s*([a-z]*)", re.IGNORECASE)
EXPECTED = "expected size:64MB, time:1h or count:100000, or several with commas between"


@dataclass(frozen=True, slots=True)
class Rotation:
    """A new part at whichever limit is reached first. `size`: octets of a file. `time`: ns. `count`: reads."""

    size: int | None = None
    time: int | None = None
    count: int | None = None

    @classmethod
    def parse(cls, text: str) -> Rotation:
        """Read "size:64MB", "time:1h", "count:100000", "size:64MB,time:1h".

        Units: B kB MB GB KiB MiB GiB; s min m h d. Raises ValueError with what was expected.
        """
        limits: dict[str, int] = {}
        for rule in text.split(","):
            match = _RULE.fullmatch(rule.strip())
            if match is None:
                raise ValueError(f"rotation {text!r}: {EXPECTED}")
            name, number, unit = match[1].lower(), float(match[2]), match[3].lower()
            if name == "size" and unit == "b":
                unit = ""
            scale = _UNITS[name].get(unit)
            if scale is None:
                known = " ".join(word for word in _UNITS[name] if word)
                raise ValueError(f"rotation {text!r}: unknown unit {match[3]!r}; one of {known}")
            limits[name] = int(number * scale)
            if limits[name] < _LEAST[name]:
                raise ValueError(f"rotation {text!r}: too small; at least 64kB, 1s or 1")
        return cls(**limits)

    def due(self, size: int, time: int, count: int) -> bool:
        """Whether a part of that size (octets), age (ns) and number of reads is full."""
        return any(
            limit is not None and reached >= limit
            for limit, reached in ((self.size, size), (self.time, time), (self.count, count))
        )


def octets_of(text: str) -> int:
    """Read "1GB", "500MB", "64MiB". Raises ValueError with what was expected."""
    match = re.fullmatch(r"([0-9]{1,9}(?:\.[0-9]{1,3})?)\s*([a-z]*)", text.strip(), re.IGNORECASE)
    scale = _UNITS["size"].get(match[2].lower().removesuffix("b") and match[2].lower()) if match else None
    if match is None or scale is None:
        raise ValueError(f"size {text!r}: expected octets as 1GB, 500MB or 64MiB")
    return int(float(match[1]) * scale)


def part_name(path: Path, number: int) -> Path:
    """night.mcap, 7 → night-0007.mcap."""
    return path.with_name(f"{path.stem}-{number:04}{path.suffix}")


def parts(path: Path) -> list[tuple[int, Path]]:
    """The parts of a recording that are there, by number."""
    pattern = re.compile(re.escape(path.stem) + r"-([0-9]{4,9})" + re.escape(path.suffix))
    found = []
    with contextlib.suppress(OSError):
        for sibling in path.parent.iterdir():
            match = pattern.fullmatch(sibling.name)
            if match is not None:
                found.append((int(match[1]), sibling))
    return sorted(found)


class NewestParts:
    """The parts that one recorder began, of which the newest `keep` stay (None: all of them).

    Only files that were added here or given as `earlier` are ever removed: else not a part of an earlier recording of
    the same name, and never another file that has taken the place of one that was begun here and moved away.
    """

    def __init__(self, keep: int | None, earlier: Iterable[Path] = ()) -> None:
        """`earlier`: parts that were there before, oldest first, which count like those to come."""
        self._keep = None if keep is None else max(1, keep)
        self._begun: list[tuple[Path, os.stat_result | None]] = []
        if keep is not None:
            self._begun += [(path, None) for path in earlier]

    def add(self, path: Path, stream: BinaryIO) -> None:
        """Remember a part that was begun just now, open as `stream`. Raises OSError."""
        if self._keep is not None:
            self._begun.append((path, os.fstat(stream.fileno())))

    def remove_old(self) -> None:
        """Remove what is too old. What cannot be removed now is tried again the next time; nobody is told."""
        if self._keep is not None:
            old, newest = self._begun[: -self._keep], self._begun[-self._keep :]
            self._begun = [part for part in old if not _removed(*part)] + newest


class FreeSpace:
    """Keeps some of a disk free by removing the oldest parts of a recording, whichever run of the program made them.

    Only files that are called as this recording's parts are, never the one being written.
    """

    def __init__(self, path: Path, least: int) -> None:
        """`path`: of the recording, as `part_name` takes it. `least`: octets that stay free."""
        self._path = path
        self._least = least

    def make(self, current: Path) -> list[Path]:
        """Remove what must go; what was removed. Never raises."""
        gone = []
        for _, part in parts(self._path):
            free = free_octets(self._path.parent)
            if part.name == current.name or free is None or free >= self._least:
                break
            with contextlib.suppress(OSError):
                part.unlink()
                gone.append(part)
        return gone


def free_octets(folder: Path) -> int | None:
    """Octets that are free on the disk of a folder; None where nobody knows."""
    try:
        return shutil.disk_usage(folder).free
    except OSError:
        return None


def file_octets(path: str | Path) -> int:
    """Octets of a file; 0 where it is gone."""
    try:
        return os.stat(path).st_size
    except OSError:
        return 0


def _removed(path: Path, begun: os.stat_result | None) -> bool:
    """Remove a file if it is still the one that was begun, where that is known; whether it is gone from there."""
    try:
        if begun is None or os.path.samestat(path.lstat(), begun):
            path.unlink()
    except FileNotFoundError:
        return True
    except OSError:
        return False
    return True
