"""What requests ask, for each protocol that says so: total, without the values, and told by the stem of the frame."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dissectors import registry
from dissectors.bacnet.envelope import frame as mstp_frame
from dissectors.columns import FrameColumns, Octets
from dissectors.frame import Check, FoundBy, Frame
from dissectors.modbus.envelope import seal_ascii, seal_rtu
from dissectors.n2.envelope import make_command
from dissectors.n2.objects import attribute_name
from dissectors.questions import Question, Span
from sniff.engine.engine import Row
from sniff.engine.row_packing import frame_columns

NAMES = [one.name for one in registry.usable() if one.questions is not None]


def frame(protocol: str, octets: bytes) -> Frame:
    return Frame(protocol, octets, 0, len(octets), Check.GOOD, FoundBy.GAP, None)


def asked(protocol: str, octets: bytes) -> Question:
    questions = registry.get(protocol).questions
    assert questions is not None
    return questions.of(frame(protocol, octets))


def columns(protocol: str, frames: list[bytes]) -> tuple[FrameColumns, Octets]:
    peek = registry.get(protocol).peek
    rows = [Row(no, frame(protocol, octets), peek(frame(protocol, octets))) for no, octets in enumerate(frames, 1)]
    return frame_columns(rows), np.frombuffer(b"".join(frames), np.uint8)


def stems(protocol: str, frames: list[bytes]) -> list[tuple[bytes, int]]:
    """The octets that say what is asked, without the hole, and where that is."""
    questions = registry.get(protocol).questions
    assert questions is not None
    assert questions.stems is not None
    held, octets = columns(protocol, frames)
    found = questions.stems(held, octets)
    whole = octets.tobytes()
    said = []
    for begin, end, hole in zip(*(one.tolist() for one in found), strict=True):
        kept = bytearray(whole[begin:end])
        if hole >= 0:
            kept[hole - begin] = 0
        said.append((bytes(kept), hole - begin if hole >= 0 else -1))
    return said


MODBUS = [
    (struct.pack(">BBHH", 1, 3, 100, 4), (Span("holding", 100, 4),)),
    (struct.pack(">BBHH", 1, 4, 0, 1), (Span("input", 0, 1),)),
    (struct.pack(">BBHH", 1, 1, 7, 9), (Span("coil", 7, 9),)),
    (struct.pack(">BBHH", 1, 2, 7, 9), (Span("discrete", 7, 9),)),
    (struct.pack(">BBHH", 1, 5, 7, 0xFF00), (Span("coil", 7, 1, writes=True),)),
    (struct.pack(">BBHH", 1, 6, 7, 1234), (Span("holding", 7, 1, writes=True),)),
    (struct.pack(">BBHHBHH", 1, 16, 9, 2, 4, 1, 2), (Span("holding", 9, 2, writes=True),)),
    (struct.pack(">BBHHHHBH", 1, 23, 5, 3, 9, 1, 2, 77), (Span("holding", 5, 3), Span("holding", 9, 1, writes=True))),
    (struct.pack(">BBHH", 1, 8, 0, 0x1234), ()),
]


@pytest.mark.parametrize(("pdu", "spans"), MODBUS, ids=lambda one: one.hex() if isinstance(one, bytes) else "")
def test_registers_and_coils(pdu: bytes, spans: tuple[Span, ...]) -> None:
    assert asked("modbus-rtu", seal_rtu(pdu)).spans == spans
    assert asked("modbus-ascii", seal_ascii(pdu)).spans == spans


def test_values_and_invoke_ids_are_no_part_of_a_stem() -> None:
    one, other = (seal_rtu(struct.pack(">BBHHBHH", 1, 16, 9, 2, 4, *values)) for values in ((1, 2), (3, 4)))
    assert len(set(stems("modbus-rtu", [one, other]))) == 1
    one, other = (seal_ascii(struct.pack(">BBHH", 1, 6, 9, value)) for value in (0xABCD, 7))
    assert len(set(stems("modbus-ascii", [one, other]))) == 1
    reads = [mstp_frame(5, 5, 1, bytes.fromhex(f"0104 0005{invoke:02X}0C 0C00000004 1955")) for invoke in (1, 200)]
    assert len(set(stems("mstp", reads))) == 1
    assert asked("mstp", reads[0]).spans == (Span("analog-input", 4),)


@pytest.mark.parametrize(
    ("text", "spans"),
    [
        ("01110303", (Span("AI", 3),)),
        ("01110305", (Span("AI", 3, 1, attribute_name(1, 5).replace(" ", "-")),)),
        ("0123030342280000", (Span("AO", 3, 1, writes=True),)),
        ("0104", ()),
    ],
)
def test_objects_and_attributes(text: str, spans: tuple[Span, ...]) -> None:
    found = asked("n2", make_command(text)).spans
    assert [(one.space, one.address, one.writes) for one in found] == [
        (one.space, one.address, one.writes) for one in spans
    ]
    assert [bool(one.part) for one in found] == [bool(one.part) for one in spans]


@pytest.mark.parametrize("protocol", NAMES)
@given(st.binary(max_size=80))
def test_any_octets_ask_something_or_nothing(protocol: str, octets: bytes) -> None:
    assert isinstance(asked(protocol, octets), Question)


@pytest.mark.parametrize("protocol", ["modbus-rtu", "modbus-ascii", "mstp"])
@given(st.lists(st.binary(min_size=8, max_size=40), min_size=1, max_size=8))
def test_stems_stay_within_their_frames(protocol: str, frames: list[bytes]) -> None:
    for (stem, hole), octets in zip(stems(protocol, frames), frames, strict=True):
        assert len(stem) <= len(octets)
        assert hole < len(octets)
