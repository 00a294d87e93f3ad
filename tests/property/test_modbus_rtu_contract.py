"""The framer contract, kept by the Modbus RTU framer."""

from __future__ import annotations

from dissectors.modbus.framing import RtuFramer
from sniff.testing.framer_contract import framer_contract
from tests.property.modbus_adus import rtu_frames
from tests.seeds import examples

TestRtuContract = framer_contract(RtuFramer, rtu_frames, examples=examples(170))
