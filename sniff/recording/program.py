"""Which program this is: its version, and a digest of all that decides what is found in octets, and how it is kept."""

from __future__ import annotations

from functools import cache
from hashlib import blake2b
from importlib.resources import files
from importlib.resources.abc import Traversable

from sniff.version import __version__

DECIDING = ("dissectors", "sniff.engine", "sniff.recording")
"""Packages that frame, dissect, pair and keep."""


@cache
def program() -> str:
    """Version and digest of the sources, "0.2.0 1f…"; of the version alone where there are none to read."""
    digest, found = blake2b(digest_size=12), 0
    for package in DECIDING:
        found += _take(files(package), package, digest)
    return f"{__version__} {digest.hexdigest()}" if found else __version__


def _take(folder: Traversable, name: str, digest: blake2b) -> int:
    """How many sources were taken."""
    found = 0
    for one in sorted(folder.iterdir(), key=lambda one: one.name):
        place = f"{name}/{one.name}"
        if one.is_dir() and one.name != "__pycache__":
            found += _take(one, place, digest)
        elif one.name.endswith(".py"):
            digest.update(place.encode() + b"\0" + one.read_bytes())
            found += 1
    return found
