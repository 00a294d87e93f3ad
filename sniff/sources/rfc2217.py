"""A gateway that speaks RFC 2217: the line is set through it, and it may report line errors.

What is sent: Telnet options, line settings, RTS and DTR off, no flow control, and our mask of line states. Those octets
are a dialogue between this host and the gateway (RFC 2217, clause 3). Data octets, which would go out on the bus, are
never sent and cannot be: every method that would is refused. Nor are the gateway's buffers purged, as pyserial does at
opening: what waits in them may be somebody else's frame. A test reads every octet that leaves.
pyserial keeps line states to itself and reads octet by octet, so its reading loop is replaced by ours: it stamps each
packet at once and reports line states where they came in the stream. RFC 2217 ties a state to no octet.
"""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from collections import deque
from typing import Any, NoReturn, cast

from serial import SerialException, rfc2217

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.engine.session import Item, LineEvent, LineEventKind
from sniff.sources.clock import Clock
from sniff.sources.telnet import Data, Negotiation, OutOfStep, TelnetDecoder
from sniff.sources.tty import stop_bits

READ_SIZE = 65536
MOST_HELD = 1 << 20
"""Octets that wait to be taken."""

OUT_OF_STEP = "a Telnet option without end came; what follows it cannot be told from it, and is not recorded"
ANSWER_PATIENCE = 1.0
"""Seconds for the answer to a request for RTS, DTR or flow control; gateways that have no such lines give none."""

_ERRORS = {2: "overrun", 4: "parity", 8: "framing", 16: "break"}
_MASK = bytes([sum(_ERRORS)])
_COM_PORT = 44
CONTROLS = {
    rfc2217.SET_CONTROL_RTS_ON: "RTS",
    rfc2217.SET_CONTROL_RTS_OFF: "RTS",
    rfc2217.SET_CONTROL_DTR_ON: "DTR",
    rfc2217.SET_CONTROL_DTR_OFF: "DTR",
}
_NOTIFY_LINESTATE = 106

_Base: Any = rfc2217.Serial  # pyserial's inner names have no types


class _ListeningGateway(_Base):  # type: ignore[misc]
    """pyserial's client without its sending half; what it reads goes to `items`."""

    batch = False  # several settings are being changed: negotiate once, afterwards

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.items: deque[Item] = deque()
        self.wake_in, self.wake_out = socket.socketpair()
        self.wake_in.setblocking(False)
        self.wake_out.setblocking(False)
        self.listening = False  # octets from before the settings were in force belong to another line
        self.held = self.taken = 0  # octets of the line put into `items`, and taken from there
        self.lost: str | None = None
        self.silent = False  # nothing came in answer to the last request for control lines
        self.unknown: set[str] = set()  # what it did not confirm
        super().__init__()

    def ask_line_states(self) -> None:
        """Have the gateway report line errors (SET-LINESTATE-MASK)."""
        self.rfc2217_send_subnegotiation(rfc2217.SET_LINESTATE_MASK, _MASK)

    def _reconfigure_port(self) -> None:
        if self.batch:
            return
        try:
            super()._reconfigure_port()
        except SerialException:
            settings = self._rfc2217_port_settings.items()
            silent = ", ".join(name for name, item in settings if item.state == rfc2217.REQUESTED)
            if not silent:
                raise
            raise SerialException(f"the gateway does not confirm {silent}") from None

    def rfc2217_set_control(self, value: bytes) -> None:
        """Ask for RTS, DTR or no flow control; a gateway that does not answer, or refuses, is taken as it is."""
        item = self._rfc2217_options["control"]
        item.set(value)
        until = time.monotonic() + (0 if self.silent else ANSWER_PATIENCE)
        try:
            while not item.is_ready():
                if time.monotonic() >= until:
                    self.silent = True  # one wait is enough
                    break
                time.sleep(0.02)
            else:
                return
        except ValueError:  # refused
            pass
        self.unknown.add(CONTROLS.get(value, "flow control"))

    def _telnet_read_loop(self) -> None:
        decoder = TelnetDecoder()
        while self.is_open:
            try:
                octets = self._socket.recv(READ_SIZE)
            except TimeoutError:
                continue  # only to look whether still open
            except OSError as error:
                self._lose(error.strerror or str(error))
                return
            now = self.clock.now()
            if not octets:
                self._lose("closed by the gateway")
                return
            try:
                for token in decoder.feed(octets):
                    self._take(now, token)
            except OSError as error:  # an answer could not be sent, or the gateway is out of step
                self._lose(error.strerror or str(error))
                return
            except Exception as error:  # answers that pyserial did not expect
                self._lose(f"{type(error).__name__}: {error}")
                return

    def _take(self, now: int, token: object) -> None:
        if isinstance(token, Data):
            if self.listening:
                self._give(Chunk(now, token.octets))
        elif isinstance(token, Negotiation):
            self._telnet_negotiate_option(bytes([token.command]), bytes([token.option]))
        elif isinstance(token, OutOfStep):
            raise ConnectionResetError(OUT_OF_STEP)  # made anew, both sides agree again
        else:
            sub = cast(Any, token).octets
            if sub[:2] == bytes([_COM_PORT, _NOTIFY_LINESTATE]) and len(sub) >= 3:
                for bit, name in _ERRORS.items():
                    if sub[2] & bit:
                        self._give(LineEvent(now, LineEventKind.ERRORS, name, 1))
            elif sub[:1] == bytes([_COM_PORT]):
                # an answer to what was never asked makes pyserial compare with None
                with contextlib.suppress(TypeError):
                    self._telnet_process_subnegotiation(sub)

    def _give(self, item: Item) -> None:
        octets = len(getattr(item, "octets", b""))
        while octets and self.held - self.taken > MOST_HELD and self.is_open:
            time.sleep(0.01)  # the gateway is to wait: what it sends next stays in the network's buffers
        self.held += octets
        self.items.append(item)
        self.wake()

    def _lose(self, reason: str) -> None:
        self.lost = reason
        self.wake()

    def wake(self) -> None:
        """Make the descriptor readable."""
        with contextlib.suppress(OSError):
            self.wake_in.send(b"\0")

    def _refuse(self, *_: object, **__: object) -> NoReturn:
        raise PermissionError("this port only listens")

    def reset_input_buffer(self) -> None:
        """Nothing: what is in the gateway is not ours to throw away."""

    reset_output_buffer = reset_input_buffer

    write = writelines = send_break = _update_break_state = _refuse


