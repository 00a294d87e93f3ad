"""Exchanges of functions of unknown layout without any silence between them: what an adapter glues for seconds."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from dissectors.checksums import crc16_modbus
from dissectors.frame import Chunk, Event, Frame
from dissectors.line import LineSettings, Timing
from dissectors.modbus.framing import RtuFramer

TIMING = Timing(LineSettings.parse("115200"), 17_000_000)
STATIONS = range(1, 10)
FUNCTIONS = (9, 13, 65, 66, 72, 100, 110)
exchanges = st.tuples(
    st.sampled_from(STATIONS), st.sampled_from(FUNCTIONS), st.binary(max_size=5), st.binary(max_size=5)
)


def sealed(body: bytes) -> bytes:
    return body + crc16_modbus(body).to_bytes(2, "little")


def read(octets: bytes, size: int) -> list[Event]:
    """All events of octets back to back, `size` of them a read."""
    framer, events, now = RtuFramer(TIMING), [], 10**9
    for at in range(0, len(octets), size):
        part = octets[at : at + size]
        now += len(part) * TIMING.char
        events += framer.feed(Chunk(now, part))
    return events + framer.close()


@given(st.lists(exchanges, min_size=8, max_size=40), st.integers(1, 300))
def test_exchanges_of_unknown_functions_without_silence_are_found(
    traffic: list[tuple[int, int, bytes, bytes]], size: int
) -> None:
    sent = [sealed(bytes((unit, code)) + data) for unit, code, *both in traffic for data in both]
    events = read(b"".join(sent), size)
    assert b"".join(each.octets for each in events) == b"".join(sent)
    frames = [each.octets for each in events if isinstance(each, Frame) and each.ok]
    assert frames[: len(sent) - 2] == sent[:-2]  # at the end of a capture nothing agrees with the last one's end


def test_a_run_of_the_shortest_exchanges_is_read_whole() -> None:
    """No data at all: nothing but station, function and check, each request like its answer."""
    sent = [sealed(bytes((station, 65))) for _ in range(100) for station in STATIONS for _ in range(2)]
    events = read(b"".join(sent), 256)
    assert [each.octets for each in events] == sent
