from __future__ import annotations

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from sniff.sources.telnet import LONGEST, Data, Negotiation, OutOfStep, Subnegotiation, TelnetDecoder, Token


def merged(tokens: list[Token]) -> list[Token]:
    """Neighbouring data joined: a cut of the stream may cut data."""
    result: list[Token] = []
    for token in tokens:
        if isinstance(token, Data) and result and isinstance(result[-1], Data):
            result[-1] = Data(result[-1].octets + token.octets)
        else:
            result.append(token)
    return result


def test_everything_in_its_order() -> None:
    stream = b"\x01\xff\xff\x02" + b"\xff\xfb\x2c" + b"\x03" + b"\xff\xfa\x2c\x6a\x04\xff\xff\xff\xf0" + b"\xff\xf1\x04"
    assert TelnetDecoder().feed(stream) == [
        Data(b"\x01\xff\x02"),
        Negotiation(0xFB, 0x2C),
        Data(b"\x03"),
        Subnegotiation(b"\x2c\x6a\x04\xff"),
        Data(b"\x04"),
    ]


@given(st.binary(max_size=60), st.lists(st.integers(0, 120), max_size=6))
def test_any_cut_gives_the_same(data: bytes, cuts: list[int]) -> None:
    stream = data.replace(b"\xff", b"\xff\xff") + b"\xff\xfa\x2c\x01\xff\xf0\x55"
    bounds = sorted({0, len(stream), *(cut for cut in cuts if cut <= len(stream))})
    decoder = TelnetDecoder()
    tokens: list[Token] = []
    for begin, end in pairwise(bounds):
        tokens += decoder.feed(stream[begin:end])
    expected = [Data(data)] if data else []
    assert merged(tokens) == [*expected, Subnegotiation(b"\x2c\x01"), Data(b"\x55")]


@given(st.binary(max_size=200))
def test_any_octets_are_survived(stream: bytes) -> None:
    tokens = TelnetDecoder().feed(stream)
    assert sum(len(token.octets) for token in tokens if isinstance(token, Data | Subnegotiation)) <= len(stream)


def test_a_subnegotiation_without_end_is_no_data() -> None:
    decoder = TelnetDecoder()
    tokens = decoder.feed(b"\x01\xff\xfa" + bytes(10 * LONGEST) + b"\xff\x00\x55")
    assert tokens == [Data(b"\x01"), OutOfStep(LONGEST + 1)]
    assert decoder.feed(b"\xff\xf0\x55") == [], "nobody knows what is data"


def test_what_is_no_end_does_not_end_a_subnegotiation() -> None:
    """An octet FF that the gateway forgot to double: what follows is no bus traffic."""
    assert TelnetDecoder().feed(b"\xff\xfa\x2c\x6a\xff\x04\x05\xff\xf0\x55") == [
        Subnegotiation(b"\x2c\x6a\x05"),
        Data(b"\x55"),
    ]
