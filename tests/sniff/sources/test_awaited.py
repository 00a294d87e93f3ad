"""A port that may not be there yet."""

from __future__ import annotations

import pytest

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.engine.event_texts import gone
from sniff.engine.session import Adapter, Item, LineEvent, LineEventKind
from sniff.sources import PortError
from sniff.sources.awaited import RETRY_EVERY, AwaitedSource
from sniff.sources.clock import Clock
from sniff.sources.drivers import UNKNOWN
from sniff.sources.gateway import LATENCY

LINE = LineSettings.parse("19200,8E1")


class Hand:
    """A clock that is set by hand."""

    def __init__(self) -> None:
        self.time = 10**18

    def now(self) -> int:
        return self.time


class Port:
    """A port that gives what it is told."""

    session_adapter = Adapter("an FTDI", latency=1_000_000)

    def __init__(self, line: LineSettings) -> None:
        self.line, self.given, self.ended, self.closed = line, list[Item](), False, False

    def fileno(self) -> int | None:
        return 7

    def deadline(self) -> int | None:
        return None

    def now(self) -> int:
        return 10**18

    def read(self) -> list[Item]:
        given, self.given = self.given, []
        return given

    def reconfigure(self, line: LineSettings) -> None:
        self.line = line

    def close(self) -> None:
        self.closed = True


class Socket:
    """What ports are plugged into."""

    def __init__(self) -> None:
        self.port: Port | None = None

    def open(self, spec: str, line: LineSettings, clock: Clock) -> Port:
        if self.port is None:
            raise PortError(f"{spec}: no such port; ports here: none")
        self.port.line = line
        return self.port


def kinds(items: list[Item]) -> list[object]:
    return [item.kind if isinstance(item, LineEvent) else item.octets for item in items]


def looked(source: AwaitedSource, clock: Hand) -> list[Item]:
    """What it gives once it has looked again, which a thread does."""
    clock.time += RETRY_EVERY
    assert source.read() == []
    attempt = source._again._attempt
    assert attempt is not None
    attempt._thread.join()
    return source.read()


def test_absent_then_there_then_gone_then_back() -> None:
    clock, socket = Hand(), Socket()
    source = AwaitedSource("/dev/x", LINE, clock, socket.open)  # type: ignore[arg-type]
    assert source.session_adapter.latency > Port.session_adapter.latency
    assert source.deadline() == clock.time
    (event,) = source.read()
    assert isinstance(event, LineEvent)
    assert event.text == gone("/dev/x", "no such port")
    assert source.fileno() is None
    socket.port = Port(LINE)
    assert kinds(looked(source, clock)) == [LineEventKind.REPLUGGED]
    socket.port.given = [Chunk(1, b"abc")]
    assert kinds(source.read()) == [b"abc"]
    lost = socket.port
    lost.given, lost.ended = [LineEvent(2, LineEventKind.UNPLUGGED, gone("/dev/x", "hung up"))], True
    socket.port = Port(LINE)
    assert kinds(source.read()) == [LineEventKind.UNPLUGGED]
    assert lost.closed
    assert not source.ended
    assert kinds(looked(source, clock)) == [LineEventKind.REPLUGGED]
    source.close()
    assert source.ended
    assert socket.port.closed


def test_settings_hold_once_it_is_there() -> None:
    clock, socket = Hand(), Socket()
    source = AwaitedSource("/dev/x", LINE, clock, socket.open)  # type: ignore[arg-type]
    other = LineSettings.parse("9600,8N1")
    source.reconfigure(other)
    assert kinds(source.read()) == [LineEventKind.UNPLUGGED, LineEventKind.SETTINGS]
    socket.port = Port(LINE)
    looked(source, clock)
    assert socket.port.line == other


def test_a_port_that_is_there_is_as_it_is() -> None:
    socket = Socket()
    socket.port = Port(LINE)
    source = AwaitedSource("/dev/x", LINE, Hand(), socket.open)  # type: ignore[arg-type]
    assert source.session_adapter == Port.session_adapter
    assert source.fileno() == 7
    assert source.read() == []


@pytest.mark.parametrize(
    ("spec", "slowest"), [("/dev/x", UNKNOWN.hold), ("socket://gate:4001", LATENCY), ("rfc2217://gate:4001", LATENCY)]
)
def test_one_that_is_not_there_is_as_slow_as_any_of_its_kind(spec, slowest) -> None:
    source = AwaitedSource(spec, LINE, Hand(), Socket().open)  # type: ignore[arg-type]
    assert source.session_adapter.latency >= slowest
