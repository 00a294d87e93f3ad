"""The framer contract, kept by the Modbus ASCII framer."""

from __future__ import annotations

from dissectors.modbus.ascii_framing import AsciiFramer
from sniff.testing.framer_contract import framer_contract
from tests.property.modbus_adus import ascii_frames
from tests.seeds import examples

TestAsciiContract = framer_contract(AsciiFramer, ascii_frames, examples=examples(170))
