"""The virtual bus in real time, on real pseudo-terminals: who hears what, in order, and what is left behind."""

from __future__ import annotations

import os
import select
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest

from dissectors.frame import Chunk, LineError
from dissectors.line import LineSettings
from dissectors.simulated import Send
from dissectors.simulated_faults import Break, LostResponse, MarkParity
from sniff.simulation.bus import BusFailed, VirtualBus
from sniff.simulation.ports import HAS_PTY
from sniff.simulation.wire import Party, Sent

LINE = LineSettings.parse("38400,8E1")
pytestmark = pytest.mark.skipif(not HAS_PTY, reason="this system has no pseudo-terminals")


class Pty:
    """A pseudo-terminal opened the way a program opens a serial port."""

    def __init__(self, path: str) -> None:
        self.fd = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)

    def write(self, octets: bytes) -> None:
        assert os.write(self.fd, octets) == len(octets)

    def read(self, count: int, patience: float = 10.0) -> bytes:
        """At least `count` octets, or what came in `patience` seconds."""
        got, until = b"", time.monotonic() + patience
        while len(got) < count and (left := until - time.monotonic()) > 0:
            if select.select([self.fd], [], [], left)[0]:
                got += os.read(self.fd, 4096)
        return got


@pytest.fixture
def open_pty() -> Iterator[type[Pty]]:
    opened: list[Pty] = []

    class Kept(Pty):
        def __init__(self, path: str) -> None:
            super().__init__(path)
            opened.append(self)

    yield Kept
    for one in opened:
        os.close(one.fd)


@pytest.fixture(scope="module")
def running() -> Iterator[VirtualBus]:
    with VirtualBus(LINE) as bus:
        yield bus


@pytest.fixture
def bus(running: VirtualBus) -> Iterator[VirtualBus]:
    """A bus without stations, for tests that take nobody else's word for it; everybody leaves it afterwards."""
    running.switch([])
    running.truth()
    yield running
    for name in running.report().delivered:
        running.detach(name)


class Clock:
    """Says one octet, ascending, every 20 ms."""

    def __init__(self) -> None:
        self.count = 0

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        return ()

    def wake(self, now: int) -> tuple[Send, ...]:
        if now < self.count * 20_000_000:
            return ()
        self.count += 1
        return (Send(now, bytes([self.count & 0xFF])),)

    def next_wake(self) -> int | None:
        return self.count * 20_000_000


class Reverser:
    """Answers every burst with its octets backwards."""

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        return (Send(now + 2_000_000, octets[::-1]),)

    def wake(self, now: int) -> tuple[Send, ...]:
        return ()

    def next_wake(self) -> int | None:
        return None


def clock_and_reverser(clock: bool) -> list[Party]:
    reverser = Party("reverser", Reverser())
    return [Party("clock", Clock(), answers=False), reverser] if clock else [reverser]


def test_everybody_else_hears_what_one_party_writes(bus: VirtualBus, open_pty: type[Pty]) -> None:
    client, server, tap = (open_pty(path) for path in (bus.attach("client"), bus.attach("server"), bus.tap()))
    client.write(bytes(range(256)))
    assert server.read(256) == tap.read(256) == bytes(range(256))
    server.write(b"answer")
    assert client.read(6) == tap.read(6) == b"answer"
    truths = bus.truth()
    while len(truths) < 2:  # a burst of a party outside stays open for more of the same
        truths += bus.truth()
    assert [(one.party, one.octets) for one in truths if one.intact] == [
        ("client", bytes(range(256))),
        ("server", b"answer"),
    ]
    assert truths[0].end - truths[0].start == 256 * LINE.char
    assert truths[1].start >= truths[0].end


def test_octets_arrive_no_earlier_than_the_line_allows(open_pty: type[Pty]) -> None:
    line = LineSettings.parse("2400,8N1")
    with VirtualBus(line) as bus:
        client, tap = open_pty(bus.attach("client")), open_pty(bus.tap())
        before = time.monotonic_ns()
        client.write(bytes(10))
        arrived = []
        while len(arrived) < 10:
            count = len(tap.read(1))
            arrived += [time.monotonic_ns() - before] * count
        assert all(time_ns >= (place + 1) * line.char for place, time_ns in enumerate(arrived))


