"""Files that hold several buses: channels of a logic analyser, connections of a gateway.

Who reads one bus names it (`chosen`, which `--bus` sets); who reads any number takes each as a capture of its own.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING

from sniff.engine.capture import Capture, CaptureError
from sniff.engine.session import Completeness, Item, LineEvent, Session

if TYPE_CHECKING:
    from sniff.engine.blocks import Block

NAMED_MOST = 12
_CHOSEN: ContextVar[str | None] = ContextVar("chosen", default=None)


class SeveralBuses:
    """A file with several buses, at least two, no two of the same name. A `Capture`, whose octets are not read as one.

    `session`: that of the first bus.
    """

    def __init__(self, path: Path, buses: Sequence[Capture]) -> None:
        self.path = path
        self.buses = tuple(buses)
        self.session: Session = buses[0].session

    @property
    def names(self) -> tuple[str, ...]:
        """What `--bus` takes."""
        return tuple(one.session.bus for one in self.buses)

    def items(self) -> Iterator[Item]:
        """Raises CaptureError, which names the buses."""
        raise CaptureError(self.refusal)

    def blocks(self) -> Iterator[Block | LineEvent]:
        """Raises CaptureError, which names the buses."""
        raise CaptureError(self.refusal)

    def completeness(self) -> Completeness:
        """That of the first bus which is not whole."""
        found = [one.completeness() for one in self.buses]
        return next((one for one in found if not one.whole), found[0])

    @property
    def refusal(self) -> str:
        """What to say to who can read one bus only."""
        return f"{self.path}: {len(self.buses)} buses in it ({self.listed}); choose with --bus NAME"

    @property
    def listed(self) -> str:
        """The names of the buses, the first of many."""
        more = ", …" if len(self.buses) > NAMED_MOST else ""
        return ", ".join(self.names[:NAMED_MOST]) + more


@contextlib.contextmanager
def chosen(name: str | None) -> Iterator[None]:
    """Meanwhile only the bus of this name is read of a file that has several; None: all; "": the only one there is."""
    token = _CHOSEN.set(name)
    try:
        yield
    finally:
        _CHOSEN.reset(token)


def buses_in(capture: Capture, path: Path | str | None = None) -> list[Capture]:
    """The buses of a file, those that were chosen. Raises CaptureError when there is none of that name; `path`: what
    the file is called then."""
    name = _CHOSEN.get()
    found = list(capture.buses) if isinstance(capture, SeveralBuses) else [capture]
    if name is None or (found == [capture] and name == capture.session.bus):
        return found
    if not name and isinstance(capture, SeveralBuses):
        raise CaptureError(capture.refusal)
    wanted = [one for one in found if one.session.bus == name] if name else found
    if wanted:
        return wanted
    if isinstance(capture, SeveralBuses):
        raise CaptureError(f"{capture.path}: no bus {name!r} in it; there are {capture.listed}")
    raise CaptureError(f"{path or capture.session.port}: no bus {name!r} in it; there is one, {capture.session.bus!r}")


def one_or_several(path: Path, buses: Sequence[Capture]) -> Capture:
    """Buses of a file, at least one, as a capture."""
    return buses[0] if len(buses) == 1 else SeveralBuses(path, buses)
