"""Frames that are given away hold no text, no file contents and no true instance."""

from __future__ import annotations

from dataclasses import replace

import pytest

from dissectors.bacnet import npdu
from dissectors.bacnet.envelope import npdu_frame
from dissectors.bacnet.renamer import MstpRenamer
from dissectors.checksums import crc8_mstp, crc16_x25
from dissectors.frame import Check, FoundBy, Frame


def _renamed(rename: MstpRenamer, apdu: bytes) -> bytes:
    data = b"\x01\x04" + apdu
    header = bytes([5, 2, 7, *len(data).to_bytes(2, "big")])
    octets = b"\x55\xff" + header + bytes([crc8_mstp(header)]) + data + crc16_x25(data).to_bytes(2, "little")
    found = rename(Frame("mstp", octets, 0, 0, Check.GOOD, FoundBy.DELIMITER))
    assert len(found) == len(octets)
    assert crc16_x25(found[8:-2]).to_bytes(2, "little") == found[-2:]
    return found[10:-2]


def test_what_is_in_a_file_is_blanked() -> None:
    # AtomicReadFile-ACK of a stream: end of file, start 0, octets
    found = _renamed(MstpRenamer(), bytes.fromhex("300106 10 0e 3100 6509") + b"Chiller\x00\xff" + b"\x0f")
    assert found == bytes.fromhex("300106 10 0e 3100 6509") + b"xxxxxxxxx\x0f"


def test_an_instance_that_is_asked_for_gets_the_number_of_its_device() -> None:
    rename = MstpRenamer()
    i_am = _renamed(rename, bytes.fromhex("1000 c402000003 220400 9100 21b2"))
    who_is = _renamed(rename, bytes.fromhex("1008 0903 1903"))
    assert int.from_bytes(i_am[3:7], "big") & 0x3FFFFF == who_is[3] == who_is[5] == 1


def test_a_range_of_instances_becomes_all() -> None:
    assert _renamed(MstpRenamer(), bytes.fromhex("1008 0a1234 1b123456")) == bytes.fromhex("1008 0a0000 1b3fffff")


def test_an_object_that_is_asked_for_by_name() -> None:
    found = _renamed(MstpRenamer(), bytes.fromhex("1007 0905 1905 3d08 00") + b"Boiler1")
    assert found == bytes.fromhex("1007 0901 1901 3d08 00") + b"xxxxxxx"


def test_passwords_and_names_of_two_octets_a_character() -> None:
    # ReinitializeDevice with a password of three characters; a segment with a name in UCS-2
    assert _renamed(MstpRenamer(), bytes.fromhex("00020514 0900 1c00") + b"abc")[-3:] == b"xxx"
    wide = _renamed(MstpRenamer(), bytes.fromhex("3c01000112 7512 04") + "Chiller 1".encode("utf-16-be"))
    assert b"C" not in wide
    assert b"h" not in wide


@pytest.mark.parametrize("dadr", [b"\x01", b"\x64", b"\x24", b"\x05", b"\xc0\xa8\x01\x0a\xba\xc0"])
@pytest.mark.parametrize("sadr", [b"", b"\x01", b"\x05"])
def test_a_station_behind_a_router_is_renamed_where_it_stands(dadr: bytes, sadr: bytes) -> None:
    """Its address may be any number: one that stands elsewhere in the header too."""
    rename = MstpRenamer()
    asked = npdu.encode(bytes.fromhex("00050112"), dnet=0x64, dadr=dadr, snet=5 if sadr else None, sadr=sadr)
    whole = Frame("mstp", npdu_frame(1, 2, asked, True), 0, 0, Check.GOOD, FoundBy.DELIMITER)
    told, was = npdu.decode(rename(whole)[8:-2]), npdu.decode(asked)
    assert told is not None
    assert was is not None
    new = bytes(len(dadr) - 1) + bytes([rename.stations.of(dadr[-1])])
    assert replace(told, dadr=dadr, sadr=was.sadr) == was
    assert (told.dadr, told.sadr) == (new, bytes([rename.stations.of(sadr[-1])]) if sadr else None)
