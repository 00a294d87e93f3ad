"""A capture on standard input (`-`): told by what is in it, as a file is.

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

TEXT = "text capture"
"""Its errors name lines, which are those of standard input."""
LONGEST = 4 * 1024**3
"""Octets; what is longer belongs into a file."""

_AT_ONCE = 1 << 20
_kept: list[tempfile.TemporaryDirectory[str]] = []  # until the program ends


def read() -> Capture:
    """Read all of standard input. Raises CaptureError."""
    from sniff import formats
    from sniff.formats import table, text

    folder = tempfile.TemporaryDirectory(prefix="sniff485-")
    _kept.append(folder)
    path = Path(folder.name) / "standard-input"
    try:
        with path.open("wb") as file:
            _copy(sys.stdin.buffer, file)
        told = table.told(formats.start_of(path), "")
        capture = text.read(path, "-") if told is None or told.name == TEXT else formats.read(path)
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
