"""One direction of a TCP connection put in order: what came twice once, what came early in its place. Pure, bounded."""

from __future__ import annotations

from collections.abc import Iterator

from sniff.formats.network import Segment

MOST_EARLY = 64
"""Segments that wait for one that is missing; then it is given up."""
FARTHEST = 1 << 24
"""Octets from what was given to a segment of the same connection, more than any window of a gateway; what lies farther
is of another one, whose begin was not captured."""
_HALF = 1 << 31


def ahead_of(sequence: int, other: int) -> int:
    """Octets from `other` to `sequence`, which wrap around; negative: before it."""
    return (sequence - other + _HALF) % (2 * _HALF) - _HALF


class TcpStream:
    """Fed segments as they were captured, gives payloads in order; a number stands for so many octets that are lost, -1
    for nobody knows how many."""

    def __init__(self) -> None:
        self._next: int | None = None
        self._early: dict[int, bytes] = {}

    def add(self, segment: Segment) -> Iterator[bytes | int]:
        """Take the next segment that was captured."""
        sequence = segment.sequence or 0
        if segment.begins:
            self._next = (sequence + 1) & 0xFFFFFFFF
            self._early.clear()
            return
        if self._next is None:
            self._next = sequence
        elif abs(self._ahead(sequence)) > FARTHEST:
            yield from self.close()
            self._next = sequence
            yield -1
        yield from self._place(sequence, segment.payload, segment.lost)
        if len(self._early) > MOST_EARLY:
            yield from self.close()

    def is_ahead(self, sequence: int) -> bool:
        """Whether there are octets before that one which have not come in their turn."""
        return self._next is not None and self._ahead(sequence) > 0

    def close(self) -> Iterator[bytes | int]:
        """What waits in vain."""
        while self._early and self._next is not None:
            first = min(self._early, key=self._ahead)
            missing = self._ahead(first)
            if missing > 0:
                yield missing
                self._next = first
            yield from self._place(first, self._early.pop(first), 0)

    def _place(self, sequence: int, payload: bytes, lost: int) -> Iterator[bytes | int]:
        ahead = self._ahead(sequence)
        if ahead > 0:
            if payload:
                self._early.setdefault(sequence, payload)
            return
        fresh = payload[-ahead:]
        if fresh or lost:
            yield from self._give(fresh, lost if len(payload) >= -ahead else 0)
        while (early := self._following()) is not None:
            yield from self._give(early, 0)

    def _give(self, octets: bytes, lost: int) -> Iterator[bytes | int]:
        assert self._next is not None
        self._next = (self._next + len(octets) + lost) & 0xFFFFFFFF
        if octets:
            yield octets
        if lost:
            yield lost

    def _following(self) -> bytes | None:
        """What waits and has its turn now."""
        for sequence in list(self._early):
            ahead = self._ahead(sequence)
            if ahead <= 0:
                fresh = self._early.pop(sequence)[-ahead:]
                if fresh:
                    return fresh
        return None

    def _ahead(self, sequence: int) -> int:
        """Octets between what was given and that; negative: given before."""
        assert self._next is not None
        return ahead_of(sequence, self._next)
