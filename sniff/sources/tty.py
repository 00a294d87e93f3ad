"""A serial port that pyserial opens and configures, and that nothing can be sent through.

Rules of this file:
1. The transmitter is let go first: RTS and DTR are cleared before anything else is done to an open port, because many
   RS-485 adapters key their driver with them. Linux raises both while it opens a tty; that instant cannot be avoided.
2. Echo is off as soon as the port is configured: a tty that echoes would talk on the bus.
3. Line errors are marked (INPCK, PARMRK). pyserial clears both whenever it configures, so they are set again after it.
4. There is no way to write: every method of pyserial that could send raises.
"""

from __future__ import annotations

import contextlib
import importlib.util
import struct
from collections.abc import Iterator
from typing import Any, NoReturn, cast

import serial

from dissectors.line import LineSettings
from sniff.sources.ports import is_pty


class ListeningPort(serial.Serial):
    """pyserial's port without its sending half."""

    _batch = False  # several settings are being changed: configure once, afterwards

    def _reconfigure_port(self, *args: Any, **kwargs: Any) -> None:
        if self._batch:
            return
        fd = getattr(self, "fd", None)  # Windows has a handle instead
        release_transmitter(fd)
        with termios_errors():
            cast(Any, super())._reconfigure_port(*args, **kwargs)
        standard = getattr(self, "BAUDRATE_CONSTANTS", (self.baudrate,))
        if mark_line_errors(fd) and self.baudrate not in standard:
            cast(Any, self)._set_special_baudrate(self.baudrate)  # the step before knows only the standard rates

    def apply(self, line: LineSettings) -> None:
        """Take other line settings, in one step. Raises serial.SerialException, OSError or ValueError."""
        self._batch = True
        try:
            self.baudrate = line.baud
            self.bytesize = line.data_bits
            self.parity = line.parity
            self.stopbits = stop_bits(line)
        finally:
            self._batch = False
        if self.is_open:
            self._reconfigure_port()

    def _update_rts_state(self) -> None:
        if self.rts:
            self._refuse()
        cast(Any, super())._update_rts_state()

    def _update_dtr_state(self) -> None:
        if self.dtr:
            self._refuse()
        cast(Any, super())._update_dtr_state()

    def _refuse(self, *_: object, **__: object) -> NoReturn:
        raise PermissionError("this port only listens")

    write = writelines = send_break = _update_break_state = _set_rs485_mode = _refuse
    set_input_flow_control = set_output_flow_control = _refuse


def open_listening(device: str, line: LineSettings) -> ListeningPort:
    """Open a port for listening: exclusive, RTS and DTR off, line errors marked, low latency asked for.

    Raises serial.SerialException, OSError or ValueError.
    """
    port = ListeningPort()
    port.rts = False
    port.dtr = False
    port.port = device
    port.exclusive = True if _can_lock() else None
    port.timeout = 0
    port.apply(line)
    with termios_errors():
        port.open()
    keep_others_out(port)
    ask_low_latency(port)
    return port


@contextlib.contextmanager
def termios_errors() -> Iterator[None]:
    """Have errors of termios, which are of a kind of their own and which pyserial lets through, raised as OSError."""
    try:
        import termios
    except ImportError:
        yield
        return
    try:
        yield
    except termios.error as error:
        raise OSError(*error.args) from error


def stop_bits(line: LineSettings) -> float:
    """Stop bits as pyserial names them."""
    if line.stop_bits == 1.5:
        return serial.STOPBITS_ONE_POINT_FIVE
    return serial.STOPBITS_TWO if line.stop_bits == 2 else serial.STOPBITS_ONE


def _can_lock() -> bool:
    """Windows always opens exclusively and knows no other way."""
    return importlib.util.find_spec("fcntl") is not None


def release_transmitter(fd: int | None) -> None:
    """Clear RTS and DTR at once; a port without such lines (a pseudo-terminal) has none to clear."""
    try:
        import fcntl
        import termios
    except ImportError:  # Windows: pyserial opens with both off
        return
    if fd is not None:
        with contextlib.suppress(OSError):
            fcntl.ioctl(fd, termios.TIOCMBIC, struct.pack("I", termios.TIOCM_RTS | termios.TIOCM_DTR))


def keep_others_out(port: ListeningPort) -> None:
    """Have the system refuse others that open the port: they would take octets away and raise RTS and DTR.

    The lock that pyserial takes stops only those who ask for it. Not for a pseudo-terminal: whoever made it holds it
    open, so that the refusal would outlive a process that is killed.
    """
    fd = getattr(port, "fd", None)
    if fd is None or is_pty(str(port.port)):
        return
    with contextlib.suppress(ImportError, OSError):
        import fcntl
        import termios

        fcntl.ioctl(fd, termios.TIOCEXCL)


def mark_line_errors(fd: int | None) -> bool:
    """Have errors marked within the octets and reads return at once with one octet or more; False if impossible."""
    try:
        import termios
    except ImportError:
        return False
    if fd is None:
        return False
    try:
        attributes = termios.tcgetattr(fd)
        attributes[0] &= ~(termios.IGNPAR | termios.IGNBRK | termios.BRKINT | termios.ISTRIP)
        attributes[0] |= termios.INPCK | termios.PARMRK
        attributes[6][termios.VMIN] = 1
        attributes[6][termios.VTIME] = 0
        termios.tcsetattr(fd, termios.TCSANOW, attributes)
        return bool(termios.tcgetattr(fd)[0] & termios.PARMRK)
    except (OSError, termios.error):
        return False


def marks_errors(fd: int | None) -> bool:
    """Whether PARMRK is in force, so that reads must be decoded."""
    try:
        import termios

        with termios_errors():
            return fd is not None and bool(termios.tcgetattr(fd)[0] & termios.PARMRK)
    except (ImportError, OSError):
        return False


def ask_low_latency(port: ListeningPort) -> bool:
    """Ask the driver not to hold octets back (Linux ASYNC_LOW_LATENCY); whether it said yes."""
    try:
        port.set_low_latency_mode(True)
    except (AttributeError, OSError, ValueError):
        return False
    return True


_COUNTERS = struct.Struct("20i")
_TIOCGICOUNT = 0x545D
_NAMES = {6: "framing", 7: "overrun", 8: "parity", 9: "break", 10: "buffer overrun"}


def error_counters(fd: int) -> dict[str, int] | None:
    """The driver's own counters since it was loaded (Linux TIOCGICOUNT); None where it has none."""
    try:
        import fcntl

        raw = fcntl.ioctl(fd, _TIOCGICOUNT, bytes(_COUNTERS.size))
    except (ImportError, OSError):
        return None
    values = _COUNTERS.unpack(raw)
    return {name: values[index] for index, name in _NAMES.items()}
