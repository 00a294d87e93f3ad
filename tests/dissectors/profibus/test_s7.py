"""Programs of S7 controllers, which share the telegrams of PROFIBUS and are no data exchange."""

from __future__ import annotations

import pytest

from dissectors.frame import Check, FoundBy, Frame, Role
from dissectors.profibus.header import peek
from dissectors.profibus.readings import readings
from dissectors.profibus.services import Service, service_of
from dissectors.profibus.telegram import parse, telegram
from dissectors.profibus.text import text
from tests.dissectors.profibus.test_slaves import judged

READ = bytes.fromhex("32010000000A000E00000401120A10020001000184000320")
READ_ANSWER = bytes.fromhex("32030000000A0002000500000401FF04000807")
REFUSED = bytes.fromhex("32020000000B000000008104")


def _said(octets: bytes) -> str:
    frame = Frame("profibus", octets, 0, 0, Check.GOOD, FoundBy.DELIMITER)
    return text(frame, peek(frame), Role.REQUEST)


@pytest.mark.parametrize(
    ("octets", "words"),
    [
        (telegram(2, 0, 0x6C, READ), "S7: read, request 10"),
        (telegram(0, 2, 0x08, READ_ANSWER), "S7: read, answer 10"),
        (telegram(0, 2, 0x08, REFUSED), "S7: acknowledgement 11, refused: error class 81h, code 04h"),
        (telegram(2, 0, 0x5C, b"\xf1\x05" + READ, 20, 3), "S7: read, request 10"),
    ],
)
def test_on_ppi_and_mpi(octets: bytes, words: str) -> None:
    assert service_of(parse(octets)) is Service.PROGRAM
    assert words in _said(octets)


@pytest.mark.parametrize(
    "octets",
    [
        telegram(2, 0, 0x6C, READ[:-1]),  # its lengths do not agree
        telegram(2, 0, 0x6C, b"\x32\x01\x00\x00"),
        telegram(2, 0, 0x5C, b"\xf2\x05" + READ, 20, 3),
        telegram(2, 0, 0x5C, b"\xf1\x05" + READ),  # without access points
        telegram(2, 0, 0x5C),  # fetches the answer
    ],
)
def test_what_has_no_message_is_what_it_was(octets: bytes) -> None:
    assert service_of(parse(octets)) is Service.OTHER


def test_ppi_shows_no_slave_and_no_inputs() -> None:
    turn = [
        (1, telegram(2, 0, 0x6C, READ)),
        (1, b"\xe5"),
        (1, telegram(2, 0, 0x5C)),
        (1, telegram(0, 2, 8, READ_ANSWER)),
    ]
    judge = judged(turn * 5)
    assert not judge.ring().slaves
    asked, told = (Frame("profibus", turn[at][1], 0, 0, Check.GOOD, FoundBy.DELIMITER) for at in (2, 3))
    assert readings(asked, told) == ()
