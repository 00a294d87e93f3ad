"""sniff485, the application: sources, recording, formats, the engine, and its two faces (command line and terminal).

For notebooks: `sniff.read("night.mcap")` gives a capture as data frames; see data_frames.py.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from sniff.version import __version__ as __version__

if TYPE_CHECKING:
    from pathlib import Path

    from sniff.data_frames import DataCapture


def read(
    path: str | Path,
    protocol: str | None = None,
    line: str | None = None,
    devices: str | Iterable[str] = (),
    bus: str | None = None,
) -> DataCapture:
    """Open a capture for data frames. `protocol`, `line`, `devices`: as -p, -s and -d say it, the last two such as
    "9600,8N1", "3=teco-e510". `bus`: which one of a file with several, as `buses` names them. Raises CaptureError,
    ValueError, registry.UnknownProtocol."""
    from sniff import data_frames  # numpy and all formats: not for whoever wants the version

    return data_frames.read(path, protocol, line, devices, bus)


def buses(path: str | Path) -> tuple[str, ...]:
    """The names of the buses in a capture, one as a rule. Raises CaptureError."""
    from sniff import data_frames

    return data_frames.buses(path)
