"""What comes in place of answers: with seven bits, as the request badly heard, as signs that are no text."""

from __future__ import annotations

import random

import pytest

from dissectors.modbus.envelope import seal_rtu
from dissectors.modbus.garbage import is_bad_copy, parity_of, text_of
from tests.dissectors.modbus.judged import findings_of, graves_of

READ = "050300200004"


@pytest.fixture
def bus(paper_bus):
    return paper_bus()


def seven(octets: bytes, odd: bool) -> bytes:
    """As a UART with 7 data bits and a parity sends them, read with 8."""
    return bytes(low | 0x80 * (low.bit_count() % 2 != odd) for low in (octet & 0x7F for octet in octets))


@pytest.mark.parametrize("odd", [False, True])
def test_seven_data_bits_of_one_station(bus, odd):
    dice = random.Random(5)
    for _ in range(6):
        bus.exchange("020300000001", "0203020007")
        bus.say(READ, 200).noise(seven(seal_rtu(b"\5\3\x08" + dice.randbytes(8)), odd))
    assert graves_of(bus) == {("MB014", "station 5")}
    (finding,) = (one for one in findings_of(bus) if one.code == "MB014")
    assert f"all its octets have {'odd' if odd else 'even'} parity" in finding.seen
    assert finding.means.startswith("the device sends 7 data bits")


def test_octets_of_any_parity_have_none():
    dice = random.Random(6)
    assert not parity_of([dice.randbytes(13) for _ in range(8)])
    assert not parity_of([seven(dice.randbytes(13), False) for _ in range(1)])


def test_the_request_badly_heard_is_no_other_protocol(bus):
    request = seal_rtu(bytes.fromhex(READ))
    for turn in range(4):
        copy = bytes(octet | (0xF0, 0x80, 0x18, 0xE0)[(turn + at) % 4] for at, octet in enumerate(request))
        bus.say(READ, 900).noise(copy, 0.4)
    assert graves_of(bus) == {("MB018", "station 5")}
    (finding,) = (one for one in findings_of(bus) if one.code == "MB018")
    assert "the request came back, with bits changed to one side" in finding.seen


def test_chance_keeps_not_all_bits():
    dice = random.Random(7)
    request = seal_rtu(bytes.fromhex(READ))
    assert not any(is_bad_copy(request, dice.randbytes(len(request))) for _ in range(2000))
    assert not is_bad_copy(request, request)


def test_bits_that_ring_are_no_text():
    assert text_of([b"@ @@", b"@ @` @@`", b"@ @@@ `"] * 3) is None
    assert text_of([b"(NAKss\r", b"(230.1 49.9\r"] * 2) is not None
