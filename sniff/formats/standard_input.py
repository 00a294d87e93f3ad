"""A capture on standard input (`-`): told by its first octets, else a text capture or a byte log.

It is put into a temporary file, which goes when the program ends: captures are read more than once, and need not fit
into memory.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

from sniff.engine.capture import Capture, CaptureError
from sniff.formats.files import explain
from sniff.formats.plain_text import is_text_capture

MAGICS = {
    b"\x89MCAP0\r\n": ".mcap",
    b"\x0a\x0d\x0d\x0a": ".pcapng",
    b"\xd4\xc3\xb2\xa1": ".pcap",
    b"\xa1\xb2\xc3\xd4": ".pcap",
    b"\x4d\x3c\xb2\xa1": ".pcap",
    b"\xa1\xb2\x3c\x4d": ".pcap",
}
TEXT, LOG = ".cap.txt", ".log"
LONGEST = 4 * 1024**3
"""Octets; what is longer belongs into a file."""

SAMPLE = 1 << 20
"""Octets looked at to tell a text capture from a byte log."""

_AT_ONCE = 1 << 20
_kept: list[tempfile.TemporaryDirectory[str]] = []  # until the program ends


def read() -> Capture:
    """Read all of standard input. Raises CaptureError."""
    from sniff import formats
    from sniff.formats import text

    folder = tempfile.TemporaryDirectory(prefix="sniff485-")
    _kept.append(folder)
    path = Path(folder.name) / "standard-input"
    try:
        with path.open("wb") as file:
            _copy(sys.stdin.buffer, file)
        suffix = _suffix_of(path)
        path = path.rename(f"{path}{suffix}")
        capture = text.read(path, "-") if suffix == TEXT else formats.read(path)
    except OSError as error:
        raise explain(error.filename or "-", error) from None
    except CaptureError as error:
        raise CaptureError(str(error).replace(str(path), "-")) from None
    if capture.session.port == path.name:  # of a format that does not say it
        capture.session = replace(capture.session, port="-")
    return capture


def _copy(source: BinaryIO, file: BinaryIO) -> None:
    left = LONGEST
    while block := source.read(_AT_ONCE):
        left -= len(block)
        if left < 0:
            raise CaptureError(f"-: over {LONGEST} octets on standard input; put it into a file")
        file.write(block)


def _suffix_of(path: Path) -> str:
    with path.open("rb") as file:
        start = file.read(SAMPLE)
    for magic, suffix in MAGICS.items():
        if start.startswith(magic):
            return suffix
    return TEXT if is_text_capture(start.splitlines()) else LOG
