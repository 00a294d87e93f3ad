"""The router: what one capture process sends of several buses, to the model of each."""

from __future__ import annotations

from collections import Counter, deque

from dissectors.frame import Chunk
from sniff.capture.ipc import Batch, Ended, HeardOctets, ReceivedMessage, Tick
from sniff.capture.link import CaptureLink
from sniff.engine.blocks import Block

HELD = 4 << 20
"""Octets kept for a bus that nobody asks for; more are dropped, and counted. The recording has them."""


class Router:
    """Shared by the models of one capture; whoever asks first receives for all. `dropped`: octets by bus."""

    def __init__(self, link: CaptureLink) -> None:
        self.link = link
        self.dropped: Counter[int] = Counter()
        self._queues: dict[int, deque[Batch]] = {}
        self._held: Counter[int] = Counter()
        self._has_ended = False

    def open(self, bus: int) -> None:
        """From now on somebody asks for this bus; what comes of others is nobody's."""
        self._queues.setdefault(bus, deque())

    def receive(self, bus: int, timeout: float = 0.0) -> list[Batch]:
        """What has come of a bus, in order; waits up to `timeout` seconds for something of any."""
        queue = self._queues[bus]
        for message in self.link.receive_batches(0.0 if queue else timeout):
            self._hand_on(message)
        given = list(queue)
        queue.clear()
        self._held[bus] = 0
        return given

    def insist(self) -> None:
        """After the capture was asked to stop: where it says nothing any more, or who else may receive of it has ended
        it, every bus is told that it has ended."""
        ended = self.link.insist() or self.link.ended
        if ended is not None and not self._has_ended:
            self._hand_on(ended)

    def _hand_on(self, message: Batch) -> None:
        if isinstance(message, Ended):
            self._has_ended = True
            for queue in self._queues.values():
                queue.append(message)
            return
        queue_of = self._queues.get(message.bus)
        if queue_of is None:
            return
        if isinstance(message, Tick) and queue_of and isinstance(queue_of[-1], Tick):
            queue_of[-1] = message  # the newer one says it all
            return
        octets = octets_of(message)
        if octets:
            if self._held[message.bus] + octets > HELD:
                self.dropped[message.bus] += octets
                return
            self._held[message.bus] += octets
        queue_of.append(message)


def octets_of(message: Batch) -> int:
    """How many octets of the line came with it."""
    came = reads_in(message)
    if came is None:
        return 0
    return len(came.octets) if isinstance(came, Chunk) else len(came.reads.octets)


def reads_in(message: Batch) -> Block | Chunk | None:
    """What it brings of the line; None where it says something else."""
    if isinstance(message, HeardOctets):
        return message.block
    return message.item if isinstance(message, ReceivedMessage) and isinstance(message.item, Chunk) else None
