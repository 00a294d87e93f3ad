"""Modbus over serial line, RTU and ASCII: one PDU in two envelopes. README.md draws the frames."""

from __future__ import annotations

from dissectors.line import Timing
from dissectors.modbus.adu import ASCII_NAME, RTU_NAME
from dissectors.modbus.ascii_framing import AsciiFramer
from dissectors.modbus.fields import fields
from dissectors.modbus.findings import ModbusFindings
from dissectors.modbus.framing import RtuFramer
from dissectors.modbus.header import peek_ascii, peek_rtu
from dissectors.modbus.readings import readings, refusal
from dissectors.modbus.rules import RULES
from dissectors.modbus.text import text
from dissectors.modbus.tracker import ModbusTracker
from dissectors.registry import Dissector, on_first_use

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
_EXTRAS = {"findings": ModbusFindings, "rules": RULES, "readings": readings, "refusal": refusal}


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
    fields=fields,
    packet=packet,
    default_line="19200,8E1",
    extras=_EXTRAS,
)

ASCII = Dissector(
    name=ASCII_NAME,
    title="Modbus ASCII",
    framer=AsciiFramer,
    peek=peek_ascii,
    tracker=ascii_tracker,
    text=text,
    fields=fields,
    packet=packet,
    default_line="19200,7E1",
    extras=_EXTRAS,
)
