"""A Modbus client and a Modbus server made by others talk over the virtual bus; the sniffer sees and pairs it all.

The octets take the whole way: two programs, pseudo-terminals paced at the baud rate, the capture process on a tap, the
engine. What must come out is known from the bus itself, which remembers every transmission.
"""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import ModuleType

import pytest
from pymodbus.exceptions import ModbusException

from dissectors import registry
from dissectors.frame import Chunk, Frame, Noise
from dissectors.line import LineSettings, Timing
from dissectors.simulated_faults import LateResponse, LostResponse
from dissectors.tracker import Transaction, Verdict
from sniff.capture.config import SourceSpec
from sniff.capture.ipc import ReceivedMessage
from sniff.capture.link import CaptureLink
from sniff.engine.engine import Engine, Row
from sniff.simulation.bus import WHOLE, VirtualBus
from sniff.simulation.ports import HAS_PTY
from sniff.simulation.wire import Sent

pytestmark = pytest.mark.skipif(not HAS_PTY, reason="this system has no pseudo-terminals")
HERE = Path(__file__).parent
TIMEOUT = 2.0  # s that the client waits for an answer, which takes milliseconds unless the host stands still
SLOW = 8_000_000  # ns; the server answers in 1 or 2 ms unless the host stands still


def _load(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, HERE / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


client_module = _load("pymodbus_client")


@contextmanager
def server_on(port: str, framing: str, baud: int) -> Iterator[None]:
    """The server's program, from when it listens until it has ended."""
    command = [sys.executable, str(HERE / "pymodbus_server.py"), port, framing, str(baud)]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        assert process.stdout.readline() == b"ready\n"
        yield
    finally:
        process.stdin.close()
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        process.stdout.close()


class Conversation:
    """What was asked, what the bus carried, and what the sniffer makes of it."""

    def __init__(self, protocol: str, token: str) -> None:
        self.protocol = protocol
        self.framing = protocol.removeprefix("modbus-")
        self.line = LineSettings.parse(token)
        self.asked: list[tuple[str, int, Verdict]] = []
        self.truth: list[Sent] = []
        self.chunks: list[Chunk] = []
        self.timing = Timing(self.line)

    @contextmanager
    def on_bus(self) -> Iterator[VirtualBus]:
        """Bus, capture process, server and client; at the end everything has been received."""
        gap = Timing(self.line).t35 if self.framing == "rtu" else 0
        with VirtualBus(self.line, gap=gap, slice=WHOLE) as bus:
            client_port, server_port = bus.attach("client"), bus.attach("server", answers=True)
            with CaptureLink.start([SourceSpec(bus.tap(), self.line, self.protocol)]) as link:
                with server_on(server_port, self.framing, self.line.baud):
                    self.client = client_module.connect(client_port, self.framing, self.line.baud, TIMEOUT)
                    yield bus
                    self.client.close()
                self._wait_until_quiet(bus)
                messages = link.stop()
                self.timing = link.session(0).timing
            assert bus.report().tap_octets == 0, "the sniffer wrote to the bus"
        self.chunks = [m.item for m in messages if isinstance(m, ReceivedMessage) and isinstance(m.item, Chunk)]

    def ask(self, name: str, verdict: str | None = None) -> None:
        """One of the client's questions."""
        question = client_module.QUESTIONS[name]
        with suppress(ModbusException):  # its own opinion of the answer is not what is tested
            question.ask(self.client)
        self.asked.append((name, question.function, Verdict(verdict or question.verdict)))
        time.sleep(0.005)

    def to_judge(self) -> Iterator[tuple[int, str, int, Verdict]]:
        """Each question with the number of its frame, but for those that nobody could judge: an answer that is a copy
        of its request, and much later than is usual here because this host stood still, looks like a repeat.
        """
        requests = [place for place, sent in enumerate(self.truth) if sent.party == "client"]
        for place, asked in zip(requests, self.asked, strict=True):
            sent, answer = self.truth[place], self.truth[min(place + 1, len(self.truth) - 1)]
            if answer.octets != sent.octets or answer.start - sent.end < SLOW:
                yield (place + 1, *asked)

    def hear_answers(self, bus: VirtualBus, count: int) -> None:
        """Wait until the server has been heard so often on the line."""
        until = time.monotonic() + 30
        while sum(one.party == "server" and one.end > one.start for one in self.truth) < count:
            assert time.monotonic() < until, "an answer never came"
            time.sleep(0.01)
            self.truth += bus.truth()

    def _wait_until_quiet(self, bus: VirtualBus) -> None:
        until = time.monotonic() + 10
        while time.monotonic() < until:
            time.sleep(0.05)
            more = bus.truth()
            self.truth += more
            if not more and len(self.truth) >= len(self.asked):
                return

    def sniffed(self, timing: Timing | None = None) -> tuple[list[Row], list[Transaction]]:
        """Rows and closed transactions of all that was read."""
        engine = Engine(registry.get(self.protocol), timing or self.timing)
        rows: list[Row] = []
        closed: list[Transaction] = []
        for output in (*(engine.feed(chunk) for chunk in self.chunks), engine.close()):
            rows += output.rows
            closed += output.transactions
        return rows, sorted(closed, key=lambda transaction: transaction.id)


KINDS = [("modbus-rtu", "57600,8E1"), ("modbus-ascii", "57600,7E1")]


@pytest.mark.parametrize(("protocol", "token"), KINDS)
def test_every_function_is_seen_and_paired(protocol: str, token: str) -> None:
    talk = Conversation(protocol, token)
    with talk.on_bus():
        for name, question in client_module.QUESTIONS.items():
            if question.only in ("", talk.framing):
                talk.ask(name)
    rows, transactions = talk.sniffed()
    assert [row.event.octets for row in rows] == [sent.octets for sent in talk.truth]
    assert all(isinstance(row.event, Frame) and row.event.ok for row in rows)
    headers = {row.no: row.header for row in rows}
    paired = {t.request: t for t in transactions}
    for no, name, function, verdict in talk.to_judge():
        header, transaction = headers[no], paired[no]
        assert header is not None
        assert (header.function, transaction.verdict) == (function, verdict), name
        if verdict in (Verdict.ANSWERED, Verdict.EXCEPTION):
            assert transaction.response == no + 1, name
            assert transaction.latency is not None
            assert transaction.latency.low >= 0
        else:
            assert transaction.response is None, name
    if len(list(talk.to_judge())) == len(talk.asked):
        assert None not in paired, "an answer that belongs to nothing"

    _through_a_slow_adapter(talk)


def _through_a_slow_adapter(talk: Conversation) -> None:
    """The same octets in reads of 16 ms: fewer reads than frames, and the same frames."""
    talk.chunks = merged(talk.chunks, 16_000_000)
    rows, transactions = talk.sniffed(Timing(talk.line, 17_000_000))
    assert len(talk.chunks) < len(talk.truth)
    assert [row.event.octets for row in rows] == [sent.octets for sent in talk.truth]
    assert not any(isinstance(row.event, Noise) for row in rows)
    paired = {t.request: t.verdict for t in transactions}
    for no, name, _, verdict in talk.to_judge():
        assert paired[no] == verdict, name


def merged(chunks: list[Chunk], timer: int) -> list[Chunk]:
    """The same octets as an adapter with a latency timer of `timer` ns gives them."""
    out: list[Chunk] = []
    for chunk in chunks:
        tick = -(-chunk.time // timer) * timer
        if out and out[-1].time == tick:
            out[-1] = Chunk(tick, out[-1].octets + chunk.octets)
        else:
            out.append(Chunk(tick, chunk.octets))
    return out


def test_lost_and_late_answers_are_told_apart() -> None:
    talk = Conversation(*KINDS[0])
    with talk.on_bus() as bus:
        talk.ask("read holding registers")
        bus.switch([LostResponse(1.0)])
        talk.ask("read coils", "no-response")
        bus.switch([LateResponse(1.0, int((TIMEOUT + 0.25) * 1e9))])
        talk.ask("read input registers", "no-response")
        bus.switch([])
        talk.ask("read holding registers")
        talk.hear_answers(bus, 3)  # the late one comes 250 ms after the client gave up
    _, transactions = talk.sniffed()
    asked = [t for t in transactions if t.request is not None]
    assert [t.verdict for t in asked] == [verdict for _, _, verdict in talk.asked]
    (late,) = [t for t in transactions if t.request is None]
    assert (late.verdict, late.of) == (Verdict.LATE, asked[2].id)
