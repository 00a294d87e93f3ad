"""The questions in BACnet requests: properties of objects; of other services the object, where they name one."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from dissectors.bacnet import message as messages
from dissectors.bacnet import names
from dissectors.bacnet.apdu import PduType
from dissectors.bacnet.frame_types import CARRIES_NPDU, HEADER
from dissectors.bacnet.npdu_columns import bodies
from dissectors.bacnet.readings import PRESENT_VALUE
from dissectors.bacnet.station_address import remote
from dissectors.bacnet.values import ConstructedValue, ObjectId
from dissectors.columns import FrameColumns, Octets
from dissectors.frame import Frame
from dissectors.questions import Question, Span, Stems

MOST_SPANS = 64
"""Properties of one request that are told."""

_CRC = 2
_INVOKE = 2  # octets of a confirmed request before its invoke id
_WRITES = frozenset((15, 16))
_OBJECTS = ("object-identifier", "monitored-object-identifier")
_LISTS = (
    ("list-of-read-access-specs", "list-of-property-references"),
    ("list-of-write-access-specs", "list-of-properties"),
)
_PLAIN_TYPES = np.array([kind in CARRIES_NPDU and kind < 32 for kind in range(256)])
"""Types of frames whose data stand as they are, not encoded."""


def question(frame: Frame) -> Question:
    """See `dissectors.questions.Questions`."""
    if not frame.ok or len(frame.octets) <= HEADER:
        return Question()
    message = messages.read(frame)
    if message is None:
        return Question()
    npdu = message.npdu
    behind = remote(npdu.dnet, npdu.dadr) if npdu is not None and npdu.dnet is not None else ""
    spoken = message.spoken()
    if spoken is None or spoken[0].type != PduType.CONFIRMED_REQUEST:
        return Question((), behind)
    decoded = messages.decode_parameters(*spoken)
    if decoded is None or decoded.error is not None:
        return Question((), behind)
    spans: list[Span] = []
    try:
        for span in _spans(decoded.record, spoken[0].service in _WRITES):
            spans.append(span)
            if len(spans) == MOST_SPANS:
                break
    except (KeyError, TypeError, ValueError, AttributeError):
        pass  # a parameter that is not there ends it
    return Question(tuple(spans), behind)


def stems(frames: FrameColumns, octets: Octets) -> Stems:
    """All of a frame but its checks and the invoke id of a confirmed request."""
    begin, length = frames.offset, frames.length.astype(np.int64)
    body, size = begin + HEADER, np.maximum(length - HEADER - _CRC, 0)
    plain = _PLAIN_TYPES[octets.take(begin + 2, mode="clip")] & (size > _INVOKE)
    control = octets.take(body + 1, mode="clip")
    at, cut = bodies(octets, body, size, control)
    confirmed = octets.take(body + at, mode="clip") >> 4 == PduType.CONFIRMED_REQUEST
    asks = plain & ~cut & confirmed & (at + _INVOKE < size)
    hole = np.where(asks, body + at + _INVOKE, -1)
    return Stems(begin, np.where(plain, body + size, begin + length), hole)


def _spans(record: ConstructedValue, writes: bool) -> Iterator[Span]:
    for outer, inner in _LISTS:
        if outer in record:
            for spec in record[outer]:
                for item in spec[inner]:
                    yield _span(spec["object-identifier"], item, writes)
            return
    for name in _OBJECTS:
        if name in record:
            yield _span(record[name], record, writes)
            return


def _span(thing: ObjectId, record: ConstructedValue, writes: bool) -> Span:
    which = record.get("property-identifier")
    part = "" if which is None or which.value == PRESENT_VALUE else str(which)
    index = record.get("property-array-index")
    if index is not None:
        part = f"{part or names.name('PropertyIdentifier', PRESENT_VALUE)}.{index}"
    return Span(thing.kind, thing.instance, 1, part, writes)
