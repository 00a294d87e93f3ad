"""A pcap file's records found many at a time.

Where a record may begin is guessed at all octets of a window at once (both lengths the same and under 64 KiB, the
seconds near those of the first record). The guess is proved: from a place where a record begins, the next one begins
where its length says, and so on. Where the next is no guess, that record is read by itself.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from sniff.formats.packet_columns import WINDOW, Packets, heads_at

if TYPE_CHECKING:
    from dissectors.columns import Times

HEADER = 16


class PcapWalk:
    """The whole records of a stream from where it stands. `order`: of octets, "<" or ">"; `tick`: ns; `longest`:
    octets of a record that is no damage. `at`: octet of the file behind the records that were given.
    """

    def __init__(self, stream: BinaryIO, order: str, tick: int, link_type: int, longest: int) -> None:
        self.at = stream.tell()
        self._stream = stream
        self._order, self._tick, self._link_type, self._longest = order, tick, link_type, longest

    def packets(self) -> Iterator[Packets]:
        """The records up to the first that is cut or damaged, or the end."""
        held = b""
        while block := self._stream.read(WINDOW - len(held)):
            held += block
            begins, end = self._begins(held)
            self.at += end
            if len(begins):
                heads = heads_at(held, begins, HEADER).view(f"{self._order}u4").astype(np.int64)
                times = heads[:, 0] * 1_000_000_000 + heads[:, 1] * self._tick
                yield Packets(held, begins + HEADER, heads[:, 2], times, self._link_type, heads[:, 3])
            held = held[end:]

    def _begins(self, window: bytes) -> tuple[Times, int]:
        """Where the whole records begin in a window that begins with one, and where the last of them ends."""
        guessed, ends = self._guess(window)
        # the last of each run in which every record ends where the next guess lies
        lasts = np.flatnonzero(np.append(ends[:-1] != guessed[1:], True)) if len(guessed) else guessed
        found: list[Times] = []
        at = end = 0
        while end <= len(window) - HEADER:
            at = end
            first = int(np.searchsorted(guessed, at))
            if first < len(guessed) and guessed[first] == at:
                last = int(lasts[np.searchsorted(lasts, first)])
                at, end = int(guessed[last]), int(ends[last])
                found.append(guessed[first : last + 1])
            else:
                kept = struct.unpack_from(self._order + "I", window, at + 8)[0]
                if kept > self._longest:
                    break
                end = at + HEADER + kept
                found.append(np.array([at], np.int64))
        if end > len(window):  # the last is not whole
            found[-1] = found[-1][:-1]
            end = at
        return (np.concatenate(found) if found else np.zeros(0, np.int64)), end

    def _guess(self, window: bytes) -> tuple[Times, Times]:
        """Where records may begin in a window, and where they would end."""
        many = len(window) - HEADER + 1
        if many <= 0:
            return np.zeros(0, np.int64), np.zeros(0, np.int64)
        octets = np.frombuffer(window, np.uint8)
        low, second, third, high = (0, 1, 2, 3) if self._order == "<" else (3, 2, 1, 0)
        may = octets[high : high + many] == octets[high]
        for field in (8, 12):
            for place in (third, high):
                may &= octets[field + place : field + place + many] == 0
        for place in (second, low):
            may &= octets[8 + place : 8 + place + many] == octets[12 + place : 12 + place + many]
        begins = np.flatnonzero(may)
        kept = octets[begins + 8 + low] + (octets[begins + 8 + second].astype(np.int64) << 8)
        return begins, begins + HEADER + kept