class Rfc2217Stream:
    """A connection to a gateway. Raises OSError or ValueError when it cannot be made."""

    reports: tuple[str, ...] | None = ("parity", "framing", "break", "overrun")
    name = "RFC 2217 gateway"
    detail = "line errors are reported for a time, not for an octet, and only if the gateway supports it"

    def __init__(self, spec: str, line: LineSettings, clock: Clock) -> None:
        gateway = _ListeningGateway(clock)
        gateway.rts = False
        gateway.dtr = False
        gateway.port = spec
        _apply(gateway, line)
        try:
            gateway.open()
            gateway.ask_line_states()
        except BaseException:
            gateway.wake_in.close()
            gateway.wake_out.close()
            raise
        gateway.listening = True
        self._gateway = gateway
        lines = "/".join(sorted(gateway.unknown & set(CONTROLS.values())))
        if lines:
            said = f"{lines} unknown: the gateway does not confirm them"
            self.detail = f"{said}; {self.detail}"
            gateway._give(LineEvent(clock.now(), LineEventKind.NOTE, said))

    def fileno(self) -> int:
        """Readable when something has come."""
        return int(self._gateway.wake_out.fileno())

    def read(self, clock: Clock) -> list[Item]:
        """What is there. Raises OSError when the connection is gone."""
        gateway = self._gateway
        with contextlib.suppress(BlockingIOError):
            gateway.wake_out.recv(READ_SIZE)
        items: list[Item] = []
        for _ in range(len(gateway.items)):  # not what comes meanwhile: a flood would never let us go
            items.append(gateway.items.popleft())
            gateway.taken += len(getattr(items[-1], "octets", b""))
        if gateway.items:
            gateway.wake()
        if not items and gateway.lost is not None:
            raise ConnectionResetError(gateway.lost)
        if gateway.lost is not None:
            gateway.wake()  # come again for the reason
        return items

    def reconfigure(self, line: LineSettings) -> None:
        """Change the line through the gateway; waits for its answer. Raises OSError or ValueError."""
        _apply(self._gateway, line)
        self._gateway._reconfigure_port()

    def close(self) -> None:
        """Let go, without waiting for the gateway."""
        gateway = self._gateway
        # pyserial waits for its thread and then some; nobody else should
        threading.Thread(target=self._close, args=(gateway,), daemon=True).start()

    @staticmethod
    def _close(gateway: Any) -> None:
        gateway.close()
        gateway.wake_in.close()
        gateway.wake_out.close()


def _apply(gateway: Any, line: LineSettings) -> None:
    gateway.batch = True
    try:
        gateway.baudrate = line.baud
        gateway.bytesize = line.data_bits
        gateway.parity = line.parity
        gateway.stopbits = stop_bits(line)
    finally:
        gateway.batch = False
