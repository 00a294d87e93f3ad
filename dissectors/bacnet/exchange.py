"""Exchanges that the tracker holds open, and what identifies them."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from dissectors.bacnet import message as messages
from dissectors.bacnet.apdu import NEGATIVE_ACK, Apdu, PduType
from dissectors.bacnet.frame_types import FrameType
from dissectors.bacnet.message import Message
from dissectors.frame import Frame
from dissectors.tracker import Interval, Transaction, Verdict

_TOKEN, _POLL, _TEST = (bytes((kind,)) for kind in (FrameType.TOKEN, FrameType.POLL_FOR_MASTER, FrameType.TEST_REQUEST))


class Ending(StrEnum):
    """How an exchange without an answer ended, where that says more than its verdict."""

    NEVER_ANSWERED = "postponed, and never answered"


class RequestParty(NamedTuple):
    """Who speaks at one end: the MS/TP address, and behind a router the network and address there."""

    mac: int
    net: int | None = None
    address: bytes | None = None


class Key(NamedTuple):
    """What an answer repeats of its request."""

    client: RequestParty
    server: RequestParty
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
    spoilt: bool = False  # postponed, and what came from there since was damaged: perhaps the answer
    damaged: bool = False  # the request came damaged; its header is whole
    response: int | None = None  # its newest frame, while more segments follow
    latency: Interval | None = None
    last: int = 0  # end of the newest frame that belongs to it
    unconfirmed: bool = False  # nobody answers it, whatever its frame type says
    segmented: bool = False  # request or answer came in segments
    more_follows: bool = False  # of a request: its newest segment is not the last
    ends_with: int | None = None  # sequence number of the answer's last segment, once that was seen
    usurped: bool = False  # another station answered in its place: whether the one that was asked did, nobody knows
    becomes: Verdict | None = None  # of segments that answer what is closed, or nothing: the verdict at their end

    @property
    def is_token(self) -> bool:
        """Whether it only passes the token."""
        return self.octets[2:3] == _TOKEN and not self.damaged

    @property
    def may_be_silent(self) -> bool:
        """Whether no answer is no fault: the polled or tested address is free."""
        return self.octets[2:3] == _POLL or (self.octets[2:3] == _TEST and self.source == self.destination)

    @property
    def is_promised(self) -> bool:
        """Whether the station itself said that its answer comes later, and nothing damaged may have been it; a router
        says so for others."""
        return self.postponed and not self.spoilt and self.key is not None and self.key.server.net is None

    def interval(self, answer: Frame) -> Interval:
        """From the end of the request to the begin of the answer, with what the adapter allows."""
        gap = max(0, answer.start - self.end)
        return Interval(gap, max(0, gap - answer.slack), gap + self.slack)

    def goes_on(self, no: int, frame: Frame, apdu: Apdu | None, incomplete: bool) -> bool:
        """Take an answer, or an acknowledgement of either side; whether more must come before it is over.

        `incomplete`: segments before this one were not seen. They come again, or the last acknowledgement says that the
        other side has them.
        """
        if apdu is not None and apdu.type == PduType.SEGMENT_ACK:
            self.segmented = True
            refuses = bool(apdu.flags & NEGATIVE_ACK)
            return refuses or self.ends_with is None or self.ends_with != apdu.sequence
        if apdu is not None and not apdu.is_answer:
            return False
        if self.response is None:
            self.latency = self.interval(frame)
        self.response = no
        if apdu is None or not apdu.segmented:
            return False
        self.segmented = True
        if not apdu.more_follows:
            self.ends_with = apdu.sequence
        return apdu.more_follows or incomplete

    def stopped(self) -> Transaction:
        """What it became when nobody went on: without an answer, or, after the first segments of one, undecided.

        The station that answers is there; whose fault the end is cannot be told.
        """
        if self.becomes is not None:
            return self.close(self.becomes)
        if self.usurped:
            return self.close(Verdict.OPEN, error="another station answered")
        if self.response is None:
            return self.close(Verdict.NO_RESPONSE, error=Ending.NEVER_ANSWERED.value if self.is_promised else None)
        return self.close(Verdict.OPEN, error="its segments stopped before the last one")

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
            request=None if self.becomes is not None else self.no,
            response=self.response if response is None else response,
            verdict=verdict,
            start=self.start,
            end=self.last if end is None else max(end, self.last),
            latency=self.latency if latency is None else latency,
            attempt=self.attempt,
            of=self.of,
            error=error,
        )


def mirrored(key: Key) -> Key:
    """The key as it would be had the sender set the server flag of a SegmentACK or Abort the other way round."""
    return Key(key.server, key.client, key.invoke_id)


def trails(apdu: Apdu | None) -> bool:
    """Whether it can follow the last segment of an exchange and still belong to it: an acknowledgement, a segment
    sent again (but the first one with more to follow, which begins anew), an Abort."""
    if apdu is None:
        return False
    if apdu.type in (PduType.SEGMENT_ACK, PduType.ABORT):
        return True
    return apdu.segmented and (bool(apdu.sequence) or not apdu.more_follows)


def read(frame: Frame) -> tuple[Message | None, Key | None]:
    """A frame's layers, and the key of the exchange that its APDU belongs to (None without an invoke id)."""
    message = messages.read(frame)
    if message is None or message.source is None or message.npdu is None or message.apdu is None:
        return message, None
    apdu, npdu = message.apdu, message.npdu
    if apdu.invoke_id is None:
        return message, None
    source = RequestParty(message.source, npdu.snet, npdu.sadr)
    destination = RequestParty(message.destination, npdu.dnet, npdu.dadr)
    if apdu.is_answer:
        return message, Key(destination, source, apdu.invoke_id)
    if apdu.type in (PduType.CONFIRMED_REQUEST, PduType.SEGMENT_ACK, PduType.ABORT):
        return message, Key(source, destination, apdu.invoke_id)
    return message, None
