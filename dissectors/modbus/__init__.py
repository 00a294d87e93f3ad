"""Modbus over a serial line, RTU and ASCII. README.md draws the frames."""

from __future__ import annotations

from typing import Any

from dissectors.frame import Frame, Role
from dissectors.framer import Framer
from dissectors.line import Timing
from dissectors.modbus.fields import fields
from dissectors.modbus.framing import RtuFramer
from dissectors.modbus.header import peek_ascii, peek_rtu
from dissectors.modbus.text import text
from dissectors.modbus.tracker import ModbusTracker
from dissectors.registry import Dissector


def packet(frame: Frame, role: Role) -> Any:
    """The scapy packet of a frame; scapy is imported on first use."""
    from dissectors.modbus.packets import dissect

    return dissect(frame, role)


def ascii_framer(timing: Timing) -> Framer:
    """A new Modbus ASCII framer."""
    from dissectors.modbus.ascii_framing import AsciiFramer

    return AsciiFramer(timing)


RTU = Dissector(
    name="modbus-rtu",
    title="Modbus RTU",
    framer=RtuFramer,
    peek=peek_rtu,
    tracker=ModbusTracker,
    text=text,
    fields=fields,
    packet=packet,
    default_line="19200,8E1",
)
ASCII = Dissector(
    name="modbus-ascii",
    title="Modbus ASCII",
    framer=ascii_framer,
    peek=peek_ascii,
    tracker=ModbusTracker,
    text=text,
    fields=fields,
    packet=packet,
    default_line="19200,7E1",
)
