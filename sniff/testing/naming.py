"""Names of captures and their expectations. Imports nothing of the program."""

from __future__ import annotations

from pathlib import Path

EXPECT_SUFFIX = ".expect.txt"
CAPTURE_SUFFIXES = (".cap.txt", ".mcap", ".pcapng", ".pcap")


def expectation_path(capture: Path) -> Path:
    """Where the expectation of a capture stands: poll.cap.txt → poll.expect.txt."""
    for suffix in CAPTURE_SUFFIXES:
        if capture.name.endswith(suffix):
            return capture.with_name(capture.name.removesuffix(suffix) + EXPECT_SUFFIX)
    return capture.with_name(capture.name + EXPECT_SUFFIX)


def is_capture(path: Path) -> bool:
    """Whether a file is a capture by its name, or of another kind (a log, a table), of which something is expected."""
    if path.name.endswith(EXPECT_SUFFIX):
        return False
    return path.name.endswith(CAPTURE_SUFFIXES) or expectation_path(path).exists()
