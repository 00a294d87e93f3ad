from __future__ import annotations

import socket
import threading
import time
from collections.abc import Iterator

import pytest
import serial
from serial import rfc2217

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.engine.session import Item, LineEvent, LineEventKind
from sniff.sources import PortError, Source, gateway, open_source
from sniff.sources.clock import Clock
from sniff.sources.telnet import Data, Subnegotiation, TelnetDecoder

LINE = LineSettings.parse("19200,8E1")


def gather(source: Source, enough, seconds: float = 5.0) -> list[Item]:
    items: list[Item] = []
    until = time.monotonic() + seconds
    while not enough(items):
        assert time.monotonic() < until, f"only {items}"
        items += source.read()
        time.sleep(0.002)
    return items


def octets(items: list[Item]) -> bytes:
    return b"".join(item.octets for item in items if isinstance(item, Chunk))


class Gateway:
    """A gateway on this machine. `heard`: everything that a client sent."""

    def __init__(self) -> None:
        self.server = socket.create_server(("127.0.0.1", 0))
        self.port = self.server.getsockname()[1]
        self.client: socket.socket | None = None

    def accept(self) -> socket.socket:
        self.server.settimeout(5)
        self.client, _ = self.server.accept()
        return self.client

    def heard(self) -> bytes:
        assert self.client is not None
        self.client.settimeout(0.05)
        try:
            return self.client.recv(4096)
        except TimeoutError:
            return b""

    def close(self) -> None:
        self.server.close()
        if self.client is not None:
            self.client.close()


@pytest.fixture
def raw() -> Iterator[Gateway]:
    server = Gateway()
    yield server
    server.close()


def test_raw_octets_arrive_and_none_leave(raw) -> None:
    source = open_source(f"socket://127.0.0.1:{raw.port}", LINE)
    client = raw.accept()
    client.sendall(bytes(range(256)))
    assert octets(gather(source, lambda items: len(octets(items)) == 256)) == bytes(range(256))
    assert source.session_adapter.latency == gateway.LATENCY
    assert source.session_adapter.reports == ()
    assert raw.heard() == b""
    source.close()


def test_a_raw_gateway_cannot_be_set(raw) -> None:
    source = open_source(f"socket://127.0.0.1:{raw.port}", LINE)
    raw.accept()
    with pytest.raises(PortError, match="a raw gateway sets its own line"):
        source.reconfigure(LINE)
    source.close()


def test_a_lost_connection_is_made_again(raw, monkeypatch) -> None:
    monkeypatch.setattr(gateway, "RETRY_EVERY", 10_000_000)
    source = open_source(f"socket://127.0.0.1:{raw.port}", LINE)
    raw.accept().close()
    (event,) = gather(source, bool)
    assert event.kind is LineEventKind.UNPLUGGED
    assert source.fileno() is None
    assert source.deadline() is not None
    items = gather(source, bool)
    assert [item.kind for item in items if isinstance(item, LineEvent)] == [LineEventKind.REPLUGGED]
    raw.accept().sendall(b"again")
    assert octets(gather(source, lambda items: len(octets(items)) == 5)) == b"again"
    source.close()
    assert source.ended


@pytest.mark.parametrize(
    "spec", ["socket://", "socket://host", "socket://host:many", "rfc2217://:4000", "socket://[::1"]
)
def test_what_is_missing_in_an_address_is_said(spec) -> None:
    with pytest.raises(PortError, match=r"write (socket|rfc2217)://HOST:PORT"):
        open_source(spec, LINE)


def test_unknown_kind_of_port() -> None:
    with pytest.raises(PortError, match="unknown kind of port loop://; expected a serial port, socket://HOST:PORT"):
        open_source("loop://", LINE)


def test_nobody_there(raw) -> None:
    port = raw.port
    raw.close()
    with pytest.raises(PortError, match=rf"^socket://127.0.0.1:{port}: no connection: .*refused"):
        open_source(f"socket://127.0.0.1:{port}", LINE)


class Rfc2217Gateway(Gateway):
    """pyserial's own server side. `sent_out`: data that would have gone out on the bus; `heard_octets`: everything.

    `mute`: it does not answer for RTS, DTR and flow control, as gateways do whose ports have no such lines.
    """

    def __init__(self, mute: bool = False) -> None:
        super().__init__()
        self.mute = mute
        self.sent_out = b""
        self.heard_octets = b""
        self.masks: list[bytes] = []
        self.port_behind = serial.serial_for_url("loop://")
        self.ready = threading.Event()
        self.thread = threading.Thread(target=self.serve, daemon=True)
        self.thread.start()

    def serve(self) -> None:
        client = self.accept()
        outer = self

        class Connection:
            def write(self, octets: bytes) -> None:
                client.sendall(octets)

        class Manager(rfc2217.PortManager):
            def _telnet_process_subnegotiation(self, suboption):
                if outer.mute and suboption[1:2] == rfc2217.SET_CONTROL:
                    return
                if suboption[1:2] == rfc2217.SET_LINESTATE_MASK:
                    outer.masks.append(suboption[2:])
                    outer.ready.set()
                super()._telnet_process_subnegotiation(suboption)

        self.manager = Manager(self.port_behind, Connection())
        try:
            while data := client.recv(1024):
                self.heard_octets += data
                self.sent_out += b"".join(self.manager.filter(data))
        except OSError:
            pass

    def feed(self, data: bytes) -> None:
        assert self.client is not None
        self.client.sendall(b"".join(self.manager.escape(data)))

    def close(self) -> None:
        if self.client is not None:
            self.client.close()
        self.thread.join(5)
        super().close()
        self.port_behind.close()


