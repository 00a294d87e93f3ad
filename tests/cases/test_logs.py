"""Logs as people have them: read with no option given, every octet once."""

from __future__ import annotations

import pytest

from dissectors.frame import Chunk, Frame
from sniff.bus.offline import settled
from sniff.formats import read
from tests.cases.reading import case

FRAMES = {
    "log02-pymodbus-send-recv.log": 12,
    "log03-libmodbus-debug.log": 10,
    "log04-direction-and-ms.log": 14,
    "log05-modbus-poll.txt": 2,
    "log06-wireshark-hexdump.txt": 2,
    "log07-tx-rx-colon.txt": 2,
    "log08-iso-time.txt": 2,
    "o1-saleae-decimal.csv": 1,
    "f3-vendor-pairs-log.txt": 8,
}


@pytest.mark.parametrize("name", FRAMES)
def test_logs(name: str) -> None:
    log = read(case(f"modbus/{name}"))
    events = [item.row.event for item in settled(log.items(), log.session)]
    assert all(isinstance(event, Frame) and event.ok for event in events)
    assert len(events) == FRAMES[name]
    assert log.completeness().whole


def test_bursts_between_requests_are_octets_too() -> None:
    log = read(case("modbus/log01-esphome-uart-debug.log"))
    reads = [item.octets for item in log.items() if isinstance(item, Chunk)]
    assert [len(octets) for octets in reads].count(15) == 6
    assert len(reads) == 16
