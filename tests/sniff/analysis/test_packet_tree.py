"""Which octets a field was read from: by hand for small frames, by rule for real ones."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dissectors.frame import Check, FoundBy, Frame, Role
from sniff.analysis.packet_tree import Field, fields_of

CAPTURES = Path(__file__).parents[3] / "../shared/captures"


def frame(octets: bytes) -> Frame:
    return Frame("x", octets, 0, 0, Check.GOOD, FoundBy.GAP)


def dissector(packet: Any, fields: Any = None) -> Any:
    return SimpleNamespace(packet=packet, fields=fields or (lambda frame, role: {}))


def modbus() -> Any:
    from dissectors.modbus.packets import dissect

    return dissector(dissect)


def n2() -> Any:
    from dissectors.n2.packets import dissect

    return dissector(lambda frame, role: dissect(frame.octets))


def mstp() -> Any:
    from dissectors.bacnet.packets import dissect

    return dissector(lambda frame, role: dissect(frame.octets))


def flat(fields: tuple[Field, ...]) -> Iterator[Field]:
    for field in fields:
        yield field
        yield from flat(field.children)


def spans(of: Any, octets: bytes, role: Role, protocol: str = "x") -> dict[str, str]:
    made = Frame(protocol, octets, 0, 0, Check.GOOD, FoundBy.GAP)
    return {
        field.name: octets[field.begin : field.end].hex(" ")
        for field in flat(fields_of(of, made, role))
        if field.begin is not None and not field.children
    }


def test_modbus_response_with_registers() -> None:
    octets = bytes.fromhex("01 03 04 00 D7 00 1A CB C0")
    assert spans(modbus(), octets, Role.RESPONSE, "modbus-rtu") == {
        "unit": "01",
        "crc": "cb c0",
        "func code": "03",
        "byte count": "04",
        "[0]": "00 d7",
        "[1]": "00 1a",
    }


def test_modbus_ascii_fields_are_pairs_of_characters() -> None:
    found = spans(modbus(), b":010300000002FA\r\n", Role.REQUEST, "modbus-ascii")
    assert bytes.fromhex(found["quantity"]) == b"0002"
    assert bytes.fromhex(found["lrc"]) == b"FA"
    assert bytes.fromhex(found["unit"]) == b"01"


def test_n2_fields_are_characters() -> None:
    found = spans(n2(), b">01110A0397\r", Role.REQUEST)
    assert {name: bytes.fromhex(octets) for name, octets in found.items()} == {
        "start": b">",
        "address": b"01",
        "command": b"1",
        "region": b"1",
        "object": b"0A",
        "attribute": b"03",
        "checksum": b"97",
        "end": b"\r",
    }


def mstp_frames(name: str, most: int) -> list[bytes]:
    path = CAPTURES / name / "frames.txt"
    if not path.exists():
        return []
    lines = [line for line in path.read_text().splitlines() if line[:1].isdigit()][:most]
    return [bytes.fromhex("".join(word for word in line.split(";")[0].split()[1:])) for line in lines]


@pytest.mark.skipif(not CAPTURES.exists(), reason="the folder with real captures is not here")
@pytest.mark.parametrize("name", ["mstp-kargs-2009", "mstp-cimetrics-snap-mixed"])
def test_real_mstp_frames_are_placed_field_by_field(name: str) -> None:
    frames = mstp_frames(name, 150)
    assert frames
    for octets in frames:
        fields = tuple(flat(fields_of(mstp(), frame(octets), Role.UNKNOWN)))
        owned = {offset for field in fields if not field.children for offset in range(field.begin or 0, field.end or 0)}
        assert owned == set(range(len(octets))), octets.hex()


def boom(*_: Any) -> Any:
    raise ValueError("\x1b[31mno")


def test_a_failing_packet_falls_back_to_flat_fields() -> None:
    found = fields_of(dissector(boom, lambda frame, role: {"a.b": 7, "a.c": "\x07"}), frame(b"\x01"), Role.UNKNOWN)
    assert found == (
        Field("packet", "not readable as a packet: \\x1b[31mno"),
        Field("a.b", "7"),
        Field("a.c", "\\x07"),
    )
    assert fields_of(dissector(boom, boom), frame(b"\x01"), Role.UNKNOWN)[-1].name == "fields"


@given(
    st.binary(max_size=40), st.sampled_from(list(Role)), st.sampled_from(["modbus-rtu", "modbus-ascii", "n2", "mstp"])
)
def test_any_octets_any_protocol(octets: bytes, role: Role, protocol: str) -> None:
    of = {"n2": n2, "mstp": mstp}.get(protocol, modbus)()
    made = Frame(protocol, octets, 0, 0, Check.BAD, FoundBy.GAP)
    for field in flat(fields_of(of, made, role)):
        assert field.name.isprintable()
        assert field.value.isprintable()
        if field.begin is not None and field.end is not None:
            assert 0 <= field.begin <= field.end <= len(octets)
