"""A master that looks who is there: the same of one unit after the other, in the shortest of all frames."""

from __future__ import annotations

import pytest

from dissectors.frame import Chunk, Frame
from dissectors.line import LineSettings, Timing
from dissectors.modbus.envelope import seal_rtu
from dissectors.modbus.framing import RtuFramer
from tests.dissectors.modbus.judged import findings_of, graves_of

SERVER_ID = bytes.fromhex("110950756d702d333341ff")


@pytest.mark.parametrize("function", [0x07, 0x0B, 0x0C, 0x11])
def test_frames_of_four_octets_are_found_without_silences_between(function):
    """A log has no times: each of these frames alone says little beside its check."""
    said = [seal_rtu(bytes((unit, function))) for unit in range(1, 60)]
    framer = RtuFramer(Timing(LineSettings.parse("19200,8E1"), latency=1_000_000_000))
    events = [*framer.feed(Chunk(0, b"".join(said))), *framer.close()]
    assert [event.octets for event in events if isinstance(event, Frame) and not event.damage] == said


def test_units_that_are_searched_are_not_said_to_be_missed_here(paper_bus):
    """The adapter hides whether the master waited: its timeout is not much longer than an answer and a pause."""
    bus = paper_bus(latency=16_000_000)
    for turn in range(4):
        bus.exchange(bytes((5, 0x11)), bytes((5,)) + SERVER_ID, 20, 20 + turn)
    for unit in range(20, 60):
        bus.say(bytes((unit, 0x11)), 40)
    bus.say(bytes((5, 0x11)), 40)
    assert graves_of(bus) == set()
    assert any(one.code == "MB402" for one in findings_of(bus))
