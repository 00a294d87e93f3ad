"""A capture: what every file format gives and takes, and the error that says a file cannot be read or written."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from sniff.engine.capture_error import CaptureError as CaptureError
from sniff.engine.session import Completeness, Item, LineEvent, Session

if TYPE_CHECKING:
    from sniff.engine.blocks import Block


class Capture(Protocol):
    """A capture opened for reading."""

    session: Session

    def items(self) -> Iterator[Item]:
        """Chunks and line events in order of time. A cut file ends early, without an exception."""
        ...

    def blocks(self) -> Iterator[Block | LineEvent]:
        """The same as columns: what `blocks_of(self.items())` gives, but for where blocks are cut. Raises as `items`
        does, when all before was given; `completeness` says the same after it."""
        ...

    def completeness(self) -> Completeness:
        """Whether the file is whole (may need to have read it)."""
        ...


class CaptureWriter(Protocol):
    """A capture opened for writing; a context manager. Every item is kept, or the writer says what it cannot keep."""

    def write(self, item: Item) -> None:
        """Add a chunk or line event, in order of time."""
        ...

    def close(self) -> None:
        """Finish the file."""
        ...

    def __enter__(self) -> CaptureWriter: ...

    def __exit__(self, *exc: object) -> None: ...


@runtime_checkable
class BlockWriter(CaptureWriter, Protocol):
    """A capture opened for writing that takes many reads at once."""

    def write_block(self, block: Block) -> None:
        """Add reads, in order of time; the same as one after the other."""
        ...
