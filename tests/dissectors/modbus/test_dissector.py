"""What the application gets: two dissectors, and nothing heavy until a packet is asked for."""

from __future__ import annotations

import subprocess
import sys

import pytest

from dissectors import registry
from dissectors.frame import Chunk, Role
from dissectors.line import LineSettings, Timing


def test_importing_loads_no_scapy():
    code = (
        "import dissectors.modbus, sys; sys.exit(any(name.split('.')[0] in ('scapy', 'numpy') for name in sys.modules))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize(
    ("name", "wire", "packet"),
    [
        ("modbus-rtu", bytes.fromhex("010325200002cecd"), "Modbus RTU"),
        ("modbus-ascii", b":010325200002B5\r\n", "Modbus ASCII"),
    ],
)
def test_from_the_wire_to_the_packet(name, wire, packet):
    dissector = registry.get(name)
    timing = Timing(LineSettings.parse(dissector.default_line))
    framer, tracker = dissector.framer(timing), dissector.tracker(timing)
    (frame,) = framer.feed(Chunk(1_000_000_000, wire)) + framer.close()
    header = dissector.peek(frame)
    placement = tracker.track(1, frame, header).placement
    assert placement.role is Role.REQUEST
    assert dissector.text(frame, header, placement.role) == "1 ← read holding 0x2520 ×2"
    assert dissector.fields(frame, placement.role)["modbus.reference_num"] == 0x2520
    assert dissector.packet(frame, placement.role).name == packet
