"""The framer contract on PROFIBUS, and what PROFIBUS asks beyond it: tokens and acknowledgements without a check."""

from __future__ import annotations

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from dissectors.frame import Check, Chunk, Event, Frame
from dissectors.line import LineSettings, Timing
from dissectors.profibus.envelope import is_sound
from dissectors.profibus.framing import ProfibusFramer
from dissectors.profibus.telegram import telegram, token
from sniff.testing.framer_contract import framer_contract
from tests.seeds import examples

MS = 1_000_000
START = 10**18
TIMING = Timing(LineSettings.parse("19200,8E1"))

STATUS = telegram(8, 2, 0x49)
ANSWER = telegram(2, 8, 0x00)
DIAGNOSIS = telegram(8, 2, 0x6D, dsap=60, ssap=62)
TOLD = telegram(2, 8, 0x08, bytes((2, 5, 0, 255, 0xF5, 0x10)), dsap=62, ssap=60)
OUTPUTS = telegram(8, 2, 0x5D, bytes(range(32)))
SD3 = bytes.fromhex("A208025D01020304050607088B16")
SC = b"\xe5"

TestProfibusContract = framer_contract(
    ProfibusFramer, st.sampled_from([STATUS, ANSWER, DIAGNOSIS, TOLD, OUTPUTS, SD3]), examples=examples(120)
)

telegrams = st.builds(
    telegram,
    st.integers(0, 127),
    st.integers(0, 126),
    st.sampled_from([0x49, 0x5D, 0x6D, 0x46, 0x00, 0x08, 0x0A, 0x03]),
    st.binary(max_size=244),
    st.one_of(st.none(), st.integers(0, 62)),
    st.one_of(st.none(), st.integers(0, 62)),
)


def read(*parts: bytes, silence: int = 0) -> list[Event]:
    now, framer, events = START, ProfibusFramer(TIMING), []
    for octets in parts:
        now += silence + len(octets) * TIMING.char
        events += framer.feed(Chunk(now, octets))
    return events + framer.close()


def frames(*parts: bytes, silence: int = 0) -> list[bytes]:
    return [event.octets for event in read(*parts, silence=silence) if isinstance(event, Frame) and event.ok]


@given(st.lists(telegrams, min_size=1, max_size=6))
def test_telegrams_without_a_gap_are_all_found(parts):
    assert frames(b"".join(parts)) == parts


@given(st.binary(max_size=300), telegrams, telegrams)
def test_no_octets_hide_the_next_telegram(rubbish, one, two):
    found = frames(rubbish, one, two, silence=200 * MS)
    assert found[-2:] == [one, two]


@given(telegrams, st.integers(0, 400), st.integers(1, 255))
def test_one_wrong_octet_is_never_a_good_telegram(octets, at, change):
    at %= len(octets)
    wrong = octets[:at] + bytes((octets[at] ^ change,)) + octets[at + 1 :]
    good = [event for event in read(STATUS, ANSWER, wrong, silence=200 * MS) if isinstance(event, Frame) and event.ok]
    assert [frame.octets for frame in good if frame.check is Check.GOOD][:2] == [STATUS, ANSWER]
    assert wrong not in [frame.octets for frame in good]


believable = st.lists(
    st.one_of(
        st.builds(token, st.integers(2, 4), st.integers(2, 4)),
        st.lists(st.integers(2, 4), max_size=9).map(lambda way: b"".join(token(to, by) for by, to in pairwise(way))),
        st.sampled_from([SC, STATUS[:-1], b"\xdc", b"\x10"]),
        st.binary(max_size=3),
    ),
    max_size=40,
).map(b"".join)
"""Octets that begin as telegrams do, and tokens in any order: some of them may be passed on."""


@given(st.one_of(st.binary(max_size=400), believable))
def test_octets_without_a_telegram_show_no_acknowledgement_and_tokens_only_in_a_chain(octets):
    if any(is_sound(octets[a:b]) for a in range(len(octets)) for b in (a + 6, a + 14)):
        return
    believed = frames(octets)
    assert SC not in believed
    tokens = [(one[2], one[1]) for one in believed if one[:1] == b"\xdc"]
    assert all(any(to == by for by, _ in tokens) or any(by == to for _, to in tokens) for by, to in tokens)


def test_tokens_without_a_chain_are_believed_nowhere():
    assert frames(token(3, 2) + token(5, 4) + token(7, 6)) == []
    assert frames(SC + token(3, 2) + SC + token(5, 4) + SC) == []


def test_tokens_are_told_by_the_ring_alone():
    ring = [token(3, 2), token(5, 3), token(2, 5), token(3, 2)]
    assert frames(b"".join(ring)) == ring
    assert frames(token(3, 2)) == []
    assert frames(token(2, 2) + STATUS) == [token(2, 2), STATUS]
    assert frames(token(7, 5) + STATUS) == [STATUS]
    assert frames(STATUS, token(2, 2), silence=300 * MS) == [STATUS, token(2, 2)]
    assert frames(STATUS, token(7, 2), silence=300 * MS) == [STATUS]  # nobody there sends
    assert frames(STATUS, b"\x01\x02\x03\x04" + token(9, 8), silence=300 * MS) == [STATUS]


def test_an_acknowledgement_needs_a_request():
    asked = telegram(8, 2, 0x5D, b"\x00", dsap=61, ssap=62)
    assert frames(SC) == []
    assert frames(asked + SC + SC) == [asked, SC]
    assert frames(asked, b"\x00" + SC, silence=200 * MS) == [asked, SC]
    assert frames(telegram(127, 2, 0x46, b"\x00\x00", dsap=58, ssap=62) + SC) == [
        telegram(127, 2, 0x46, b"\x00\x00", dsap=58, ssap=62)
    ]
