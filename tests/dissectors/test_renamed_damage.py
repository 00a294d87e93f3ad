"""Renaming keeps the error of a damaged frame: its octets change, what is wrong with them does not."""

from __future__ import annotations

import pytest

from dissectors.bacnet.renamer import MstpRenamer
from dissectors.checksums import crc8_mstp, crc16_modbus
from dissectors.frame import Check, Damage, FoundBy, Frame
from dissectors.modbus.renamer import RtuRenamer
from dissectors.pseudonyms import inflicted

WHOLE = bytes.fromhex("55ff00090100000000")[:8]
RENAMED = bytes.fromhex("55ff0003020000aa")


def _frame(octets: bytes, check: Check, damage: Damage | None) -> Frame:
    return Frame("any", octets, 0, len(octets), check, FoundBy.LENGTH, damage)


@pytest.mark.parametrize(
    ("damaged", "expected"),
    [
        (WHOLE[1:], RENAMED[1:]),
        (WHOLE[2:], RENAMED[2:]),
        (WHOLE[:-1], RENAMED[:-1]),
        (WHOLE[:5] + bytes([WHOLE[5] ^ 4]) + WHOLE[6:], RENAMED[:5] + bytes([RENAMED[5] ^ 4]) + RENAMED[6:]),
    ],
)
def test_a_flaw_is_inflicted_again(damaged: bytes, expected: bytes) -> None:
    assert inflicted(damaged, WHOLE, RENAMED) == expected


def test_swapped_check_octets_are_swapped_again() -> None:
    assert inflicted(b"\x01\x02\x04\x03", b"\x01\x02\x03\x04", b"\x09\x02\x05\x06") == b"\x09\x02\x06\x05"


def test_the_error_of_a_header_check_stays_and_unheard_addresses_keep_their_number() -> None:
    rename = MstpRenamer()
    header = bytes([0, 9, 17, 0, 0])
    rename.stations.of(5)
    new = rename.stations.of(9)
    renamed = rename(_frame(b"\x55\xff" + header + bytes([crc8_mstp(header) ^ 0x21]), Check.BAD, Damage.HEADER))
    assert (renamed[3], renamed[4]) == (new, 17)
    assert renamed[7] ^ crc8_mstp(renamed[2:7]) == 0x21


def test_the_error_of_a_modbus_crc_stays() -> None:
    rename = RtuRenamer()
    new = rename.stations.of(17)
    body = bytes.fromhex("110300000002")
    sent = (crc16_modbus(body) ^ 0x0140).to_bytes(2, "little")
    renamed = rename(_frame(body + sent, Check.BAD, Damage.CHECK))
    assert renamed[0] == new
    assert int.from_bytes(renamed[-2:], "little") ^ crc16_modbus(renamed[:-2]) == 0x0140
