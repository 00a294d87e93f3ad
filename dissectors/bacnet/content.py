"""Oddities in the content of good frames: reply bits, dates that are none, values of another type, parameters that do
not fit their service. Pure, total.

Whether a reply is expected is said twice: by the frame type (5, 32: the receiver answers at once; ANSI/ASHRAE 135, 9.3)
and by bit 2 of the network header (6.2.2, which a router makes the frame type from). A confirmed request has both
(5.4.1), a request that is not confirmed neither. Answers are free: an answer to a frame that expects one is sent as
type 6 whatever its bit says, and segments of an answer ask for their acknowledgement.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
from typing import Any

from dissectors.bacnet import codec, services
from dissectors.bacnet import message as messages
from dissectors.bacnet import npdu as npdus
from dissectors.bacnet import tags as tagging
from dissectors.bacnet.apdu import Apdu, PduType
from dissectors.bacnet.dates import Date, Time
from dissectors.bacnet.frame_types import EXPECTING
from dissectors.bacnet.limits import BROADCAST
from dissectors.bacnet.message import Message
from dissectors.bacnet.npdu import Npdu
from dissectors.bacnet.tags import Tag
from dissectors.bacnet.values import APPLICATION, NUMBER_OF, ConstructedValue, is_misnamed, primitive, text
from dissectors.frame import Frame


class ReplyFlaw(Enum):
    """How frame type, reply bit and the kind of message contradict each other; the value is what the list says."""

    CONFIRMED_WITHOUT = "confirmed, no reply expected"
    TYPE_WITHOUT = "reply bit, but no reply by frame type"
    BIT_WITHOUT = "reply by frame type, but no reply bit"
    UNCONFIRMED_WITH = "unconfirmed, reply expected"

    @property
    def words(self) -> str:
        """What is wrong, in a sentence that needs no context."""
        return _WORDS[self]


_WORDS = {
    ReplyFlaw.CONFIRMED_WITHOUT: "a confirmed request that expects no reply: it cannot be answered at once",
    ReplyFlaw.TYPE_WITHOUT: "the reply bit is set, the frame type expects no reply",
    ReplyFlaw.BIT_WITHOUT: "the frame type expects a reply, the reply bit is clear",
    ReplyFlaw.UNCONFIRMED_WITH: "expects a reply, but nobody answers an unconfirmed request",
}


class Odd(Enum):
    """What kind of thing is odd."""

    REPLY = "reply"
    DATE = "date"
    TYPE = "type"
    FORM = "form"


@dataclass(frozen=True, slots=True)
class Oddity:
    """One thing that cannot be right, in words that need no context."""

    kind: Odd
    words: str


def reply_flaw(message: Message) -> ReplyFlaw | None:
    """What is wrong with the reply bits of a frame; None where nothing is, or where anything may be right."""
    npdu, apdu = message.npdu, message.apdu
    if npdu is None or npdu.error is not None:
        return None
    expecting = message.frame_type in EXPECTING
    bit = bool(npdu.control & npdus.EXPECTS_REPLY)
    if apdu is not None and apdu.error is None and not (apdu.segmented and apdu.sequence):
        if apdu.type == PduType.CONFIRMED_REQUEST and not expecting:
            return ReplyFlaw.TYPE_WITHOUT if bit else ReplyFlaw.CONFIRMED_WITHOUT
        if apdu.type == PduType.UNCONFIRMED_REQUEST and bit:
            if not expecting:
                return ReplyFlaw.TYPE_WITHOUT
            return ReplyFlaw.UNCONFIRMED_WITH if message.destination != BROADCAST else None  # MS304 says that
    return ReplyFlaw.BIT_WITHOUT if expecting and not bit and _is_known(npdu, apdu) else None


def _is_known(npdu: Npdu, apdu: Apdu | None) -> bool:
    return npdu.is_network_message or (apdu is not None and apdu.error is None)


def oddities(frame: Frame) -> tuple[Oddity, ...]:
    """All that is odd in a frame, each thing once. Total; nothing is said of damaged frames."""
    message = messages.read(frame) if frame.ok else None
    if message is None or message.npdu is None:
        return ()
    flaw = reply_flaw(message)
    found = (Oddity(Odd.REPLY, flaw.words),) if flaw is not None else ()
    spoken = message.spoken()
    if spoken is None:
        return found
    apdu, parameters = spoken
    if apdu.service is None or apdu.error is not None or (apdu.type, apdu.service) in _SAYS_NEITHER:
        return found
    return found + _in_parameters(apdu.type, apdu.service, parameters)


_SAYS_NEITHER = frozenset(
    {(PduType.CONFIRMED_REQUEST, 12), (PduType.CONFIRMED_REQUEST, 14)}
    | {(PduType.SIMPLE_ACK, service) for service in range(64)}
)
"""Messages that are not looked into: reads are most of all, and hold no date and no value."""


@lru_cache(maxsize=1024)
def _in_parameters(pdu_type: int, service: int, parameters: bytes) -> tuple[Oddity, ...]:
    layout = services.parameters(pdu_type, service)
    decoded = codec.decode(layout, parameters)
    found = [Oddity(Odd.TYPE, str(wrong)) for wrong in decoded.wrong]
    if layout is not None and decoded.error is not None:
        what = f"{services.service_name(pdu_type, service)} {_PDU_WORDS.get(pdu_type, '')}".strip()
        found.append(Oddity(Odd.FORM, f"{what}: {_misfit(pdu_type, decoded)}"))
    found += [Oddity(Odd.DATE, str(when)) for when in _whens(decoded.record, 0) if when.flaw is not None]
    for tag in decoded.rest:
        found += [Oddity(Odd.DATE, str(when)) for when in _whens(tag, 0) if when.flaw is not None]
    for tag in _misnamed(parameters):
        found.append(Oddity(Odd.FORM, f'text "{text(tag.octets)}" is no UTF-8, as it says'))
    return tuple(dict.fromkeys(found))


def _misnamed(parameters: bytes) -> Iterator[Tag]:
    """Texts of another character set than they say."""
    if parameters.isascii():
        return
    waiting = list(tagging.read(parameters).tags)
    while waiting:
        tag = waiting.pop(0)
        if tag.children is not None:
            waiting = [*tag.children, *waiting]
        elif not tag.context and tag.number == NUMBER_OF["CharacterString"] and is_misnamed(tag.octets):
            yield tag


_PDU_WORDS: dict[int, str] = {PduType.COMPLEX_ACK: "answer", PduType.ERROR: "error"}


def _misfit(pdu_type: int, decoded: codec.Decoded) -> str:
    """Why parameters do not fit, as one would say it to who wrote the sender."""
    inner = decoded.rest[0].children if len(decoded.rest) == 1 else None
    if pdu_type == PduType.ERROR and not len(tuple(decoded.record)) and inner is not None and len(inner) == 2:
        return f"class and code stand between tags {decoded.rest[0].number} that do not belong there"
    assert decoded.error is not None
    return decoded.error


def _whens(value: Any, depth: int) -> Iterator[Date | Time]:
    """All dates and times of day in a value."""
    if isinstance(value, (Date, Time)):
        yield value
    elif depth > 40:
        return
    elif isinstance(value, ConstructedValue):
        for _, entry in value:
            yield from _whens(entry, depth + 1)
    elif isinstance(value, (tuple, list)):
        for entry in value:
            yield from _whens(entry, depth + 1)
    elif isinstance(value, Tag):
        yield from _whens_of_tag(value, depth)


def _whens_of_tag(tag: Tag, depth: int) -> Iterator[Date | Time]:
    if tag.children is not None:
        for child in tag.children:
            yield from _whens(child, depth + 1)
    elif not tag.context and tag.number < len(APPLICATION) and APPLICATION[tag.number] in ("Date", "Time"):
        try:
            yield from _whens(primitive(APPLICATION[tag.number], tag.octets), depth)
        except ValueError:
            return
