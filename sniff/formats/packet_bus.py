"""A bus whose octets lie in packets among other packets: of a network, or of USB."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from sniff.engine.session import Adapter, Completeness, Item, LineEvent, Session
from sniff.formats.records import PacketRecord, foreign_session
from sniff.formats.set_back_clock import steady

if TYPE_CHECKING:
    from sniff.engine.blocks import Block

Reader = Callable[[Iterator[PacketRecord]], Iterator[Item]]
"""Takes what belongs to a bus out of all records of a file."""


class RecordFile(Protocol):
    """A packet file whose records are read one after the other."""

    path: Path

    def records(self) -> Iterator[PacketRecord]:
        """All records, as far as the file is whole. Raises CaptureError."""
        ...

    def completeness(self) -> Completeness:
        """Whether it is whole, as far as it was read."""
        ...


class PacketBus:
    """What packets carry between some ends, as a bus. A `Capture`. `beside`: what else is in the file, once it is known
    to be whole.
    """

    def __init__(
        self, file: RecordFile, name: str, protocol: str, started: int, adapter: Adapter, reader: Reader, kind: str
    ) -> None:
        self.path = file.path
        self.beside = "complete"
        self._file = file
        self._reader = reader
        session = foreign_session(str(file.path), protocol, started, kind)
        self.session: Session = replace(session, bus=name, adapter=adapter)

    def items(self) -> Iterator[Item]:
        """What all ends said, in order of time. Raises CaptureError."""
        return steady(self._reader(self._file.records()), self.session.timing.char)

    def blocks(self) -> Iterator[Block | LineEvent]:
        """The same as columns. Raises CaptureError."""
        from sniff.engine.blocks import blocks_of

        return blocks_of(self.items())

    def completeness(self) -> Completeness:
        """Whether the file is whole, as far as it was read, and what else is in it."""
        complete = self._file.completeness()
        return Completeness(True, self.beside) if complete.whole else complete
