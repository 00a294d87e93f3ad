"""What a read of one octet costs the framer where it can decide nothing."""

from __future__ import annotations

import pytest

from dissectors.bacnet import envelope, framing
from dissectors.checksums import crc8_mstp
from dissectors.frame import Chunk, Event
from dissectors.line import LineSettings, Timing


@pytest.mark.parametrize("before", [b"", b"\x01\x02\x03"], ids=["at-once", "after-noise"])
def test_octets_inside_a_frame_of_known_length_cost_nothing(monkeypatch: pytest.MonkeyPatch, before: bytes) -> None:
    looks: list[bytes] = []

    def counted(octets: bytes) -> int:
        looks.append(octets)
        return crc8_mstp(octets)

    monkeypatch.setattr(framing, "crc8_mstp", counted)
    frame = envelope.frame(6, 1, 2, bytes(400))
    timing = Timing(LineSettings.parse("115200,8N1"), 0)
    framer = framing.MstpFramer(timing)
    events: list[Event] = []
    for number, octet in enumerate(before + frame):
        events += framer.feed(Chunk(number * timing.char, bytes([octet])))
    events += framer.close()
    assert b"".join(event.octets for event in events) == before + frame
    assert events[-1].octets == frame
    assert len(looks) < 10, "the header is checked when it is whole and when the frame is, not at every octet"
