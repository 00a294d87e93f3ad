"""A serial port as a source: opened once, read without waiting, found again after it was unplugged."""

from __future__ import annotations

import contextlib
import errno
import os
import shlex
from dataclasses import dataclass

from dissectors.frame import Chunk
from dissectors.line import MS, NS_PER_S, LineSettings
from sniff.engine.event_texts import gone
from sniff.engine.session import Adapter, Item, LineEvent, LineEventKind
from sniff.sources import PortError
from sniff.sources.clock import Clock
from sniff.sources.identity import PortIdentity
from sniff.sources.parmrk import ParmrkDecoder
from sniff.sources.ports import Holder, describe_port, find_holders, is_pty, is_tty, list_ports
from sniff.sources.reconnecting import Reconnecting
from sniff.sources.tty import ListeningPort, error_counters, marks_errors, open_listening

READ_SIZE = 65536
COUNTERS_EVERY = 1 * NS_PER_S
RETRY_EVERY = 1 * NS_PER_S

POLL_EVERY = 1 * MS
"""Between looks at a port that cannot be waited on (Windows)."""


class SerialSource:
    """Listens to a serial port. `adapter` is as found at opening.

    Raises PortError when it cannot be opened; afterwards nothing raises: a port that disappears gives UNPLUGGED, is
    tried again once a second (by the USB serial number, else by its path), and gives REPLUGGED.
    """

    def __init__(self, device: str, line: LineSettings, clock: Clock) -> None:
        self.device = device
        self.line = line
        self._clock = clock
        self._pending: list[Item] = []
        self._ended = False
        self._again: Reconnecting[_Found] = Reconnecting(
            clock, lambda: _find(self._identity, self.line), (PortError, OSError), RETRY_EVERY
        )
        self._adopt(open_port(device, line), line)
        self._pty = is_pty(device)
        self._adapter = describe_port(device, line)
        self._identity = PortIdentity.of(device)

    # -- the source contract -----------------------------------------------------------------------------------

    @property
    def session_adapter(self) -> Adapter:
        """The adapter as found at opening."""
        return self._adapter

    @property
    def ended(self) -> bool:
        """Whether the port is gone for good: closed, or a pseudo-terminal whose other side closed."""
        return self._ended

    def fileno(self) -> int | None:
        """The open port's descriptor, None while it is unplugged (and on systems that cannot wait on ports)."""
        return self._fd

    def deadline(self) -> int | None:
        """When to look at error counters, at a port without descriptor, or for a port to come back."""
        if self._ended:
            return None
        if self._port is None:
            return self._again.deadline()
        if self._fd is None:
            return self._clock.now() + POLL_EVERY
        return self._counters_at

    def now(self) -> int:
        """The time on the clock."""
        return self._clock.now()

    def read(self) -> list[Item]:
        """One read of the port, and whatever else is due."""
        items, self._pending = self._pending, []
        if self._ended:
            return items
        if self._port is None:
            return items + self._look()
        try:
            data = self._read_port()
        except OSError as error:  # includes serial.SerialException
            return items + self._unplugged(error)
        now = self._clock.now()
        if data == b"":
            return items + self._unplugged(None)
        if data:
            octets, marks = self._decoder.feed(data) if self._decoder is not None else (data, ())
            self._marked += len(marks)
            if octets:
                items.append(Chunk(now, octets, marks))
        if self._counters_at is not None and now >= self._counters_at:
            items.extend(self._count_errors(now))
        return items

    def reconfigure(self, line: LineSettings) -> None:
        """Change the settings in place, without closing: RTS and DTR do not move."""
        if self._port is not None:
            if self._counters_at is not None:  # errors up to here were made with the settings before
                self._pending.extend(self._count_errors(self._clock.now()))
            try:
                self._port.apply(line)
            except (OSError, ValueError) as error:
                with contextlib.suppress(OSError, ValueError):  # half of it may be in force
                    self._port.apply(self.line)
                raise PortError(f"{self.device}: cannot be set to {line}: {_reason(error)}") from error
            self._finish_escape()
            self._set_decoder(line)
        self.line = line
        self._pending.append(LineEvent(self._clock.now(), LineEventKind.SETTINGS, f"line={line}"))

    def close(self) -> None:
        """Let go of the port."""
        self._ended = True
        self._release()

    # -- opening -----------------------------------------------------------------------------------------------

    def _adopt(self, port: ListeningPort, line: LineSettings) -> None:
        self._port: ListeningPort | None = port
        self._fd: int | None = getattr(port, "fd", None)
        self._set_decoder(line)
        self._counters = error_counters(self._fd) if self._fd is not None else None
        self._counters_at = None if self._counters is None else self._clock.now() + COUNTERS_EVERY
        self._marked = 0

    def _set_decoder(self, line: LineSettings) -> None:
        self._decoder = ParmrkDecoder(line.parity != "N") if marks_errors(self._fd) else None

    def _release(self) -> None:
        port, self._port, self._fd = self._port, None, None
        if port is not None:
            with contextlib.suppress(OSError):
                port.close()

    # -- reading -----------------------------------------------------------------------------------------------

    def _read_port(self) -> bytes | None:
        """Octets; None when there are none; empty when the port hung up. Raises OSError when it is gone."""
        if self._fd is not None:
            try:
                return os.read(self._fd, READ_SIZE)
            except BlockingIOError:
                return None
        assert self._port is not None
        waiting = self._port.in_waiting
        return bytes(self._port.read(waiting)) if waiting else None

    def _count_errors(self, now: int) -> list[Item]:
        """Errors that the driver counted in the last second without marking an octet, and overruns."""
        self._counters_at = now + COUNTERS_EVERY
        before, marked = self._counters, self._marked
        self._marked = 0
        after = error_counters(self._fd) if self._fd is not None else None
        if before is None or after is None:
            return []
        self._counters = after
        return [
            LineEvent(now, LineEventKind.ERRORS, name, after[name] - before[name])
            for name in after
            if after[name] > before[name] and (not marked or "overrun" in name)
        ]

    def _finish_escape(self) -> None:
        held = self._decoder.flush() if self._decoder is not None else b""
        if held:
            self._pending.append(Chunk(self._clock.now(), held))

    # -- unplugged and back ------------------------------------------------------------------------------------

    def _unplugged(self, error: OSError | None) -> list[Item]:
        self._finish_escape()
        items, self._pending = self._pending, []
        # a read of a port that hung up ends, or fails with EIO: which of both is a matter of moments
        reason = "hung up" if error is None or error.errno == errno.EIO else _reason(error)
        self._release()
        now = self._again.lost()
        # The number of a pseudo-terminal is soon given to somebody else's terminal: only a link made anew is followed.
        self._ended = self._pty and self._identity.link is None
        return [*items, LineEvent(now, LineEventKind.UNPLUGGED, gone(self.device, reason))]

    def _look(self) -> list[Item]:
        """Whether the port is there again."""
        found = self._again.look()
        if found is None:
            return []
        self._adopt(found.port, found.line)
        if found.line != self.line:  # changed while the port was being looked for
            self.reconfigure(self.line)
        self.device = found.device
        self._identity = self._identity.renewed()
        return [LineEvent(self._clock.now(), LineEventKind.REPLUGGED, f"{found.device} is back")]


