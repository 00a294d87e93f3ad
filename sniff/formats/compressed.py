"""Files around captures: how each begins. gzip, zstd, bzip2 and xz are unpacked (`unpacking.py`) where there is one."""

from __future__ import annotations

from dataclasses import dataclass

DEEPEST = 3
"""Wrappings around one another; a file within more of them is no capture."""


@dataclass(frozen=True, slots=True)
class Wrapping:
    """A way to pack a file. `pieces`: "module:function", (stream) → what it holds, in pieces of bounded length."""

    name: str
    suffixes: tuple[str, ...]
    magic: bytes
    pieces: str


WRAPPINGS: tuple[Wrapping, ...] = (
    Wrapping("gzip", (".gz", ".gzip"), b"\x1f\x8b\x08", "sniff.formats.unpacking:gzip_pieces"),
    Wrapping("zstd", (".zst", ".zstd"), b"\x28\xb5\x2f\xfd", "sniff.formats.unpacking:zstd_pieces"),
    Wrapping("bzip2", (".bz2",), b"BZh", "sniff.formats.unpacking:bzip2_pieces"),
    Wrapping("xz", (".xz",), b"\xfd7zXZ\0", "sniff.formats.unpacking:xz_pieces"),
)


def wrapping_of(start: bytes) -> Wrapping | None:
    """How a file that begins so is packed; None when it is not."""
    return next((one for one in WRAPPINGS if start.startswith(one.magic)), None)
