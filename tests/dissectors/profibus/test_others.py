"""No other protocol's capture holds a PROFIBUS telegram, no PROFIBUS capture a frame of another one."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from dissectors import registry
from dissectors.frame import Check, Chunk, Event, Frame
from dissectors.line import LineSettings, Timing
from sniff.formats import read

CAPTURES = Path(__file__).parents[3] / "captures"
OTHERS = [name for name in registry.names() if name != "profibus"]


def events(path: Path, protocol: str, line: str) -> Iterator[Event]:
    """What a protocol's framer makes of a capture."""
    framer = registry.get(protocol).framer(Timing(LineSettings.parse(line)))
    for item in read(path).items():
        if isinstance(item, Chunk):
            yield from framer.feed(Chunk(item.time, item.octets))
    yield from framer.close()


@pytest.mark.parametrize("kind", ["rtu", "ascii", "n2", "mstp"])
@pytest.mark.parametrize("state", ["clean", "noisy-ftdi"])
def test_others_captures_hold_no_telegram(kind: str, state: str) -> None:
    path = CAPTURES / f"{kind}-{state}.cap.txt"
    assert not [one for one in events(path, "profibus", "19200,8E1") if isinstance(one, Frame)]


@pytest.mark.parametrize("other", OTHERS)
def test_captures_of_profibus_hold_nothing_of_others(other: str) -> None:
    good = [
        one
        for one in events(CAPTURES / "profibus-clean.cap.txt", other, "187500,8E1")
        if isinstance(one, Frame) and one.check is Check.GOOD
    ]
    assert not good
