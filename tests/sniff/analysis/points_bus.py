"""Small Modbus buses for tests of points: exchanges with their times, through the real engine."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from dissectors.modbus.envelope import seal_rtu
from sniff.bus.offline import outputs
from sniff.engine.engine import Output
from sniff.engine.session import Session

MS = 1_000_000
LINE = LineSettings.parse("19200,8N1")
SESSION = Session("test", LINE, "modbus-rtu")


def chunks(*exchanges: tuple[str, str | None], latency: float = 8.0) -> Iterator[Chunk]:
    """Requests with their responses (unit and PDU in hex), 100 ms apart; None: nobody answers."""
    now = 10 * MS
    for request, response in exchanges:
        for pdu, pause in ((request, 100 * MS), (response, int(latency * MS))):
            if pdu is None:
                now += 1_000 * MS
                continue
            octets = seal_rtu(bytes.fromhex(pdu))
            now += pause + len(octets) * LINE.char
            yield Chunk(now, octets)


def run(items: Iterable[Chunk], session: Session = SESSION) -> Iterator[Output]:
    """What the engine gives."""
    return (output for output in outputs(items, session) if isinstance(output, Output))
