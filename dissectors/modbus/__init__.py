"""Modbus over serial line, RTU and ASCII: one PDU in two envelopes. README.md draws the frames."""

from __future__ import annotations

import re

from dissectors.frame import Frame
from dissectors.line import Timing
from dissectors.manifest import Dissector, PacketFile, on_first_use
from dissectors.modbus.ascii_framing import AsciiFramer
from dissectors.modbus.envelope import ASCII_NAME, RTU_NAME, make_ascii, make_rtu
from dissectors.modbus.fields import answer_fields, fields
from dissectors.modbus.framing import RtuFramer
from dissectors.modbus.header import peek_ascii, peek_rtu
from dissectors.modbus.places import place, spans
from dissectors.modbus.readings import asks, readings, refusal
from dissectors.modbus.renamer import AsciiRenamer, RtuRenamer
from dissectors.modbus.rules import RULES
from dissectors.modbus.text import meant, text
from dissectors.modbus.tracker import ModbusTracker
from dissectors.questions import Questions

__all__ = [
    "ASCII",
    "RTU",
    "AsciiFramer",
    "ModbusTracker",
    "RtuFramer",
    "fields",
    "packet",
    "peek_ascii",
    "peek_rtu",
    "text",
]


packet = on_first_use("dissectors.modbus.packets:dissect")
stencil = on_first_use("dissectors.modbus.stencils:rtu_stencil")
kernel = on_first_use("dissectors.modbus.kernel:kernel")
pairing = on_first_use("dissectors.modbus.block_pairing:rtu_pairing")
judge = on_first_use("dissectors.modbus.judging_columns:BulkModbusFindings")
ascii_kernel = on_first_use("dissectors.modbus.ascii_kernel:kernel")
ascii_pairing = on_first_use("dissectors.modbus.block_pairing:ascii_pairing")
register_maps = on_first_use("dissectors.modbus.map_reading:read_map")
question = on_first_use("dissectors.modbus.questions:question")
rtu_questions = Questions(question, on_first_use("dissectors.modbus.questions:rtu_stems"))
ascii_questions = Questions(question, on_first_use("dissectors.modbus.questions:ascii_stems"))
rtu_field_types = on_first_use("dissectors.modbus.field_types:rtu_types")
ascii_field_types = on_first_use("dissectors.modbus.field_types:ascii_types")
reading_columns = on_first_use("dissectors.modbus.reading_columns:reading_columns")

_holds_a_good_frame = on_first_use("dissectors.modbus.stretch_crc:holds_a_good_frame")

_SIEVED = 128
"""Octets of which each stretch is tried, 8000 of them; of more than one in eight some would be good by chance."""

_DIGITS = re.compile(b"[0-9A-Fa-f\xb0-\xb9\xc1-\xc6\xe1-\xe6]{6}")


def rtu_bits(frame: Frame) -> float:
    """Evidence of a good RTU frame: among random octets one in 2.8e-6 octets was measured (18 bits), nearly half of
    them frames of five octets."""
    return 18.0 if len(frame.octets) >= 6 else 6.0


def rtu_sieve(octets: bytes) -> bool:
    """Whether some octets in a row have a good CRC; of long stretches that is not asked: too often chance makes one."""
    if len(octets) > _SIEVED:
        return True
    return bool(_holds_a_good_frame(octets))


def ascii_bits(frame: Frame) -> float:
    """Evidence of a good ASCII frame: each character comes from a small alphabet, 3 bits."""
    return 3.0 * len(frame.octets)


def ascii_sieve(octets: bytes) -> bool:
    """Whether there are the digits of a unit, a function and an LRC in a row, whatever their highest bit."""
    return _DIGITS.search(octets) is not None


def ascii_tracker(timing: Timing) -> ModbusTracker:
    """The tracker of an ASCII line, where no rule of silence delays an answer: one character is time enough."""
    return ModbusTracker(timing, silence=timing.char)


RTU = Dissector(
    name=RTU_NAME,
    title="Modbus RTU",
    framer=RtuFramer,
    peek=peek_rtu,
    tracker=ModbusTracker,
    text=text,
    meant=meant,
    asks=asks,
    answer_fields=answer_fields,
    place=place,
    spans=spans,
    fields=fields,
    packet=packet,
    default_line="19200,8E1",
    field_prefixes=("mbrtu.", "modbus."),
    bits=rtu_bits,
    sieve=rtu_sieve,
    packet_file=PacketFile((252, 147, 250), "mbrtu", ports=((502, "Modbus TCP"),)),
    renamer=RtuRenamer,
    makers={RTU_NAME: make_rtu},
    scenarios=on_first_use("dissectors.modbus.scenario:rtu_scenarios"),
    family="modbus",
    judge=judge,
    rules=RULES,
    readings=readings,
    reading_columns=reading_columns,
    refusal=refusal,
    questions=rtu_questions,
    register_maps=register_maps,
    kernel=kernel,
    pairing=pairing,
    stencil=stencil,
    field_types=rtu_field_types,
)

ASCII = Dissector(
    name=ASCII_NAME,
    title="Modbus ASCII",
    framer=AsciiFramer,
    peek=peek_ascii,
    tracker=ascii_tracker,
    text=text,
    meant=meant,
    asks=asks,
    answer_fields=answer_fields,
    place=place,
    spans=spans,
    fields=fields,
    packet=packet,
    default_line="19200,7E1",
    field_prefixes=("mbascii.", "modbus."),
    bits=ascii_bits,
    sieve=ascii_sieve,
    renamer=AsciiRenamer,
    makers={ASCII_NAME: make_ascii},
    scenarios=on_first_use("dissectors.modbus.scenario:ascii_scenarios"),
    family="modbus",
    judge=judge,
    rules=RULES,
    readings=readings,
    refusal=refusal,
    questions=ascii_questions,
    register_maps=register_maps,
    kernel=ascii_kernel,
    pairing=ascii_pairing,
    field_types=ascii_field_types,
)
