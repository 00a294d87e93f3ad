"""The framer contract, kept by the Modbus ASCII framer."""

from __future__ import annotations

from dissectors.modbus.ascii_framing import AsciiFramer
from sniff.testing.framer_contract import framer_contract
from tests.property.modbus_adus import ascii_frames

TestAsciiContract = framer_contract(AsciiFramer, ascii_frames, examples=60)
