"""Raw dumps: octets as they were heard and nothing else (`cat /dev/ttyUSB0 > x.bin`, a terminal program's log file).

They have no times: the octets are taken as back to back, one read of READ octets after the other, so that silences say
nothing and frames are found by what is in them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from dissectors.frame import Chunk
from sniff.engine.capture import CaptureError
from sniff.engine.session import NO_TIMES, Completeness, Item, LineEvent, Session
from sniff.formats.contents import PUTTY
from sniff.formats.files import explain, open_capture
from sniff.formats.records import foreign_session

if TYPE_CHECKING:
    from sniff.engine.blocks import Block

READ = 4096
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
        time = 0
        try:
            with open_capture(self.path) as stream:
                stream.seek(self._begin)
                while octets := stream.read(READ):
                    time += len(octets) * self.session.line.char
                    yield Chunk(time, octets)
        except OSError as error:
            raise explain(self.path, error) from None

    def blocks(self) -> Iterator[Block | LineEvent]:
        """The same as columns. Raises CaptureError."""
        from sniff.engine.blocks import blocks_of

        return blocks_of(self.items())

    def completeness(self) -> Completeness:
        """Always whole: such a file has no end mark."""
        return Completeness(True, f"complete (raw dump: octets without times{self._note})")
