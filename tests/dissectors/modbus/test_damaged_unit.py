"""Which station a damaged frame names."""

from __future__ import annotations

from dissectors.frame import Chunk, Frame
from dissectors.line import LineSettings, Timing
from dissectors.modbus.ascii_framing import AsciiFramer
from dissectors.modbus.damaged_unit import unit_of
from dissectors.modbus.envelope import ascii_adu, seal_ascii
from dissectors.modbus.header import peek_ascii
from dissectors.modbus.tracker import ModbusTracker

TIMING = Timing(LineSettings.parse("9600,7E1"))
REQUEST = bytes.fromhex("C8030010000A")
KNOWN = {0x01, 0x11, 0xC8}


def framed(characters: bytes) -> Frame:
    framer = AsciiFramer(TIMING)
    events = framer.feed(Chunk(1_000_000_000, characters)) + framer.close()
    frame = events[0]
    assert isinstance(frame, Frame)
    return frame


def spoilt(at: int, character: bytes) -> bytes:
    whole = seal_ascii(REQUEST)
    return whole[:at] + character + whole[at + 1 :]


def test_the_check_tells_the_station_where_one_character_of_it_is_wrong() -> None:
    assert unit_of(framed(spoilt(1, b"4")), 0x48, KNOWN) == 0xC8
    assert unit_of(framed(spoilt(2, b"0")), 0xC0, KNOWN) == 0xC8


def test_a_station_that_is_known_or_that_the_check_makes_unknown_stays_as_read() -> None:
    assert unit_of(framed(spoilt(1, b"4")), 0x48, KNOWN | {0x48}) == 0x48
    assert unit_of(framed(spoilt(1, b"4")), 0x48, {0x01}) == 0x48
    assert unit_of(framed(spoilt(6, b"3")), 0xC8, KNOWN) == 0xC8


def test_what_stands_before_a_character_that_is_no_digit_is_read() -> None:
    assert ascii_adu(framed(spoilt(3, b" "))) == b"\xc8"


def test_a_damaged_frame_that_names_another_station_is_no_answer_of_the_one_asked() -> None:
    tracker = ModbusTracker(TIMING, 0)
    framer = AsciiFramer(TIMING)
    said = [("010300000001", 0), ("0103020007", 20), ("C80300000001", 50), ("C803020007", 20), ("010300000001", 50)]
    time = 1_000_000_000
    events = []
    for adu, gap in said:
        time += gap * 1_000_000 + 20_000_000
        events += framer.feed(Chunk(time, seal_ascii(bytes.fromhex(adu))))
    events += framer.feed(Chunk(time + 40_000_000, spoilt(8, b"\x12")))
    placements = [tracker.track(no, one, peek_ascii(one)).placement for no, one in enumerate(events, 1)]
    assert placements[-1] is not None
    assert (placements[-1].source, placements[-1].destination) == (None, 0xC8)
