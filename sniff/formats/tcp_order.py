"""Both directions of a TCP connection in the order in which they were said. Pure, bounded.

Who captures two directions through two buffers may write an answer before what it answers. The answer acknowledges
octets then that nobody has seen: it waits for them, for as long as such buffers can be apart.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator

from sniff.formats.network import Address, Segment
from sniff.formats.tcp_stream import TcpStream, ahead_of

APART = 10_000_000
"""ns that a packet may have been written too early."""
MOST_WAITING = 64

Said = tuple[int, Address, bytes | int]
"""ns, who said it, octets; a number stands for so many that are lost, -1 for nobody knows how many."""


class TcpOrder:
    """Fed the segments of both directions as they were captured."""

    def __init__(self) -> None:
        self._streams: dict[Address, TcpStream] = {}
        self._waiting: deque[tuple[int, Segment]] = deque()

    def add(self, time: int, segment: Segment) -> Iterator[Said]:
        """Take the next segment that was captured; its time, or that of what it waited for."""
        while self._waiting and (time - self._waiting[0][0] > APART or len(self._waiting) >= MOST_WAITING):
            yield from self._say(*self._waiting.popleft())  # what it answers was not captured
        is_first = self._waits_for_first_of(segment.source)
        if is_first and ahead_of(self._waiting[0][1].acknowledged or 0, segment.sequence or 0) <= 0:
            while self._waiting:  # it was said behind all that waits
                yield from self._say(*self._waiting.popleft())
        elif not is_first and (self._is_early(segment) or self._waits(segment.source)):
            self._waiting.append((time, segment))
            return
        yield from self._say(time, segment)
        while self._waiting and not self._is_early(self._waiting[0][1]):
            yield from self._say(max(time, self._waiting[0][0]), self._waiting.popleft()[1])

    def close(self, time: int) -> Iterator[Said]:
        """What waits in vain."""
        while self._waiting:
            yield from self._say(*self._waiting.popleft())
        for source, stream in self._streams.items():
            for one in stream.close():
                yield time, source, one

    def _waits(self, source: Address) -> bool:
        return any(one.source == source for _, one in self._waiting)

    def _waits_for_first_of(self, source: Address) -> bool:
        """Whether nothing is known of a direction but what the other one, which waits, expects of it."""
        return bool(self._waiting) and self._waiting[0][1].source != source and source not in self._streams

    def _is_early(self, segment: Segment) -> bool:
        """Whether it acknowledges what has not come."""
        other = self._streams.get(segment.destination)
        if segment.acknowledged is None or segment.begins:
            return False
        return other is None or other.is_ahead(segment.acknowledged)

    def _say(self, time: int, segment: Segment) -> Iterator[Said]:
        for one in self._streams.setdefault(segment.source, TcpStream()).add(segment):
            yield time, segment.source, one
