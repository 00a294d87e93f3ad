from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from dissectors.frame import LineError, Mark
from sniff.sources.parmrk import ParmrkDecoder

BOTH = LineError.PARITY | LineError.FRAMING

CASES = {
    "plain": (b"\x01\x02", b"\x01\x02", ()),
    "doubled": (b"\xff\xff", b"\xff", ()),
    "two-doubled": (b"\xff\xff\xff\xff", b"\xff\xff", ()),
    "error": (b"\x01\xff\x00\x41\x02", b"\x01\x41\x02", (Mark(1, BOTH),)),
    "error-on-ff": (b"\xff\x00\xff\x02", b"\xff\x02", (Mark(0, BOTH),)),
    "break": (b"\xff\x00\x00\x01", b"\x00\x01", (Mark(0, LineError.BREAK),)),
    "break-then-error": (b"\xff\x00\x00\xff\x00\x05", b"\x00\x05", (Mark(0, LineError.BREAK), Mark(1, BOTH))),
    "looks-like-an-error": (b"\xff\xff\x00\x41", b"\xff\x00\x41", ()),
    "nonsense": (b"\xff\x07\x01", b"\xff\x07\x01", ()),
}


@pytest.mark.parametrize("name", CASES)
def test_what_the_tty_marks(name: str) -> None:
    stream, octets, marks = CASES[name]
    assert ParmrkDecoder(parity=True).feed(stream) == (octets, marks)


def test_without_parity_an_error_is_framing() -> None:
    assert ParmrkDecoder(parity=False).feed(b"\xff\x00\x41") == (b"\x41", (Mark(0, LineError.FRAMING),))


def test_unfinished_escape_is_given_back() -> None:
    decoder = ParmrkDecoder(parity=False)
    assert decoder.feed(b"\x01\xff\x00") == (b"\x01", ())
    assert decoder.flush() == b"\xff\x00"
    assert decoder.flush() == b""
    assert decoder.feed(b"\x41") == (b"\x41", ())


line = st.lists(
    st.one_of(
        st.tuples(st.integers(0, 255), st.none()),
        st.tuples(st.integers(1, 255), st.just(BOTH)),
        st.tuples(st.just(0), st.just(LineError.BREAK)),
        st.tuples(st.just(0xFF), st.none()),
    ),
    max_size=40,
)


def as_the_tty_does(octet: int, error: LineError | None) -> bytes:
    if error is not None:
        return bytes([0xFF, 0x00, octet])
    return b"\xff\xff" if octet == 0xFF else bytes([octet])


@given(line, st.lists(st.integers(0, 130), max_size=8))
def test_any_cut_gives_the_line_back(events: list[tuple[int, LineError | None]], cuts: list[int]) -> None:
    stream = b"".join(as_the_tty_does(*event) for event in events)
    bounds = sorted({0, len(stream), *(cut for cut in cuts if cut <= len(stream))})
    decoder = ParmrkDecoder(parity=True)
    octets = bytearray()
    marks: list[Mark] = []
    for begin, end in pairwise(bounds):
        some, marked = decoder.feed(stream[begin:end])
        marks += [Mark(mark.offset + len(octets), mark.error) for mark in marked]
        octets += some
    assert decoder.flush() == b""
    assert bytes(octets) == bytes(octet for octet, _ in events)
    assert marks == [Mark(at, error) for at, (_, error) in enumerate(events) if error is not None]


MARKED = st.lists(st.sampled_from((0xFF, 0xFF, 0x00, 0x00, 0x41)), max_size=20).map(bytes)


@given(st.lists(st.one_of(st.binary(max_size=20), MARKED), max_size=10))
@example([b"A\xff", b"\x00A\xff\x00\x00", b"\xff\xff\xff\x00\x41"])
def test_any_octets_are_survived_and_none_invented(reads: list[bytes]) -> None:
    decoder = ParmrkDecoder(parity=False)
    given_back = 0
    for read in reads:
        octets, marks = decoder.feed(read)
        given_back += len(octets) + 2 * len(marks)
        assert all(0 <= mark.offset < len(octets) for mark in marks)
        assert [mark.offset for mark in marks] == sorted({mark.offset for mark in marks})
    doubled = sum(map(len, reads)) - given_back - len(decoder.flush())
    assert 0 <= doubled <= b"".join(reads).count(b"\xff")