@pytest.fixture
def smart() -> Iterator[Rfc2217Gateway]:
    server = Rfc2217Gateway()
    yield server
    server.close()


def test_rfc2217_sets_the_line_reports_errors_and_sends_no_data(smart) -> None:
    source = open_source(f"rfc2217://127.0.0.1:{smart.port}", LineSettings.parse("38400,8E2"))
    assert smart.ready.wait(5)
    behind = smart.port_behind
    assert (behind.baudrate, behind.bytesize, behind.parity, behind.stopbits) == (38400, 8, "E", 2)
    assert (behind.rts, behind.dtr) == (False, False)
    assert smart.masks == [bytes([2 | 4 | 8 | 16])]
    everything = bytes(range(256)) + b"\xff\xff"
    smart.feed(everything)
    items = gather(source, lambda items: len(octets(items)) == len(everything))
    assert octets(items) == everything
    smart.manager.rfc2217_send_subnegotiation(rfc2217.SERVER_NOTIFY_LINESTATE, bytes([4 | 16]))
    events = gather(source, lambda items: len(items) >= 2)
    assert [(event.kind, event.text) for event in events] == [
        (LineEventKind.ERRORS, "parity"),
        (LineEventKind.ERRORS, "break"),
    ]
    source.reconfigure(LINE)
    assert (behind.baudrate, behind.stopbits) == (19200, 1)
    assert [item.kind for item in source.read()] == [LineEventKind.SETTINGS]
    with pytest.raises(PermissionError):
        source._stream._gateway.write(b"x")
    assert smart.sent_out == b""
    source.close()


CONTROL = {rfc2217.SET_CONTROL_USE_NO_FLOW_CONTROL, rfc2217.SET_CONTROL_DTR_OFF, rfc2217.SET_CONTROL_RTS_OFF}
SETTINGS = {rfc2217.SET_BAUDRATE, rfc2217.SET_DATASIZE, rfc2217.SET_PARITY, rfc2217.SET_STOPSIZE}


def test_rfc2217_sends_nothing_but_telnet_options_and_settings(smart) -> None:
    """Read from the wire by our own decoder: no data octet, no purge of buffers, no control line raised, no break."""
    source = open_source(f"rfc2217://127.0.0.1:{smart.port}", LineSettings.parse("38400,8E2"))
    assert smart.ready.wait(5)
    asked = (
        bytes(range(256)) + b"\xff\xf6\xff\xf3\xff\xfb\x01\xff\xfd\x18\xff\xfd\x22\xff\xfe\x00\xff\xfa\x2c\x08\xff\xf0"
    )
    smart.client.sendall(asked.replace(b"\xff\xff", b"\xff"))  # every octet, AYT, BREAK, options, "flow control off"
    for token in ("9600,7O2", "115200,8N1"):
        source.reconfigure(LineSettings.parse(token))
        gather(source, lambda items: any(isinstance(item, LineEvent) for item in items))
    source.close()
    smart.thread.join(5)
    said = TelnetDecoder().feed(smart.heard_octets)
    assert said
    assert not [token for token in said if isinstance(token, Data)]
    for token in said:
        if isinstance(token, Subnegotiation):
            assert token.octets[:1] == rfc2217.COM_PORT_OPTION
            command, value = token.octets[1:2], token.octets[2:]
            assert command in SETTINGS or command == rfc2217.SET_LINESTATE_MASK or value in CONTROL, token
            assert command in {*SETTINGS, rfc2217.SET_LINESTATE_MASK, rfc2217.SET_CONTROL}, token
    assert smart.sent_out == b""


def test_rfc2217_what_came_before_a_change_stays_before_it(smart) -> None:
    source = open_source(f"rfc2217://127.0.0.1:{smart.port}", LineSettings.parse("38400,8E2"))
    assert smart.ready.wait(5)
    smart.feed(b"before")
    time.sleep(0.2)
    source.reconfigure(LINE)
    items = gather(source, lambda items: any(isinstance(item, LineEvent) for item in items))
    assert octets(items) == b"before"
    assert isinstance(items[-1], LineEvent)
    source.close()


