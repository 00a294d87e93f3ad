"""Raw dumps: octets as they were heard and nothing else (`cat /dev/ttyUSB0 > x.bin`, a terminal program's log file).

They have no times: the octets are taken as back to back, in reads that each last no longer than the times may be wrong
by, so that silences say nothing, whatever the rate turns out to be, and frames are found by what is in them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from sniff.engine.capture import CaptureError
from sniff.engine.session import NO_TIMES, Completeness, Item, Session
from sniff.formats.contents import PUTTY
from sniff.formats.files import explain, open_capture
from sniff.formats.records import FOREIGN_LATENCY, foreign_session

if TYPE_CHECKING:
    from sniff.engine.blocks import Block

AT_ONCE = 1 << 16
MOST = 32
"""Octets of a read. At another rate than they are laid at there would be silence before long ones, or they would lie
over one another.
"""
_HEADING_MOST = 256


def read(path: Path) -> RawDump:
    """Open a raw dump. Raises CaptureError for an empty one."""
    return RawDump(path)


class RawDump:
    """A raw dump as a capture. `note`: what else there is to say of it."""

    def __init__(self, path: Path, note: str = "") -> None:
        self.path = path
        self._note = note
        with open_capture(path) as stream:
            start = stream.read(_HEADING_MOST)
        if not start:
            raise CaptureError(f"{path}: empty file")
        heading = PUTTY.match(start)
        self._begin = heading.end() if heading is not None else 0
        told = foreign_session(str(path), None, 0, "raw dump")
        self.session: Session = replace(told, adapter=replace(told.adapter, latency_from=NO_TIMES))

    def items(self) -> Iterator[Item]:
        """The octets in the order of the file, back to back. Raises CaptureError."""
        for block in self.blocks():
            yield from block.chunks()

    def blocks(self) -> Iterator[Block]:
        """The same as columns. Raises CaptureError."""
        import numpy as np

        from sniff.engine.blocks import Block, plain_reads

        time, char = 0, self.session.line.char
        size = max(1, min(MOST, FOREIGN_LATENCY // char))
        try:
            with open_capture(self.path) as stream:
                stream.seek(self._begin)
                while octets := stream.read(AT_ONCE // size * size):
                    ends = np.minimum(np.arange(size, len(octets) + size, size), len(octets))
                    lengths = np.diff(ends, prepend=0)
                    yield Block(plain_reads(np.frombuffer(octets, np.uint8), time + ends * char, lengths))
                    time += len(octets) * char
        except OSError as error:
            raise explain(self.path, error) from None

    def completeness(self) -> Completeness:
        """Always whole: such a file has no end mark."""
        return Completeness(True, f"complete (raw dump: octets without times{self._note})")
