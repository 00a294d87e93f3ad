"""What N2 exchanges tell."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dissectors.frame import Check, Damage, FoundBy, Frame
from dissectors.n2.envelope import make_answer as answer
from dissectors.n2.readings import readings, refusal
from dissectors.n2.simulated import command
from dissectors.n2.simulated import refusal as refuse


def frame(octets: bytes, damage: Damage | None = None) -> Frame:
    return Frame("n2", octets, 0, 1, Check.BAD if damage else Check.GOOD, FoundBy.DELIMITER, damage)


def hex_of(value: float) -> str:
    return struct.pack(">f", value).hex().upper()


def told(body: str, data: str | None, address: int = 5) -> list[tuple[object, ...]]:
    response = None if data is None else frame(answer(data))
    found = readings(frame(command(address, body)), response)
    return [(r.space, r.address, r.value, r.how.value, r.part, r.sure) for r in found]


@pytest.mark.parametrize(
    ("body", "data", "expected"),
    [
        ("110A03", hex_of(45.0), [("AI", 10, 45.0, "read", "", True)]),
        ("110A03", "00" + hex_of(45.0), [("AI", 10, 45.0, "read", "", True)]),
        ("120102", "40", [("BI", 1, 1, "read", "", False)]),
        ("120102", "00", [("BI", 1, 0, "read", "", False)]),
        ("110A01", "01", [("AI", 10, 1, "read", "object-configuration", True)]),
        ("720301" + hex_of(60.0), "", [("AO", 1, 60.0, "write", "", True)]),
        ("720401" + "01", "", [("BO", 1, 1, "write", "", True)]),
        ("120102", "XY", []),
        ("04", "", []),
        ("F", "10", []),
    ],
)
def test_exchanges(body: str, data: str, expected: list[object]) -> None:
    assert told(body, data) == expected


def test_raw_is_what_was_on_the_wire() -> None:
    (reading,) = readings(frame(command(5, "110A03")), frame(answer(hex_of(45.0))))
    assert reading.raw == int(hex_of(45.0), 16)
    (reading,) = readings(frame(command(5, "120102")), frame(answer("41")))
    assert (reading.raw, reading.value) == (0x41, 1)


def test_a_command_alone_tells_what_it_writes() -> None:
    assert told("720301" + hex_of(60.0), None) == [("AO", 1, 60.0, "write", "", True)]
    assert told("110A03", None) == []


def test_refused_and_damaged_tell_nothing() -> None:
    assert readings(frame(command(5, "720301" + hex_of(900.0))), frame(refuse("10"))) == ()
    assert readings(frame(command(5, "110A03")), frame(answer(hex_of(1.0)), Damage.CHECK)) == ()
    assert refusal(frame(refuse("10"))) == ("n2", 10)
    assert refusal(frame(refuse("0A"))) == ("n2", 10)
    assert refusal(frame(answer())) is None


def test_reports_are_never_sure() -> None:
    found = readings(frame(command(1, "04")), frame(answer("301" + "00" + hex_of(2.5))))
    assert [(r.space, r.address, r.value, r.how.value, r.sure) for r in found] == [("AO", 1, 2.5, "report", False)]


@given(st.binary(max_size=24), st.none() | st.binary(max_size=24))
def test_any_octets(request_octets: bytes, response_octets: bytes | None) -> None:
    response = None if response_octets is None else frame(response_octets)
    readings(frame(b">" + request_octets), response)
    refusal(frame(b"N" + request_octets))
