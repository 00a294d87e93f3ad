"""What one frame costs: the quick look, its line of text, its place in a transaction, and scapy's full dissection.

Compare inside the group "peek": each runs over the same 40 frames (20 exchanges of functions 3, 6 and 16).
"""

from __future__ import annotations

import pytest

from dissectors.frame import Check, FoundBy, Frame, Role
from dissectors.line import LineSettings, Timing
from dissectors.modbus.envelope import seal_ascii, seal_rtu
from dissectors.modbus.fields import fields
from dissectors.modbus.header import peek_ascii, peek_rtu
from dissectors.modbus.packets import dissect
from dissectors.modbus.text import text
from dissectors.modbus.tracker import ModbusTracker

ADUS = [
    bytes.fromhex(adu)
    for adu in (
        *("010325200008", "010310" + "1770" * 8) * 16,
        *("010625021770", "010625021770") * 2,
        *("01100101000204000117 70".replace(" ", ""), "011001010002") * 2,
    )
]


def frames(seal, protocol):
    return [
        Frame(protocol, seal(adu), no * 20_000_000, no * 20_000_000 + 5_000_000, Check.GOOD, FoundBy.GAP)
        for no, adu in enumerate(ADUS)
    ]


RTU, ASCII = frames(seal_rtu, "modbus-rtu"), frames(seal_ascii, "modbus-ascii")


@pytest.mark.benchmark(group="peek")
def test_peek_rtu(benchmark):
    benchmark(lambda: [peek_rtu(frame) for frame in RTU])


@pytest.mark.benchmark(group="peek")
def test_peek_ascii(benchmark):
    benchmark(lambda: [peek_ascii(frame) for frame in ASCII])


@pytest.mark.benchmark(group="peek")
def test_peek_and_track(benchmark):
    tracker = ModbusTracker(Timing(LineSettings.parse("19200,8E1")))
    benchmark(lambda: [tracker.track(1, frame, peek_rtu(frame)) for frame in RTU])


@pytest.mark.benchmark(group="peek")
def test_text(benchmark):
    headers = [peek_rtu(frame) for frame in RTU]
    benchmark(lambda: [text(frame, header, header.role) for frame, header in zip(RTU, headers, strict=True)])


@pytest.mark.benchmark(group="peek")
def test_fields(benchmark):
    benchmark(lambda: [fields(frame, Role.EITHER) for frame in RTU])


@pytest.mark.benchmark(group="peek")
def test_scapy(benchmark):
    benchmark(lambda: [dissect(frame, Role.EITHER) for frame in RTU])
