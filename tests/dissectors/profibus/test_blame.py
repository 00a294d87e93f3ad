"""Whose damage it is: a slave with long answers is struck by most of what falls anywhere, and not to blame for it."""

from __future__ import annotations

from random import Random

import pytest

from dissectors.findings import Severity
from dissectors.profibus.blame import SentOctets
from dissectors.profibus.telegram import telegram
from tests.dissectors.profibus.test_slaves import found, judged


@pytest.mark.parametrize(
    ("octets", "struck", "damaged", "is_own"),
    [
        (100, 3, 3, True),  # a tenth of all octets
        (400, 3, 3, False),
        (400, 5, 5, True),
        (400, 10, 11, True),
        (800, 10, 10, False),
        (800, 30, 30, True),
        (100, 17, 20, False),  # less than nearly all
        (990, 99, 100, False),
    ],
)
def test_a_slave_is_named_where_chance_would_seldom_strike_any_so_often(
    octets: int, struck: int, damaged: int, is_own: bool
) -> None:
    sent = SentOctets()
    sent.count(1000, {5: octets, 6: 1, 7: 1})
    assert sent.is_its_own(5, struck, damaged) is is_own


def test_noise_on_long_answers_is_the_bus() -> None:
    dice, telegrams = Random(3), []
    for turn in range(120):
        for address, length in ((5, 120), (6, 1), (7, 1)):
            answer = bytearray(telegram(1, address, 0x08, bytes(length)))
            answer[dice.randrange(5, len(answer))] ^= 0x40 * (address == 5 and turn % 12 == 11)
            telegrams += [(1, telegram(address, 1, 0x5D | turn % 2 << 5, b"\0")), (1, bytes(answer))]
    told = found(judged(telegrams), "PB008")
    assert told is not None
    assert (told.subject, told.severity) == ("bus", Severity.WARNING)


def test_damage_of_one_of_several_slaves_is_its_own() -> None:
    telegrams = []
    for turn in range(60):
        for address in (5, 6, 7):
            answer = bytearray(telegram(1, address, 0x08, b"\7\7"))
            answer[5] ^= 0x40 * (address == 6 and turn % 9 == 8)
            telegrams += [(1, telegram(address, 1, 0x5D | turn % 2 << 5, b"\0")), (1, bytes(answer))]
    told = found(judged(telegrams), "PB008")
    assert told is not None
    assert (told.about.station, told.severity) == (6, Severity.WARNING)