def test_octets_that_a_tap_writes_are_counted_and_reach_nobody(bus: VirtualBus, open_pty: type[Pty]) -> None:
    client, tap = open_pty(bus.attach("client")), open_pty(bus.tap())
    before = bus.report().tap_octets
    tap.write(b"\x01\x02\x03")
    client.write(b"x")
    assert tap.read(1) == b"x"
    report = bus.report()
    assert report.tap_octets - before == 3
    assert report.tap_first.startswith(b"\x01\x02\x03")
    assert client.read(1, patience=0.05) == b""
    assert {one.party for one in bus.truth()} <= {"client"}


def test_parties_outside_keep_the_silence_that_the_protocol_wants(open_pty: type[Pty]) -> None:
    gap = 30_000_000
    with VirtualBus(LINE, gap=gap) as bus:
        client, server = open_pty(bus.attach("client")), open_pty(bus.attach("server"))
        client.write(b"question")
        assert server.read(8) == b"question"
        server.write(b"answer")
        assert client.read(6) == b"answer"
        truths: list[Sent] = []
        while len(truths) < 2:
            truths += bus.truth()
        assert truths[1].start - truths[0].end >= gap


def test_a_party_hears_itself_only_with_echo(bus: VirtualBus, open_pty: type[Pty]) -> None:
    plain, echoing = open_pty(bus.attach("plain")), open_pty(bus.attach("echoing", echo=True))
    echoing.write(b"one")
    assert plain.read(3) == b"one"
    assert echoing.read(3) == b"one"
    plain.write(b"two")
    assert echoing.read(3) == b"two"
    assert plain.read(1, patience=0.05) == b""


def test_stations_inside_answer_a_party_outside(open_pty: type[Pty]) -> None:
    with VirtualBus(LINE, partial(clock_and_reverser, False)) as bus:
        client = open_pty(bus.attach("client"))
        client.write(b"abc")
        assert client.read(3) == b"cba"
        client.write(b"1234567890")
        assert client.read(10) == b"0987654321"


def test_a_paused_bus_begins_when_told_so_that_a_tap_misses_nothing(open_pty: type[Pty]) -> None:
    with VirtualBus(LINE, partial(clock_and_reverser, True), paused=True) as bus:
        tap = open_pty(bus.tap())
        assert tap.read(1, patience=0.1) == b""
        bus.begin()
        assert tap.read(6)[:6] == b"\x01\x01\x02\x02\x03\x03"


def test_faults_strike_and_can_be_switched(open_pty: type[Pty]) -> None:
    with VirtualBus(LINE, partial(clock_and_reverser, False), [LostResponse(1.0)]) as bus:
        client = open_pty(bus.attach("client"))
        client.write(b"abc")
        assert client.read(1, patience=0.1) == b""
        assert bus.report().struck == {"lost": 1}
        bus.switch([])
        client.write(b"abc")
        assert client.read(3) == b"cba"


def test_memory_ports_work_like_the_others_and_carry_line_errors() -> None:
    with VirtualBus(LINE, faults=[MarkParity(1.0)]) as bus:
        client, server, tap = bus.connect("client"), bus.connect("server"), bus.memory_tap()
        client.write(b"abc")
        heard = _all(server, 3)
        assert b"".join(chunk.octets for chunk in heard) == b"abc"
        assert [mark.error for chunk in heard for mark in chunk.marks] == [LineError.PARITY] * 3
        assert b"".join(chunk.octets for chunk in _all(tap, 3)) == b"abc"
        assert client.read() == []
        bus.switch([Break(1.0)])
        server.write(b"d")
        heard = _all(client, 2)
        assert heard[-1].octets == b"\0"
        assert heard[-1].marks[0].error is LineError.BREAK
        client.close()
        with pytest.raises(OSError, match="client"):
            client.read()


def _all(port, count: int) -> list[Chunk]:  # type: ignore[no-untyped-def]
    chunks: list[Chunk] = []
    until = time.monotonic() + 10
    while sum(len(chunk.octets) for chunk in chunks) < count and time.monotonic() < until:
        chunks += port.read(timeout=1.0)
    return chunks


