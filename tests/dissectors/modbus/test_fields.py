"""Field names and values against Wireshark's own reading of the same frames."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dissectors.frame import Check, Damage, Role
from dissectors.modbus.envelope import seal_ascii
from dissectors.modbus.fields import fields

LINES = [
    line.split("\t")
    for line in (Path(__file__).parent / "wireshark_fields.tsv").read_text(encoding="utf-8").splitlines()
    if not line.startswith("#")
]


def as_ours(name: str, value: str) -> int | str:
    """PDML shows a number as 10 or 0x0a; octets stay text."""
    try:
        return value if name == "modbus.data" else int(value, 16 if value.startswith("0x") else 10)
    except ValueError:
        return value


@pytest.mark.parametrize("line", LINES, ids=lambda line: f"{line[0]}-{line[1]}")
def test_wireshark_agrees(line, frame_of):
    role, octets, *pairs = line
    expected = {name: as_ours(name, value) for name, value in (pair.split("=", 1) for pair in pairs)}
    found = fields(frame_of(octets), Role(role))
    if "modbus.data" not in found or (role == "response" and found["modbus.func_code"] == 20):
        expected.pop("modbus.data", None)  # octets that have a name here; records that Wireshark does not tell apart
    assert {name: value for name, value in found.items() if name in expected} == expected


def test_wireshark_has_read_every_kind_of_frame(frame_of, peek_any):
    """The table is worth something: both directions of nearly every function are compared."""
    assert len({(peek_any(frame_of(octets)).kind, role) for role, octets, *_ in LINES}) >= 30


def test_registers_and_values_are_numbered_where_the_frame_names_the_first(frame_of):
    found = fields(frame_of("01100101000204000117706027"), Role.REQUEST)
    assert found["modbus.regnum16"] == "257,258"
    assert found["modbus.regval_uint16"] == "1,6000"


def test_a_written_value_can_be_filtered_as_a_number(frame_of):
    found = fields(frame_of("010625021770 2d12"), Role.REQUEST)
    assert (found["modbus.reference_num"], found["modbus.regval_uint16"]) == (0x2502, 6000)


def test_a_wrong_crc_says_so(frame_of):
    found = fields(frame_of("0103021770af82"), Role.RESPONSE)
    assert (found["mbrtu.crc16"], found["mbrtu.crc16.status"]) == (0xAF82, 0)


def test_ascii_has_an_envelope_of_its_own(frame_of):
    found = fields(frame_of(seal_ascii(bytes.fromhex("010325200002"))), Role.REQUEST)
    assert list(found) == [
        "mbascii.unit_id",
        "modbus.func_code",
        "modbus.reference_num",
        "modbus.word_cnt",
        "mbascii.lrc",
        "mbascii.lrc.status",
    ]
    assert (found["mbascii.lrc"], found["mbascii.lrc.status"]) == (0xB5, 1)


def test_fields_come_in_frame_order(frame_of):
    names = list(fields(frame_of("01030425202521 2a7d"), Role.RESPONSE))
    assert names[0] == "mbrtu.unit_id"
    assert names[-2:] == ["mbrtu.crc16", "mbrtu.crc16.status"]


@given(
    octets=st.binary(max_size=40),
    role=st.sampled_from(Role),
    as_text=st.booleans(),
    damage=st.sampled_from([None, *Damage]),
)
def test_any_octets_any_role(frame_of, octets, role, as_text, damage):
    from dataclasses import replace

    frame = frame_of(b":" + octets.hex().encode()[: len(octets)] + b"\r\n" if as_text else octets)
    frame = replace(frame, damage=damage, check=Check.ABSENT if damage is Damage.SHORT else frame.check, expected=8)
    for value in fields(frame, role).values():
        assert isinstance(value, int | float | str)
