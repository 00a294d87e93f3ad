"""PROFIBUS telegrams of others: all read with their check good, and what only looks like PROFIBUS is not claimed."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from dissectors import registry
from dissectors.frame import Chunk, Frame
from dissectors.line import LineSettings, Timing
from dissectors.profibus import ProfibusFramer
from sniff.analysis.autodetect import Detecting
from sniff.formats import read
from tests.cases.reading import case

CAPTURES = Path(__file__).parents[2] / "../shared/captures"
TIMING = Timing(LineSettings.parse("19200,8E1"))


def frames_of(folder: str) -> tuple[list[bytes], list[bytes]]:
    """The octets of each line, and the good frames that they hold with a silence before each line."""
    path = CAPTURES / folder / "frames.txt"
    if not path.is_file():
        pytest.skip("the shared captures are not here")
    lines = [line.split(";")[0].split("ok")[0] for line in path.read_text().splitlines() if re.match(r"\d", line)]
    sent = [bytes.fromhex(line.split(" ", 1)[1].strip()) for line in lines]
    framer, now, events = ProfibusFramer(TIMING), 10**18, []
    for octets in sent:
        now += 200_000_000 + len(octets) * TIMING.char
        events += framer.feed(Chunk(now, octets))
    return sent, [event.octets for event in (*events, *framer.close()) if isinstance(event, Frame)]


def test_quoted_telegrams_are_all_found() -> None:
    sent, found = frames_of("profibus-dp-excerpts")
    assert found == sent


def test_a_display_bus_is_not_claimed() -> None:
    sent, found = frames_of("negative-logo-td")
    assert len(sent) == 7
    assert found == []


def test_a_start_up_is_told_from_all_other_protocols() -> None:
    detecting = Detecting((TIMING.line,), registry.names())
    for item in read(case("mstp/i26.hex")).items():
        if isinstance(item, Chunk):
            detecting.feed(item)
    assert detecting.found is not None
    assert detecting.found.protocol == "profibus"