def test_a_gateway_gives_the_same_octets_over_the_network_and_takes_none(bus: VirtualBus) -> None:
    client, url = bus.connect("client"), bus.gateway()
    assert url.startswith("socket://127.0.0.1:")
    before = bus.report().tap_octets
    with socket.create_connection(("127.0.0.1", int(url.rsplit(":", 1)[1])), timeout=10) as reader:
        while not bus.report().delivered["gateway"]:  # it takes a moment to answer the call
            client.write(b"?")
            time.sleep(0.005)
        reader.sendall(b"spoken by a sniffer")
        client.write(b"the end")
        heard = b""
        while not heard.endswith(b"the end"):
            heard += reader.recv(4096)
        assert set(heard.removesuffix(b"the end")) == {ord("?")}
        until = time.monotonic() + 10
        while bus.report().tap_octets - before < 19 and time.monotonic() < until:
            time.sleep(0.005)
        assert bus.report().tap_octets - before == 19
    assert {one.party for one in bus.truth()} == {"client"}


def test_a_tap_that_nobody_reads_holds_nobody_up(open_pty: type[Pty]) -> None:
    with VirtualBus(LineSettings.parse("10000000,8N1")) as bus:
        client, server = open_pty(bus.attach("client")), open_pty(bus.attach("server"))
        bus.tap("deaf")
        for _ in range(60):
            client.write(bytes(3000))
            assert len(server.read(3000)) == 3000
        report = bus.report()
        assert report.delivered["server"] == 180_000
        assert report.unread["deaf"] > 0
        assert report.delivered["deaf"] + report.unread["deaf"] == 180_000


def test_a_name_is_given_once_and_a_closed_bus_says_so() -> None:
    bus = VirtualBus(LINE)
    with bus:
        bus.attach("client")
        with pytest.raises(OSError, match="client"):
            bus.attach("client")
        bus.detach("client")
        bus.attach("client")
    with pytest.raises(BusFailed, match="not open"):
        bus.attach("other")
    bus.close()


def test_an_adapter_can_be_unplugged_and_plugged_in_again_under_one_name(
    bus: VirtualBus, open_pty: type[Pty], tmp_path: Path
) -> None:
    link = str(tmp_path / "ttyTAP")
    client = open_pty(bus.attach("client"))
    assert bus.tap(link=link) == link
    tap = open_pty(link)
    client.write(b"one")
    assert tap.read(3) == b"one"
    bus.detach("tap")
    assert not os.path.lexists(link)
    assert os.read(tap.fd, 1) == b""  # hung up
    said = bus.truth()
    client.write(b"two")
    until = time.monotonic() + 30
    while b"two" not in b"".join(one.octets for one in said) and time.monotonic() < until:
        said += bus.truth()
    bus.tap(link=link)
    again = open_pty(link)
    client.write(b"three")
    assert again.read(5) == b"three"
    bus.detach("tap")
    assert not os.path.lexists(link)


def test_the_bus_ends_with_its_parent() -> None:
    """Also when the parent is killed and can tidy nothing up."""
    program = """if True:
        import sys
        from dissectors.line import LineSettings
        from sniff.simulation.bus import VirtualBus
        if __name__ == "__main__":
            bus = VirtualBus(LineSettings())
            bus.open()
            bus.tap()
            print(bus.pid, flush=True)
            sys.stdin.read()
    """
    with subprocess.Popen([sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as parent:
        assert parent.stdout is not None
        pid = int(parent.stdout.readline())
        parent.kill()
    until = time.monotonic() + 10
    while _runs(pid) and time.monotonic() < until:
        time.sleep(0.02)
    assert not _runs(pid)


def _runs(pid: int) -> bool:
    try:
        stat = Path(f"/proc/{pid}/stat").read_text(encoding="ascii")
    except OSError:
        return False
    return stat.rsplit(")", 1)[1].split()[0] != "Z"  # whoever inherits orphans may be slow to bury them


@pytest.mark.skipif(not os.path.isdir("/proc/self/fd"), reason="this system does not show open files")
def test_nothing_is_left_behind() -> None:
    with VirtualBus(LINE):  # what Python itself keeps from the first start on
        pass
    before = set(os.listdir("/proc/self/fd"))
    with VirtualBus(LINE, partial(clock_and_reverser, True)) as bus:
        paths = [bus.attach("client"), bus.tap()]
        pid = bus.pid
        assert pid is not None
        assert all(os.path.exists(path) for path in paths)
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)  # ended and waited for
    assert set(os.listdir("/proc/self/fd")) == before


def test_a_bus_whose_process_dies_is_an_error_not_a_hang() -> None:
    with VirtualBus(LINE) as bus:
        pid = bus.pid
        assert pid is not None
        os.kill(pid, 9)
        with pytest.raises(BusFailed, match="ended"):
            bus.report()