@dataclass(frozen=True, slots=True)
class _Found:
    """A port that came back, opened."""

    device: str
    port: ListeningPort
    line: LineSettings


def _find(identity: PortIdentity, line: LineSettings) -> _Found | None:
    device = identity.find()
    return None if device is None else _Found(device, open_port(device, line), line)


def open_port(device: str, line: LineSettings) -> ListeningPort:
    """Open a serial port for listening. Raises PortError."""
    refuse_unfit(device)
    try:
        return open_listening(device, line)
    except (OSError, ValueError) as error:
        raise PortError(explain(device, line, error)) from error


def refuse_unfit(device: str) -> None:
    """Refuse what is no port, or somebody else's, before it is opened: opening alone moves RTS and DTR.

    Raises PortError.
    """
    if os.name != "posix":
        return
    if not os.path.exists(device):
        raise PortError(f"{device}: no such port; {_ports_there_are()}")
    if os.path.isdir(device):
        raise PortError(f"{device}: a folder, not a serial port; {_ports_there_are()}")
    if os.path.isfile(device):
        raise PortError(
            f"{device}: a file, not a serial port; to read a capture use: sniff485 open {shlex.quote(device)}"
        )
    if not is_tty(device):
        raise PortError(f"{device}: not a serial port; {_ports_there_are()}")
    if is_pty(device):
        return  # a virtual bus holds both sides; its lock says whether somebody listens
    holders = find_holders([device]).get(device)
    if holders:
        raise PortError(_held(device, holders))


def explain(device: str, line: LineSettings, error: OSError | ValueError) -> str:
    """Why a port did not open, in one line with the way out."""
    code = getattr(error, "errno", None)
    if code in (errno.EACCES, errno.EPERM):
        return f"{device}: permission denied; add yourself to group {_group(device)}"
    if code in (errno.EBUSY, errno.EAGAIN, errno.EWOULDBLOCK):
        return _held(device, find_holders([device]).get(device, []))
    if code in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
        return f"{device}: no such port; {_ports_there_are()}"
    if code in (errno.ENOTTY, errno.EINVAL) or "tcgetattr" in str(error) or "Inappropriate" in str(error):
        return f"{device}: not a serial port, or it cannot do {line}; {_ports_there_are()}"
    return f"{device}: cannot be opened as {line}: {_reason(error)}; {_ports_there_are()}"


def _held(device: str, holders: list[Holder]) -> str:
    ours = [holder for holder in holders if holder.name.startswith("sniff485 ")]
    if ours:
        return f"{device}: held by {ours[0]}; to end it: kill {ours[0].pid}"
    held_by = ", ".join(map(str, holders)) or "another process"
    return f"{device}: held by {held_by}; stop that first"


def _reason(error: Exception) -> str:
    code = getattr(error, "errno", None)
    text = os.strerror(code) if isinstance(code, int) and code > 0 else str(error)
    return " ".join(text.split()) or type(error).__name__


def _ports_there_are() -> str:
    names = [port.device for port in list_ports()]
    return f"ports here: {' '.join(names)}" if names else "this machine shows no serial ports"


def _group(device: str) -> str:
    try:
        import grp

        return grp.getgrgid(os.stat(device).st_gid).gr_name
    except (ImportError, KeyError, OSError):
        return "dialout"
