"""A capture on standard input (`-`): told by its first octets, else a text capture or a byte log."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from sniff.formats import Capture, CaptureError

MAGICS = {
    b"\x89MCAP0\r\n": ".mcap",
    b"\x0a\x0d\x0d\x0a": ".pcapng",
    b"\xd4\xc3\xb2\xa1": ".pcap",
    b"\xa1\xb2\xc3\xd4": ".pcap",
    b"\x4d\x3c\xb2\xa1": ".pcap",
    b"\xa1\xb2\x3c\x4d": ".pcap",
}
LONGEST = 4 * 1024**3
"""Octets; what is longer belongs into a file."""

SAMPLE = 1 << 20
"""Octets looked at to tell a text capture from a byte log."""

_kept: list[tempfile.TemporaryDirectory[str]] = []  # until the program ends: captures are read more than once


def read() -> Capture:
    """Read all of standard input. Raises CaptureError."""
    from sniff import formats
    from sniff.formats import text
    from sniff.formats.plain_text import is_text_capture

    data = sys.stdin.buffer.read(LONGEST + 1)
    if len(data) > LONGEST:
        raise CaptureError(f"-: over {LONGEST} octets on standard input; put it into a file")
    suffix = next((suffix for magic, suffix in MAGICS.items() if data.startswith(magic)), "")
    if not suffix:
        if is_text_capture(data[:SAMPLE].splitlines()):
            try:
                return text.parse(data.decode("utf-8"), "-")
            except UnicodeDecodeError as error:
                raise CaptureError(f"-: neither a capture file nor a text capture (octet {error.start})") from None
        suffix = ".log"
    folder = tempfile.TemporaryDirectory(prefix="sniff485-")
    _kept.append(folder)
    path = Path(folder.name) / f"standard-input{suffix}"
    path.write_bytes(data)
    try:
        return formats.read(path)
    except CaptureError as error:
        raise CaptureError(str(error).replace(str(path), "-")) from None
