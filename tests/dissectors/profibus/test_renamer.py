"""Telegrams that are given away name nobody, and fit one another as before."""

from __future__ import annotations

import pytest

from dissectors.frame import Check, Damage, FoundBy, Frame
from dissectors.profibus.diagnosis import parse_diagnosis
from dissectors.profibus.envelope import is_sound
from dissectors.profibus.parameters import parse_new_address
from dissectors.profibus.renamer import ProfibusRenamer
from dissectors.profibus.telegram import parse, telegram


def renamed(rename: ProfibusRenamer, octets: bytes) -> bytes:
    found = rename(Frame("profibus", octets, 0, 0, Check.GOOD, FoundBy.DELIMITER))
    assert len(found) == len(octets)
    assert is_sound(found)
    return found


@pytest.mark.parametrize("master", [40, 77, 255])
def test_the_master_that_a_diagnosis_names_is_the_one_that_asks(master: int) -> None:
    rename = ProfibusRenamer()
    asked = parse(renamed(rename, telegram(60, 40, 0x6D, dsap=60, ssap=62)))
    data = bytes((0, 4, 0, master, 0xF5, 0x10))
    answer = parse(renamed(rename, telegram(40, 60, 0x08, data, dsap=62, ssap=60)))
    told = parse_diagnosis(answer.data)
    assert told is not None
    assert (answer.source, answer.destination) == (asked.destination, asked.source) == (1, 2)
    assert told.master == {40: asked.source, 77: 3, 255: 255}[master]
    assert told.ident == 0xF510


@pytest.mark.parametrize("size", range(1, 12))
def test_a_damaged_telegram_gives_no_address_away(size: int) -> None:
    octets = telegram(60, 40, 0x6D, bytes(2))
    spoilt = (octets[:-2] + bytes((octets[-2] ^ 4, octets[-1])))[:size]
    found = ProfibusRenamer()(Frame("profibus", spoilt, 0, 0, Check.BAD, FoundBy.DELIMITER, Damage.CHECK))
    assert found[:8] == (octets[:4] + bytes((126, 125)) + octets[6:8])[:size]
    assert len(found) == len(spoilt)


def test_an_address_that_is_given_is_renumbered() -> None:
    rename = ProfibusRenamer()
    given = parse(renamed(rename, telegram(126, 40, 0x6D, bytes((60, 0xF5, 0x10, 0)), dsap=55, ssap=62)))
    new = parse_new_address(given.data)
    assert new is not None
    assert new.address == rename.stations.of(60) != 60
