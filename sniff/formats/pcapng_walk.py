"""A pcapng file's packets found many at a time.

Every word of a window may begin a packet; that it does is proved from where a block begins, each block saying where the
next one is. What is no packet is given by itself.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from sniff.formats.packet_columns import WINDOW, heads_at

if TYPE_CHECKING:
    import numpy.typing as npt

    from dissectors.columns import Times

SECTION, PACKET = 0x0A0D0D0A, 6
MAGIC = 0x1A2B3C4D
HEADER = 28
TRAILER = 4


@dataclass(frozen=True, slots=True)
class PlainPackets:
    """Enhanced packet blocks that follow one another, with no comment that matters.

    `begins`: of each in `window`. `heads`: words of each: kind, size, interface, time (high, low), length kept, length
    on the wire.
    """

    order: str
    window: bytes
    begins: Times
    heads: npt.NDArray[np.uint32]

    def __len__(self) -> int:
        return len(self.begins)

    def body(self, index: int) -> bytes:
        """Content of a block."""
        begin = int(self.begins[index])
        return self.window[begin + 8 : begin + int(self.heads[index, 1]) - TRAILER]


@dataclass(frozen=True, slots=True)
class OtherBlock:
    """Any other block."""

    order: str
    kind: int
    body: bytes


class PcapngWalk:
    """The whole blocks of a stream from its begin, up to a section in another byte order.

    `longest`: octets of a block that is no damage. `telling`: what a comment holds that matters. `at`: octet of the
    file behind the blocks that were given, `order` of octets there.
    """

    def __init__(self, stream: BinaryIO, longest: int, telling: bytes) -> None:
        self.at = stream.tell()
        self.order = "<"
        self._stream = stream
        self._longest = longest
        self._telling = telling
        self._wanted = WINDOW
        self._is_mixed = False

    def blocks(self) -> Iterator[PlainPackets | OtherBlock]:
        """The blocks up to the first that is cut or damaged, or the end, or a section in another order."""
        held = b""
        while True:
            block = self._stream.read(self._wanted - len(held))
            held += block
            self._wanted = WINDOW
            before = self.at
            yield from self._window(held)
            passed = self.at - before
            if self._is_mixed or (not passed and not block):
                return
            held = held[passed:]
            self._wanted = max(self._wanted, len(held))

    def _window(self, window: bytes) -> Iterator[PlainPackets | OtherBlock]:
        """The whole blocks in a window that begins with one; none behind the head of a section in another order."""
        begins, ends = self._guess(window)
        lasts = np.flatnonzero(np.append(ends[:-1] != begins[1:], True)) if len(begins) else begins
        base, at = self.at, 0
        while at <= len(window) - 12:
            first = int(np.searchsorted(begins, at))
            if first < len(begins) and begins[first] == at:
                last = int(lasts[np.searchsorted(lasts, first)])
                at = int(ends[last])
                is_cut = at > len(window)
                if is_cut:
                    at = int(begins[last])
                    self._wanted = max(WINDOW, int(ends[last]) - at)
                    last -= 1
                self.at = base + at
                if last >= first:
                    some = begins[first : last + 1]
                    heads = heads_at(window, some, HEADER).view(f"{self.order}u4")
                    yield PlainPackets(self.order, window, some, heads)
                if is_cut:
                    return
                continue
            order = self.order
            kind, size = self._head(window, at)
            if size < 12 or size % 4 or size > self._longest:
                return
            if at + size > len(window):
                self._wanted = max(WINDOW, size)
                return
            self.at = base + at + size
            yield OtherBlock(self.order, kind, window[at + 8 : at + size - TRAILER])
            at += size
            if self.order != order:
                self._is_mixed = self.at > size
                return

    def _head(self, window: bytes, at: int) -> tuple[int, int]:
        """Kind and size of a block; that of a section tells the order. Size 0 where that is damaged."""
        kind, size = struct.unpack_from(self.order + "II", window, at)
        if window[at : at + 4] == SECTION.to_bytes(4, "little"):
            for order in "<>":
                if struct.unpack_from(order + "I", window, at + 8)[0] == MAGIC:
                    self.order = order
                    return SECTION, struct.unpack_from(order + "I", window, at + 4)[0]
            return SECTION, 0
        return kind, size

    def _guess(self, window: bytes) -> tuple[Times, Times]:
        """Where packets may begin in a window, and where they would end; those with options only where none matters."""
        words = np.frombuffer(window, f"{self.order}u4", len(window) // 4)
        places = np.flatnonzero(words[: max(0, len(words) - HEADER // 4 + 1)] == PACKET)
        sizes, kept = words[places + 1].astype(np.int64), words[places + 5].astype(np.int64)
        spare = sizes - (HEADER + TRAILER) - kept
        may = (sizes % 4 == 0) & (sizes <= self._longest) & (spare >= 0)
        if self._telling in window:
            may &= spare < 4
        begins = places[may] * 4
        return begins, begins + sizes[may]
