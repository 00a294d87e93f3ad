"""A start character that nothing follows, and the next frame long after it: not the next sender's."""

from __future__ import annotations

from dissectors.frame import Chunk, Frame, Noise, Place
from dissectors.line import LineSettings, Timing
from dissectors.modbus.ascii_framing import AsciiFramer
from dissectors.modbus.envelope import seal_ascii

MS = 1_000_000
TIMING = Timing(LineSettings.parse("9600,8N1"))


def heard(pause: int) -> tuple[Noise, Frame]:
    """A poll, ':0' of an answer 10 ms later, and after a pause the next poll."""
    poll = seal_ascii(bytes.fromhex("030300000002"))
    framer, now, events = AsciiFramer(TIMING), 10**9, []
    for octets, wait in ((poll, 0), (b":0", 10 * MS), (poll, pause)):
        now += wait + len(octets) * TIMING.char
        events += framer.feed(Chunk(now, octets))
    _, noise, frame = events + framer.close()
    assert isinstance(noise, Noise)
    assert isinstance(frame, Frame)
    return noise, frame


def test_stray_octets_long_before_a_frame_stand_between_frames() -> None:
    noise, frame = heard(300 * MS)
    assert (noise.octets, noise.place, frame.ok) == (b":0", Place.BETWEEN, True)


def test_stray_octets_directly_before_a_frame_stand_before_it() -> None:
    assert heard(0)[0].place is Place.BEFORE
