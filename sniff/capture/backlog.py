"""Messages of the capture process that wait for a caller who is behind: bounded, and what was dropped is said."""

from __future__ import annotations

from collections import deque

from sniff.capture.ipc import IpcKind, MessageSplitter, encode_item, gap_event, octets_in

MOST_WAITING = 8 * 1024 * 1024
MESSAGE_COST = 100
"""Octets of messages that wait, with what each takes beside its body; reads beyond that are dropped and counted."""


class Backlog:
    """Messages in order: kind, bus, body. Nothing but reads is ever dropped; a gap event stands where they are missing.

    `dropped`: octets of each bus that were.
    """

    def __init__(self) -> None:
        self.dropped: dict[int, int] = {}
        self._messages: deque[tuple[int, int, bytes]] = deque()
        self._size = 0
        self._gap: dict[int, int] = {}  # bus → octets dropped since the last read that was kept

    def __bool__(self) -> bool:
        return bool(self._messages)

    def add(self, kind: int, bus: int, body: bytes) -> None:
        """Have a message wait. Once reads were dropped, others are until half of what may wait has been taken."""
        if kind in (IpcKind.CHUNK, IpcKind.READS):
            gap = self._gap.get(bus, 0)
            if self._size > (MOST_WAITING // 2 if gap else MOST_WAITING):
                octets = octets_in(kind, body)[1]
                self._gap[bus] = gap + octets
                self.dropped[bus] = self.dropped.get(bus, 0) + octets
                return
            if gap:
                self._gap[bus] = 0
                event = gap_event(octets_in(kind, body)[0], gap)
                for message in MessageSplitter().feed(encode_item(bus, event)):
                    self._add(message)
        self._add((kind, bus, body))

    def take(self) -> tuple[int, int, bytes]:
        """The message that has waited longest."""
        message = self._messages.popleft()
        self._size -= len(message[2]) + MESSAGE_COST
        return message

    def _add(self, message: tuple[int, int, bytes]) -> None:
        self._messages.append(message)
        self._size += len(message[2]) + MESSAGE_COST
