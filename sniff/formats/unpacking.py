"""Unpacks files around captures into a temporary file, which goes when the program ends.

A small file that becomes a large one without end (a bomb) is refused before disk or memory is taken: what is unpacked
may be GROWTH times as long as the file, or LITTLE octets, and never more than LONGEST.
"""

from __future__ import annotations

import bz2
import lzma
import tempfile
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

from sniff.engine.capture import CaptureError
from sniff.formats.compressed import Wrapping
from sniff.formats.files import explain, open_capture
from sniff.formats.table import function

GROWTH = 200
LITTLE = 64 << 20
LONGEST = 4 << 30

_AT_ONCE = 1 << 16
_PIECE = 1 << 20
_ZSTD_AT_ONCE = 1 << 9
"""Octets given to its unpacker, which has no bound of its own: four of them may become a block of 128 KiB."""
_WINDOW = 1 << 27
"""Octets that an unpacker may hold: what zstd itself allows without being asked."""
_kept: list[tempfile.TemporaryDirectory[str]] = []  # until the program ends


@dataclass(frozen=True, slots=True)
class Unpacked:
    """What was in a packed file. `damage`: where it was cut or damaged, "" when whole; what came before is there."""

    path: Path
    damage: str = ""


def unpack(path: Path, wrapping: Wrapping) -> Unpacked:
    """The file within, under the name that it had. Raises CaptureError for a bomb and for a full disk."""
    folder = tempfile.TemporaryDirectory(prefix="sniff485-")
    _kept.append(folder)
    name = next((path.name[: -len(one)] for one in wrapping.suffixes if path.name.lower().endswith(one)), path.name)
    inner = Path(folder.name) / (name or "capture")
    damage = ""
    try:
        size = path.stat().st_size
        left = most = min(LONGEST, max(LITTLE, GROWTH * size))
        with open_capture(path) as stream, inner.open("wb") as file:
            try:
                for piece in function(wrapping.pieces)(stream):
                    left -= len(piece)
                    if left < 0:
                        raise CaptureError(
                            f"{path}: {wrapping.name}: {size} octets become more than {most}; unpack it yourself if "
                            "that is meant"
                        )
                    file.write(piece)
            except (zlib.error, lzma.LZMAError, EOFError, ValueError, _zstd_error()) as error:
                damage = f"{wrapping.name}: damaged or cut ({error})"
    except OSError as error:
        raise explain(path, error) from None
    if damage and not inner.stat().st_size:
        raise CaptureError(f"{path}: {damage}; nothing of it can be read")
    return Unpacked(inner, damage)


def gzip_pieces(stream: BinaryIO) -> Iterator[bytes]:
    """What a gzip file holds: one member after another."""
    octets = stream.read(_AT_ONCE)
    while octets:
        unpacker = zlib.decompressobj(wbits=31)
        while not unpacker.eof:
            if not octets:
                raise EOFError("it ends within")
            if piece := unpacker.decompress(octets, _PIECE):
                yield piece
            octets = unpacker.unconsumed_tail or (b"" if unpacker.eof else stream.read(_AT_ONCE))
        octets = _behind_padding(unpacker.unused_data, stream)


def bzip2_pieces(stream: BinaryIO) -> Iterator[bytes]:
    """What a bzip2 file holds."""
    yield from _stream_pieces(stream, bz2.BZ2Decompressor)


def xz_pieces(stream: BinaryIO) -> Iterator[bytes]:
    """What an xz file holds; one that wants more memory than `_WINDOW` is refused by its own library."""
    yield from _stream_pieces(stream, lambda: lzma.LZMADecompressor(lzma.FORMAT_XZ, memlimit=_WINDOW))


def zstd_pieces(stream: BinaryIO) -> Iterator[bytes]:
    """What a zstd file holds: one frame after another."""
    import zstandard

    octets = stream.read(_ZSTD_AT_ONCE)
    while octets:
        unpacker = zstandard.ZstdDecompressor(max_window_size=_WINDOW).decompressobj()
        while not unpacker.eof:
            if not octets:
                raise EOFError("it ends within")
            if piece := unpacker.decompress(octets):
                yield piece
            octets = b"" if unpacker.eof else stream.read(_ZSTD_AT_ONCE)
        octets = unpacker.unused_data or stream.read(_ZSTD_AT_ONCE)


def _stream_pieces(stream: BinaryIO, make: Callable[[], Any]) -> Iterator[bytes]:
    """One stream after another: programs that pack with several processors make many."""
    octets = stream.read(_AT_ONCE)
    while octets:
        unpacker = make()
        while not unpacker.eof:
            if unpacker.needs_input and not octets:
                octets = stream.read(_AT_ONCE)
                if not octets:
                    raise EOFError("it ends within")
            try:
                piece = unpacker.decompress(octets, _PIECE)
            except OSError as error:  # of bz2, for data that are none; the file was read
                raise ValueError(str(error)) from None
            if piece:
                yield piece
            octets = b""
        octets = _behind_padding(unpacker.unused_data, stream)


def _behind_padding(octets: bytes, stream: BinaryIO) -> bytes:
    """What comes next, zeros aside, as tapes have them; empty at the end."""
    octets = octets or stream.read(_AT_ONCE)
    while octets and not octets.strip(b"\0"):
        octets = stream.read(_AT_ONCE)
    return octets.lstrip(b"\0")


def _zstd_error() -> type[Exception]:
    import zstandard

    error: type[Exception] = zstandard.ZstdError
    return error
