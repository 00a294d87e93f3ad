"""The framer contract on the ready-made framers for plain protocols."""

from __future__ import annotations

from functools import reduce
from operator import xor

from hypothesis import strategies as st

from dissectors.checksums import sum8
from dissectors.frame import Check, Chunk, Damage, Frame
from dissectors.line import Timing
from dissectors.plain_framers import Delimited, DelimitedFramer, LengthFramer, Lengthy
from sniff.testing.framer_contract import framer_contract
from tests.seeds import examples

START = 10**18


def bracketed(octets: bytes) -> tuple[Check, Damage | None]:
    good = len(octets) >= 3 and octets[-2] == reduce(xor, octets[1:-2], 0x20) | 0x20
    return (Check.GOOD, None) if good else (Check.BAD, Damage.CHECK)


def bracket(body: bytes) -> bytes:
    return b"<" + body + bytes((reduce(xor, body, 0x20) | 0x20,)) + b"\x03"


def counted(octets: bytes) -> tuple[Check, Damage | None]:
    return (Check.GOOD, None) if sum8(octets[:-1]) == octets[-1] else (Check.BAD, Damage.CHECK)


def count(body: bytes) -> bytes:
    frame = bytes((0xA5, len(body))) + body
    return frame + bytes((sum8(frame),))


def delimited(timing: Timing) -> DelimitedFramer:
    return DelimitedFramer(timing, Delimited("bracketed", b"<", b"\x03", 40, bracketed))


def lengthy(timing: Timing) -> LengthFramer:
    return LengthFramer(timing, Lengthy("counted", b"\xa5", 2, lambda head: head[1] + 3, 40, counted))


plain = st.text("abcdefgh", min_size=1, max_size=12).map(str.encode)
TestDelimitedContract = framer_contract(delimited, plain.map(bracket), examples=examples(120))
TestLengthContract = framer_contract(lengthy, st.binary(min_size=2, max_size=12).map(count), examples=examples(120))


def frames(framer: LengthFramer | DelimitedFramer, octets: bytes) -> list[tuple[bytes, bool]]:
    events = framer.feed(Chunk(START, octets)) + framer.close()
    return [(event.octets, event.ok) for event in events if isinstance(event, Frame)]


def test_a_false_start_does_not_swallow_the_frame_behind_it() -> None:
    good = count(b"hello")
    assert frames(lengthy(Timing()), b"\xa5\x20" + good + good) == [(b"\xa5\x20", False), (good, True), (good, True)]


def test_a_start_begins_a_frame_always() -> None:
    good = bracket(b"abc")
    assert frames(delimited(Timing()), b"<ab" + good) == [(b"<ab", False), (good, True)]


def test_a_frame_cut_anywhere_is_a_damaged_frame() -> None:
    """Also where its header is not whole, and its length not known."""
    for framer, whole in ((lengthy, count(b"hello")), (delimited, bracket(b"abc"))):
        for cut in range(1, len(whole)):
            assert frames(framer(Timing()), whole[:cut]) == [(whole[:cut], False)], cut
            assert frames(framer(Timing()), whole + whole[:cut]) == [(whole, True), (whole[:cut], False)]
