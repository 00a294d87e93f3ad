"""One exchange that the tracker holds open, and what identifies it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from dissectors.bacnet import message as messages
from dissectors.bacnet.apdu import PduType
from dissectors.bacnet.frame_types import FrameType
from dissectors.bacnet.message import Message
from dissectors.frame import Frame
from dissectors.tracker import Interval, Transaction, Verdict

_TOKEN, _POLL, _TEST = (bytes((kind,)) for kind in (FrameType.TOKEN, FrameType.POLL_FOR_MASTER, FrameType.TEST_REQUEST))


class Party(NamedTuple):
    """Who speaks at one end: the MS/TP address, and behind a router the network and address there."""

    mac: int
    net: int | None = None
    address: bytes | None = None


class Key(NamedTuple):
    """What an answer repeats of its request."""

    client: Party
    server: Party
    invoke_id: int


@dataclass(slots=True)
class Exchange:
    """A request, a token or a poll on its way. Times in ns."""

    id: int
    no: int
    kind: str
    source: int
    destination: int
    start: int
    end: int  # of its request
    slack: int
    octets: bytes
    key: Key | None = None
    attempt: int = 1
    of: int | None = None
    postponed: bool = False
    damaged: bool = False  # the request came damaged; its header is whole
    response: int | None = None  # its first frame, while more segments follow
    latency: Interval | None = None
    last: int = 0  # end of the newest frame that belongs to it

    @property
    def is_token(self) -> bool:
        """Whether it only passes the token."""
        return self.octets[2:3] == _TOKEN and not self.damaged

    @property
    def may_be_silent(self) -> bool:
        """Whether no answer is no fault: the polled or tested address is free."""
        return self.octets[2:3] == _POLL or (self.octets[2:3] == _TEST and self.source == self.destination)

    def interval(self, answer: Frame) -> Interval:
        """From the end of the request to the begin of the answer, with what the adapter allows."""
        gap = max(0, answer.start - self.end)
        return Interval(gap, max(0, gap - answer.slack), gap + self.slack)

    def close(
        self,
        verdict: Verdict,
        *,
        response: int | None = None,
        end: int | None = None,
        latency: Interval | None = None,
        error: str | None = None,
    ) -> Transaction:
        """The transaction that it became."""
        return Transaction(
            id=self.id,
            station=self.destination,
            kind=self.kind,
            request=self.no,
            response=self.response if response is None else response,
            verdict=verdict,
            start=self.start,
            end=self.last if end is None else max(end, self.last),
            latency=self.latency if latency is None else latency,
            attempt=self.attempt,
            of=self.of,
            error=error,
        )


def read(frame: Frame) -> tuple[Message | None, Key | None]:
    """A frame's layers, and the key of the exchange that its APDU belongs to (None without an invoke id)."""
    message = messages.read(frame)
    if message is None or message.source is None or message.npdu is None or message.apdu is None:
        return message, None
    apdu, npdu = message.apdu, message.npdu
    if apdu.invoke_id is None:
        return message, None
    source = Party(message.source, npdu.snet, npdu.sadr)
    destination = Party(message.destination, npdu.dnet, npdu.dadr)
    if apdu.is_answer:
        return message, Key(destination, source, apdu.invoke_id)
    if apdu.type in (PduType.CONFIRMED_REQUEST, PduType.SEGMENT_ACK, PduType.ABORT):
        return message, Key(source, destination, apdu.invoke_id)
    return message, None
