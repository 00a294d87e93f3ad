"""Sources of chunks: a serial port, a gateway on the network, a capture file. All of them only listen."""

from __future__ import annotations

import os
import re
from typing import Protocol

from dissectors.line import LineSettings
from sniff.engine.session import Adapter, Item
from sniff.sources.clock import Clock


class PortError(Exception):
    """A port that cannot be used; one line that names it, what is wrong and the way out."""


class Source(Protocol):
    """Something that gives chunks and line events, without ever waiting. It has no way to send.

    All times are ns on the clock that the source was opened with (a capture file keeps its own times).
    """

    @property
    def session_adapter(self) -> Adapter:
        """What the octets come through and what that allows to be known."""
        ...

    @property
    def ended(self) -> bool:
        """Whether nothing will ever come again."""
        ...

    def fileno(self) -> int | None:
        """What to wait on for reading; None while there is nothing, and it may change after every `read`."""
        ...

    def deadline(self) -> int | None:
        """When to call `read` although nothing is readable (ns on the opening clock), None for never."""
        ...

    def read(self) -> list[Item]:
        """What is there now, in order of time; empty when nothing is. Never raises for trouble on the line."""
        ...

    def now(self) -> int:
        """The time up to which everything that arrived has been given by `read` (ns, as in its chunks)."""
        ...

    def reconfigure(self, line: LineSettings) -> None:
        """Change the line settings without closing; says so with a SETTINGS event. Raises PortError."""
        ...

    def close(self) -> None:
        """Let go of it."""
        ...


_URL = re.compile(r"(?P<scheme>[a-z][a-z0-9+.-]*)://", re.IGNORECASE)


def open_source(spec: str, line: LineSettings, clock: Clock | None = None) -> Source:
    """Open what `spec` names: "socket://host:port", "rfc2217://host:port", a capture file, "follow:FILE" for a
    recording that is still being written, else a serial port.

    `clock`: the capture's clock, a new one when None. Raises PortError.
    """
    clock = clock or Clock.start()
    url = _URL.match(spec)
    if url is not None:
        from sniff.sources.gateway import open_gateway

        return open_gateway(spec, line, clock)
    if spec.startswith("follow:"):
        from sniff.sources.growing_recording import SCHEME, GrowingRecordingSource

        return GrowingRecordingSource(spec.removeprefix(SCHEME), clock)
    from sniff.formats.table import suffixes

    if os.path.isfile(spec) or spec.lower().endswith(suffixes()):
        from sniff.sources.capture_file import CaptureFileSource

        return CaptureFileSource(spec, clock)
    from sniff.sources.serial_port import SerialSource

    return SerialSource(spec, line, clock)
