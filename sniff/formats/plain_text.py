"""Text that does not say by its name what it is (`.txt`, standard input): a text capture, or a byte log."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import islice
from pathlib import Path

from sniff.engine.capture import Capture
from sniff.formats import bytelog, text
from sniff.formats.files import open_capture
from sniff.formats.text_line import MAGIC

_LINES_SEEN = 200
_BEGINS = ("+", "~", "-", MAGIC)
"""How a line of a text capture begins; no line of a byte log does."""


def read(path: Path) -> Capture:
    """Open a text capture or a byte log. Raises CaptureError."""
    with open_capture(path) as stream:
        is_ours = is_text_capture(iter(lambda: stream.readline(bytelog.LONGEST_LINE), b""))
    return text.read(path) if is_ours else bytelog.read(path)


def is_text_capture(lines: Iterable[bytes]) -> bool:
    """Whether the first line that is no comment is one of a text capture; so are comments alone."""
    for octets in islice(lines, _LINES_SEEN):
        line = octets.decode("utf-8", "replace").removeprefix("\ufeff").strip()
        if line.startswith(_BEGINS):
            return True
        if line and not line.startswith("#"):
            return False
    return True
