"""Saving a capture into a file of any format: as it is, or frame by frame where the format keeps frames."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from dissectors import registry
from sniff import formats
from sniff.bus.packet_records import RecordMaker
from sniff.engine.capture import CaptureError, CaptureWriter
from sniff.engine.session import Item, Session
from sniff.formats import pcap, pcapng
from sniff.formats.linktypes import USERS, link_type_for
from sniff.formats.records import FrameFile


@dataclass(frozen=True, slots=True)
class PacketOptions:
    """What only packet files have. `link_type`: of their frames, None for the usual one. `microseconds`: .pcap: times
    as readers that know no nanoseconds want them. `notes`, `marks`: by row number, what is said in the comments of
    packets, where the format has such, and what a person wrote about them."""

    link_type: int | None = None
    microseconds: bool = False
    notes: Mapping[int, str] = field(default_factory=dict)
    marks: Mapping[int, str] = field(default_factory=dict)


PLAIN = PacketOptions()


def create(path: str | Path, session: Session, packets: PacketOptions = PLAIN) -> CaptureWriter:
    """Create a capture by its suffix. Raises CaptureError."""
    if formats.keeps_frames(path):
        link_type = _link_type(path, session, packets.link_type)
        file = (
            pcap.create(Path(path), session, link_type, microseconds=True)
            if packets.microseconds
            else formats.create_of_frames(path, session, link_type)
        )
        maker = RecordMaker(session, link_type, notes=packets.notes, marks=packets.marks)
        return FrameWriter(file, maker, _not_dissected(session.protocol, link_type))
    if packets.link_type is not None:
        raise CaptureError(f"{path}: this format has no link type; .pcap and .pcapng have")
    return formats.create_of_items(path, session)


def live_pcapng(path: str | Path, session: Session) -> FrameWriter:
    """A pcapng file, whatever its suffix, for somebody who reads while we write: each frame at once, pushed through.
    Raises CaptureError."""
    link_type = _link_type(path, session, None)
    return FrameWriter(pcapng.create(Path(path), session, link_type, live=True), RecordMaker(session, link_type, True))


def _link_type(path: str | Path, session: Session, wanted: int | None) -> int:
    try:
        return link_type_for(session.protocol, wanted)
    except ValueError as error:
        raise CaptureError(f"{path}: {error}") from None


def _not_dissected(protocol: str, link_type: int) -> str:
    """That Wireshark shows octets only, where it has no dissector that could be named for such frames."""
    dissector = registry.get(protocol)
    if (
        link_type not in USERS
        or dissector.packet_file is None
        or not set(dissector.packet_file.link_types) <= set(USERS)
    ):
        return ""
    return f"Wireshark has no dissector for {dissector.title}: it shows the octets of link type {link_type} (user 0)"


class FrameWriter:
    """A CaptureWriter of a packet file: items through the engine, each frame a record."""

    def __init__(self, file: FrameFile, maker: RecordMaker, remark: str = "") -> None:
        """`remark`: what else whoever opens the file must know."""
        self._file = file
        self._maker = maker
        self._remarks = [remark] if remark else []

    @property
    def losses(self) -> list[str]:
        """What the format could not keep, in words; complete after `close`."""
        return self._file.losses + self._remarks

    def write(self, item: Item) -> None:
        """Add a chunk or line event."""
        self._file.put(self._maker.add(item))

    def advance(self, now: int) -> None:
        """Say that no read returned up to `now` (ns)."""
        self._file.put(self._maker.advance(now))

    def close(self) -> None:
        """Write what is held and finish the file."""
        self._file.put(self._maker.close())
        self._file.close()

    def __enter__(self) -> FrameWriter:
        return self

    def __exit__(self, *exc: object) -> None:
        if exc and exc[0] is not None:
            self._file.discard()
        else:
            self.close()
