"""A file that is written hundreds of times, each time another."""

from __future__ import annotations

from pathlib import Path


def write_anew(path: Path, octets: bytes) -> None:
    """As a new file: ext4 waits for the disk when a file is emptied, written and closed."""
    path.unlink(missing_ok=True)
    path.write_bytes(octets)
