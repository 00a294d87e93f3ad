"""Answers that end in place of the next one are put together; what is only damaged never is."""

from __future__ import annotations

from random import Random

import pytest

from dissectors.modbus.carried_over import CarriedOver
from dissectors.modbus.envelope import seal_rtu

UNITS = (1, 2)
REQUESTS = {unit: seal_rtu(bytes((unit, 3, 0, 0, 0, 2))) for unit in UNITS}


def answer(dice: Random, unit: int) -> bytes:
    return seal_rtu(bytes((unit, 3, 4)) + dice.randbytes(4))


@pytest.mark.parametrize("short", range(1, 9))
def test_who_reads_too_few_octets_finds_each_answer_later(short):
    dice, carried, kept = Random(short), CarriedOver(), b""
    for turn in range(20):
        unit = UNITS[turn % 2]
        kept += answer(dice, unit)
        taken, kept = kept[: 9 - (short if turn == 0 else 0)], kept[9 - (short if turn == 0 else 0) :]
        carried.hear(REQUESTS[unit], taken, turn)
    assert carried.tally.count == 19
    assert carried.is_across
    assert carried.units == {1, 2}


def test_damage_is_not_carried_over():
    dice, carried = Random(5), CarriedOver()
    for turn in range(500):
        octets = bytearray(answer(dice, UNITS[turn % 2]))
        if turn % 3:
            octets[dice.randrange(9)] ^= 1 << dice.randrange(8)
        else:
            del octets[dice.randrange(9)]
        carried.hear(REQUESTS[UNITS[turn % 2]], bytes(octets), turn)
    assert carried.tally.count == 0


def test_nothing_is_left_of_before_a_good_answer():
    carried, whole = CarriedOver(), answer(Random(1), 1)
    carried.hear(REQUESTS[1], whole[:5], 0)
    carried.begin_anew()
    carried.hear(REQUESTS[1], whole[5:], 1)
    assert not carried.tally.count
