"""A bus that is recorded as `record` does it, decoding and derived channels included, as fast as it goes."""

from __future__ import annotations

import random
from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path

from fastcrc import crc16

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from dissectors.profiles import Devices
from sniff.bus.live import LiveBus
from sniff.capture.ipc import Ended, Message, ReceivedMessage, Tick
from sniff.engine.session import Adapter, Session
from sniff.recording.derived_message import DerivedMessage
from sniff.recording.writer import Recorder

MS = 1_000_000
BASE = 1_772_359_200_000_000_000
LINE = LineSettings(19200, 8, "E", 1)
SESSION = Session("/dev/ttyUSB0", LINE, "modbus-rtu", BASE, "bus", Adapter("FT232R", "ftdi_sio", 1 * MS))
BEAT = 250 * MS


def frame(octets: bytes) -> bytes:
    return octets + crc16.modbus(octets).to_bytes(2, "little")


def polls(seconds: float, frames: int = 50, stations: int = 8, seed: int = 1) -> Iterator[Chunk]:
    """`frames` a second: each of the stations asked for two registers in two places, values that drift, jitter."""
    dice = random.Random(seed)
    values = [[dice.randrange(0, 5000) for _ in range(4)] for _ in range(stations)]
    apart = 2_000_000_000 // frames
    for turn in range(int(seconds * frames / 2)):
        station, place = turn % stations, turn // stations % 2
        held = values[station]
        held[2 * place] = (held[2 * place] + dice.randrange(-3, 4)) % 5000
        now = BASE + turn * apart + dice.randrange(400_000)
        request = frame(bytes((station + 1, 3, 0, 16 * place, 0, 2)))
        yield Chunk(now, request)
        content = b"".join(value.to_bytes(2, "big") for value in held[2 * place : 2 * place + 2])
        answer = frame(bytes((station + 1, 3, 4)) + content)
        yield Chunk(now + 12 * MS + dice.randrange(3 * MS), answer)


class Link:
    """What `LiveBus` needs of a capture process, in memory. `wanted`: which topics go into the recording."""

    priority = ""
    closing = False
    over_since = None
    ended = None

    def __init__(self, recorder: Recorder, wanted: Callable[[str], bool]) -> None:
        self.paths = [str(recorder.path)]
        self.recorder, self.wanted = recorder, wanted
        self.messages: deque[Message] = deque()
        self.dropped: dict[int, int] = {}

    def session(self, bus: int) -> Session:
        return SESSION

    def receive_batches(self, timeout: float = 0.0) -> list[Message]:
        given = list(self.messages)
        self.messages.clear()
        return given

    def look(self, timeout: float = 0.0) -> bool:
        return True

    def insist(self) -> None:
        return None

    def let_go(self) -> None:
        return None

    def derived(self, bus: int, one: DerivedMessage) -> bool:
        if self.wanted(one.topic):
            self.recorder.derived(one)
        return True


def record(
    path: Path, chunks: Iterator[Chunk], wanted: Callable[[str], bool] = lambda _: True, devices: str = ""
) -> int:
    """Record it; the octets of the file."""
    recorder = Recorder(path, SESSION)
    link = Link(recorder, wanted)
    live = LiveBus(link, devices=Devices.parse(devices.split(",")) if devices else None, watched=False)  # type: ignore[arg-type]
    due = BASE
    for chunk in chunks:
        while chunk.time > due:
            recorder.tick(due)
            link.messages.append(Tick(0, due))
            while link.messages or live._pending:
                live.poll()
            due = min(due + BEAT, max(recorder.due or due + BEAT, due + 1))
        recorder.chunk(chunk)
        link.messages.append(ReceivedMessage(0, chunk))
    link.messages.append(Ended("stopped"))
    while live.ended is None:
        live.poll()
    recorder.close()
    assert recorder.lost_octets == 0
    return path.stat().st_size