def test_a_connection_made_while_the_settings_change_gets_the_new_ones(monkeypatch) -> None:
    monkeypatch.setattr(gateway, "RETRY_EVERY", 1)
    streams: list[SlowStream] = []

    def connect(line: LineSettings) -> SlowStream:
        streams.append(SlowStream(line))
        if len(streams) > 1:
            assert streams[0].go.wait(5)
        return streams[-1]

    source = gateway.GatewaySource("slow", LINE, Clock.start(), connect)
    assert [item.kind for item in source.read()] == [LineEventKind.UNPLUGGED]
    while len(streams) < 2:
        assert source.read() == []
    source.reconfigure(LineSettings(1200))
    source.read()
    streams[0].go.set()
    gather(source, lambda items: any(item.kind is LineEventKind.REPLUGGED for item in items))
    assert streams[1].line == LineSettings(1200)


class SlowStream:
    """A connection that breaks at the first read and comes again when `go` is set."""

    name = detail = ""
    reports = None

    def __init__(self, line: LineSettings) -> None:
        self.line = line
        self.go = threading.Event()

    def fileno(self) -> int:
        return 0

    def read(self, clock: Clock) -> list[Item]:
        raise ConnectionResetError

    def reconfigure(self, line: LineSettings) -> None:
        self.line = line

    def close(self) -> None:
        pass


def test_rfc2217_octets_before_a_loss_are_kept(smart) -> None:
    source = open_source(f"rfc2217://127.0.0.1:{smart.port}", LINE)
    assert smart.ready.wait(5)
    smart.feed(b"last words")
    smart.client.shutdown(socket.SHUT_RDWR)
    items = gather(source, lambda items: any(isinstance(item, LineEvent) for item in items))
    assert octets(items) == b"last words"
    assert items[-1].kind is LineEventKind.UNPLUGGED
    source.close()


def test_a_raw_server_is_not_taken_for_rfc2217(raw, monkeypatch) -> None:
    opened = threading.Event()

    def serve() -> None:
        client = raw.accept()
        client.sendall(b"\xff\xfa\xff\xf0\xff\xf0\x01\x02\xff")  # nonsense must not end the reading thread
        opened.wait(10)

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    with pytest.raises(PortError, match="does not seem to support RFC2217"):
        open_source(f"rfc2217://127.0.0.1:{raw.port}", LINE)
    opened.set()
    thread.join()


@pytest.fixture
def mute() -> Iterator[Rfc2217Gateway]:
    server = Rfc2217Gateway(mute=True)
    yield server
    server.close()


def test_a_gateway_without_modem_lines_is_listened_to_all_the_same(mute, monkeypatch) -> None:
    monkeypatch.setattr("sniff.sources.rfc2217.ANSWER_PATIENCE", 0.05)
    source = open_source(f"rfc2217://127.0.0.1:{mute.port}", LineSettings.parse("38400,8E2"))
    assert mute.ready.wait(5)
    mute.feed(b"\x01\xff\x02")
    items = gather(source, lambda items: octets(items) == b"\x01\xff\x02")
    note = next(item for item in items if isinstance(item, LineEvent))
    assert (note.kind, note.text) == (LineEventKind.NOTE, "DTR/RTS unknown: the gateway does not confirm them")
    assert source.session_adapter.detail.startswith("DTR/RTS unknown")
    assert (mute.port_behind.baudrate, mute.port_behind.parity) == (38400, "E")
    source.reconfigure(LINE)
    assert mute.port_behind.baudrate == 19200
    assert mute.sent_out == b""
    source.close()


def test_an_option_without_end_is_no_bus_traffic(smart, monkeypatch) -> None:
    """It is dropped and said, and the connection made anew: nobody knows what is data after it."""
    source = open_source(f"rfc2217://127.0.0.1:{smart.port}", LINE)
    assert smart.ready.wait(5)
    smart.feed(b"before")
    gather(source, lambda items: octets(items) == b"before")
    smart.client.sendall(b"\xff\xfa\x2c" + b"\x00\xff\x07" * 100_000)
    items = gather(source, lambda items: any(isinstance(item, LineEvent) for item in items))
    assert octets(items) == b""
    assert items[-1].kind is LineEventKind.UNPLUGGED
    assert "a Telnet option without end" in items[-1].text
    source.close()


def test_a_flood_is_held_back_and_every_octet_comes(smart) -> None:
    from sniff.sources.rfc2217 import MOST_HELD, READ_SIZE

    source = open_source(f"rfc2217://127.0.0.1:{smart.port}", LINE)
    assert smart.ready.wait(5)
    sent = 16 * MOST_HELD
    thread = threading.Thread(target=lambda: smart.client.sendall(bytes(sent)), daemon=True)
    thread.start()
    connection = source._stream._gateway
    until = time.monotonic() + 20
    while connection.held <= MOST_HELD:
        assert time.monotonic() < until
        time.sleep(0.01)
    came, most = 0, 0
    while came < sent:
        assert time.monotonic() < until + 20
        most = max(most, connection.held - connection.taken)
        came += len(octets(source.read()))
    thread.join(5)
    assert most <= MOST_HELD + READ_SIZE
    source.close()
