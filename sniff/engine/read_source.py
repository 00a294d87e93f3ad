"""What the engine reads: reads of a bus, one by one or in blocks, and tables where somebody keeps what it found."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from sniff.engine.session import Item, LineEvent, Session

if TYPE_CHECKING:
    from sniff.engine.blocks import Block
    from sniff.engine.table import Table


class ReadSource(Protocol):
    """Reads, one by one and in blocks."""

    def items(self) -> Iterator[Item]:
        """See `engine.capture.Capture`."""
        ...

    def blocks(self) -> Iterator[Block | LineEvent]:
        """See `engine.capture.Capture`."""
        ...


@runtime_checkable
class KeepsTables(Protocol):
    """A capture that may hold what the engine finds in it."""

    def stored_tables(self, session: Session) -> Iterator[Table | LineEvent] | None:
        """What `bulk.tables` gives of its blocks with this session; None where it does not hold just that. Raises
        CaptureError, then and while they are taken."""
        ...


def stored_tables(capture: object, session: Session) -> Iterator[Table | LineEvent] | None:
    """What a capture holds of what would be found in it; None for one that holds none. Raises CaptureError."""
    return capture.stored_tables(session) if isinstance(capture, KeepsTables) else None
