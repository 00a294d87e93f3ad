"""Every small file of `captures/` cut anywhere: read or refused, never a traceback, never more than was there."""

from __future__ import annotations

from pathlib import Path

import pytest

from dissectors.frame import Chunk
from sniff.engine.capture import CaptureError
from sniff.formats import read
from sniff.formats.several_buses import SeveralBuses

CAPTURES = Path(__file__).parents[2] / "captures"
SMALL = 6000
BEGIN, STEP = 300, 7
"""Octets cut one by one, where headings are; a line behind is longer than the step."""
FILES = sorted(
    path
    for path in CAPTURES.rglob("*")
    if path.is_file() and path.suffix not in (".md", ".frames", ".png") and path.stat().st_size <= SMALL
    and not path.name.endswith(".expect.txt")
)  # fmt: skip


def octets_of(path: Path) -> int:
    """Octets that a file gives; 0 where it is refused. An error is one line."""
    try:
        capture = read(path)
        buses = capture.buses if isinstance(capture, SeveralBuses) else (capture,)
        return sum(len(item.octets) for bus in buses for item in bus.items() if isinstance(item, Chunk))
    except CaptureError as error:
        assert "\n" not in str(error)  # noqa: PT017
        return 0


@pytest.mark.timeout(900)  # a thousand reads of a log
@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(CAPTURES)))
def test_cut_everywhere(path: Path, tmp_path: Path) -> None:
    whole = path.read_bytes()
    most = len(whole)  # a text has at least a character for each octet, a hexdump's `*` aside
    cut = tmp_path / path.name
    for end in (*range(min(BEGIN, len(whole))), *range(BEGIN, len(whole), STEP)):
        cut.unlink(missing_ok=True)  # a file of the same time and size is another one
        cut.write_bytes(whole[:end])
        assert octets_of(cut) <= most
