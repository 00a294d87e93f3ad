"""How fast octets become Modbus frames, beside pymodbus's RTU framer on the same frames.

The peer has it easier: it is handed one whole frame at a time and told which direction it has; it knows no time.
"""

from __future__ import annotations

from collections.abc import Callable

import pytest
from pymodbus.framer import FramerRTU
from pymodbus.pdu import DecodePDU
from pytest_benchmark.fixture import BenchmarkFixture

from dissectors.checksums import crc16_modbus, lrc
from dissectors.frame import Chunk, Frame
from dissectors.framer import Framer
from dissectors.line import LineSettings, Timing
from dissectors.modbus.ascii_framing import AsciiFramer
from dissectors.modbus.framing import RtuFramer
from tests.bus_delivery import FTDI_LATENCY, exact, ftdi, laid_out

pytestmark = pytest.mark.benchmark(group="framing")

LINE = LineSettings.parse("115200,8E1")
EXCHANGES = 1000


def _rtu(body: bytes) -> bytes:
    return body + crc16_modbus(body).to_bytes(2, "little")


def _ascii(body: bytes) -> bytes:
    return b":" + (body + bytes([lrc(body)])).hex().upper().encode() + b"\r\n"


def exchanges(frame: Callable[[bytes], bytes]) -> tuple[list[bytes], list[bytes]]:
    """A steady poll: five stations, eight registers each, now and then a write. Requests, responses."""
    asked, answered = [], []
    for number in range(EXCHANGES):
        unit = 1 + number % 5
        value = number.to_bytes(2, "big")
        if number % 10:
            asked.append(frame(bytes((unit, 3, 0, number % 100, 0, 8))))
            answered.append(frame(bytes((unit, 3, 16)) + value * 8))
        else:
            asked.append(frame(bytes((unit, 6, 1, 2)) + value))
            answered.append(asked[-1])
    return asked, answered


def poll(frame: Callable[[bytes], bytes]) -> list[bytes]:
    return [f for pair in zip(*exchanges(frame), strict=True) for f in pair]


def run(framer: Callable[[Timing], Framer], timing: Timing, chunks: list[Chunk]) -> int:
    """Good frames in the chunks."""
    machine, good = framer(timing), 0
    for chunk in chunks:
        for event in machine.feed(chunk):
            good += isinstance(event, Frame) and event.ok
    return good + sum(isinstance(e, Frame) and e.ok for e in machine.close())


def measure(
    benchmark: BenchmarkFixture, framer: Callable[[Timing], Framer], timing: Timing, chunks: list[Chunk]
) -> None:
    benchmark.extra_info["octets"] = sum(len(c.octets) for c in chunks)
    assert benchmark(run, framer, timing, chunks) == 2 * EXCHANGES


def test_rtu_a_chunk_a_frame(benchmark: BenchmarkFixture) -> None:
    timing = Timing(LINE)
    now, chunks = 0, []
    for frame in poll(_rtu):
        now += timing.t35 * 6 // 5 + len(frame) * timing.char
        chunks.append(Chunk(now, frame))
    measure(benchmark, RtuFramer, timing, chunks)


def test_rtu_reads_of_16_ms(benchmark: BenchmarkFixture) -> None:
    timing = Timing(LINE, FTDI_LATENCY)
    measure(benchmark, RtuFramer, timing, ftdi(laid_out(poll(_rtu), timing, timing.t35 * 6 // 5)))


def test_rtu_an_octet_a_chunk(benchmark: BenchmarkFixture) -> None:
    timing = Timing(LINE)
    measure(benchmark, RtuFramer, timing, exact(laid_out(poll(_rtu), timing, timing.t35 * 6 // 5)))


def test_ascii_reads_of_16_ms(benchmark: BenchmarkFixture) -> None:
    timing = Timing(LINE, FTDI_LATENCY)
    measure(benchmark, AsciiFramer, timing, ftdi(laid_out(poll(_ascii), timing, timing.t35)))


def test_pymodbus_a_frame_a_call(benchmark: BenchmarkFixture) -> None:
    server, client = FramerRTU(DecodePDU(True)), FramerRTU(DecodePDU(False))
    frames = [
        (f, d) for pair in zip(*exchanges(_rtu), strict=True) for f, d in zip(pair, (server, client), strict=True)
    ]
    benchmark.extra_info["octets"] = sum(len(f) for f, _ in frames)

    def decode() -> int:
        return sum(framer.decode(frame)[0] == len(frame) for frame, framer in frames)

    assert benchmark(decode) == 2 * EXCHANGES
