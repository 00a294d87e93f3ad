"""What Modbus exchanges tell."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dissectors.frame import Check, Damage, FoundBy, Frame
from dissectors.modbus.envelope import seal_ascii, seal_rtu
from dissectors.modbus.readings import readings, refusal
from dissectors.readings import Origin


def frame(pdu: str | bytes, damage: Damage | None = None, is_ascii: bool = False) -> Frame:
    octets = bytes.fromhex(pdu) if isinstance(pdu, str) else pdu
    sealed = seal_ascii(octets) if is_ascii else seal_rtu(octets)
    name = "modbus-ascii" if is_ascii else "modbus-rtu"
    return Frame(name, sealed, 0, 1, Check.BAD if damage else Check.GOOD, FoundBy.GAP, damage)


def told(request: str, response: str | None, is_ascii: bool = False) -> list[tuple[str, int, int | float | str, str]]:
    answer = None if response is None else frame(response, is_ascii=is_ascii)
    found = readings(frame(request, is_ascii=is_ascii), answer)
    return [(reading.space, reading.address, reading.value, reading.how.value) for reading in found]


@pytest.mark.parametrize("is_ascii", [False, True])
@pytest.mark.parametrize(
    ("request_pdu", "response_pdu", "expected"),
    [
        ("010300100002", "010304000102", []),  # a count that the octets do not fill
        ("010300100002", "0103040001ffff", [("holding", 16, 1, "read"), ("holding", 17, 0xFFFF, "read")]),
        ("0104ffff0002", "010404000a000b", [("input", 65535, 10, "read"), ("input", 0, 11, "read")]),
        ("010100130003", "01010105", [("coil", 19, 1, "read"), ("coil", 20, 0, "read"), ("coil", 21, 1, "read")]),
        ("010200000001", "01020100", [("discrete", 0, 0, "read")]),
        ("010300100002", "018302", []),
        ("010300100002", "010302ffff", []),
        ("0105000aff00", "0105000aff00", [("coil", 10, 1, "write")]),
        ("0105000a1234", "0105000a1234", []),
        ("010625021770", "010625021770", [("holding", 0x2502, 6000, "write")]),
        ("010625021770", "018604", []),
        ("010f0013000a02cd01", "010f0013000a", [("coil", 19 + n, int(c), "write") for n, c in enumerate("1011001110")]),
        ("01102501000204000117700000", "011025010002", []),  # more octets than it counts
        (
            "011025010002040001 1770",
            "011025010002",
            [("holding", 0x2501, 1, "write"), ("holding", 0x2502, 6000, "write")],
        ),
        (
            "011700010001000200010200ff",
            "0117020007",
            [("holding", 2, 255, "write"), ("holding", 1, 7, "read")],
        ),
        ("010800000001", "010800000001", []),
        ("0111", "011101ff", []),
    ],
)
def test_exchanges(request_pdu: str, response_pdu: str, expected: list[object], is_ascii: bool) -> None:
    assert told(request_pdu, response_pdu, is_ascii) == expected


def test_a_request_alone_tells_only_what_it_writes() -> None:
    assert told("010625021770", None) == [("holding", 0x2502, 6000, "write")]
    assert told("010300100002", None) == []


def test_damaged_frames_tell_nothing() -> None:
    good, bad = frame("010300100001"), frame("0103020001", Damage.CHECK)
    assert readings(good, bad) == ()
    assert readings(frame("010625021770", Damage.CHECK), frame("010625021770")) == ()
    assert readings(None, frame("0103020001")) == ()


def test_another_unit_did_not_answer() -> None:
    assert told("010300100001", "0203020001") == []


def test_refusals() -> None:
    assert refusal(frame("018352")) == ("modbus", 0x52)
    assert refusal(frame("0103020001")) is None


@given(st.binary(max_size=20), st.none() | st.binary(max_size=20), st.booleans())
def test_any_octets(request_pdu: bytes, response_pdu: bytes | None, is_ascii: bool) -> None:
    answer = None if response_pdu is None else frame(response_pdu, is_ascii=is_ascii)
    for reading in readings(frame(request_pdu, is_ascii=is_ascii), answer):
        assert 0 <= reading.address <= 0xFFFF
        assert isinstance(reading.how, Origin)
