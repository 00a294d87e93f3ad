"""When a recording goes on in a new file, what the files are called, and which are kept.

Every part carries its final name from the start (`night-0007.mcap`): it can be opened while it is written, and after
a power cut nothing needs to be renamed. Whether it is whole, its own end says.
"""

from __future__ import annotations

import contextlib
import re
from dataclasses import dataclass
from pathlib import Path

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


def remove_old(path: Path, keep: int) -> None:
    """Remove all parts of a recording but the `keep` newest. What cannot be removed stays; nobody is told."""
    for _, part in parts(path)[:-keep]:
        with contextlib.suppress(OSError):
            part.unlink()
