"""Segments gathered into one message (ANSI/ASHRAE 135, 5.2 and 20.1.2.4): pure, bounded, in whatever order they come.

Every segment repeats the APDU's header; what follows the service choice is joined in the order of the sequence numbers,
which count modulo 256. Messages are told apart by client, server (behind routers too), invoke id and direction:

    request                     client → server    begins the exchange: what was gathered of an older answer is over
    ComplexACK 0, more follow   server → client    ┐
    SegmentACK 0                client → server    │ not looked at: what counts is what was on the wire
    ComplexACK 1, more follow   server → client    │ windows, repeats, negative acknowledgements: each place keeps the
    ComplexACK 2, last          server → client    ┘ newest segment → the whole, kept with this frame
    Abort                       either             both directions are over

A segment that was never seen leaves its message incomplete, which is said at its last segment.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field

from dissectors.bacnet import apdu as apdus
from dissectors.bacnet.apdu import MORE_FOLLOWS, SEGMENTED, Apdu, PduType
from dissectors.bacnet.exchange import Key, read
from dissectors.bacnet.frame_types import CARRIES_NPDU, HEADER, is_encoded
from dissectors.bacnet.npdu import HAS_DESTINATION, HAS_SOURCE, NETWORK_MESSAGE
from dissectors.frame import Assembly, Check, Frame

OPEN_MAX = 32
"""Messages that are gathered at the same time; the one longest untouched is given up."""

SEGMENTS_MAX = 1024
OCTETS_MAX = 1 << 21
"""Octets that are held at the same time, of all messages."""

IDLE_MAX = 120_000_000_000
"""ns after which a further segment is one of another message: far beyond all retries of a segment."""

MISSING_TOLD = 16


@dataclass(slots=True)
class _Open:
    """A message under way, and for a while after its end: its last segment may come again."""

    first: Apdu
    touched: int  # ns, the newest segment
    pieces: dict[int, bytes] = field(default_factory=dict)
    frames: dict[int, int] = field(default_factory=dict)
    size: int = 0
    newest: int = 0
    last: int | None = None  # position of the segment after which none follows
    whole: Assembly | None = None

    def position(self, sequence: int) -> int:
        """Which segment that is, counted on from the newest."""
        step = (sequence - self.newest) & 0xFF
        return self.newest + (step if step < 128 else step - 256)

    def goes_on_with(self, apdu: Apdu, piece: bytes, now: int) -> bool:
        """Whether that is a further or repeated segment of this message."""
        if apdu.service != self.first.service or abs(now - self.touched) >= IDLE_MAX:
            return False
        if apdu.sequence == 0 and self.newest < 128:
            return self.pieces.get(0) == piece
        known = self.pieces.get(self.position(apdu.sequence or 0))
        return self.whole is None or known == piece


class Reassembler:
    """Takes every frame of one bus in order; says at the last segment of a message what it is as a whole."""

    def __init__(self) -> None:
        self._open: OrderedDict[tuple[Key, int], _Open] = OrderedDict()
        self._octets = 0

    @property
    def open_keys(self) -> tuple[Key, ...]:
        """The exchanges of which messages are gathered, or may come again."""
        return tuple({key for key, _ in self._open})

    def add(self, no: int, frame: Frame) -> Assembly | None:
        """Take the next frame; give the message that it completes, or ends with holes. Total."""
        first = _first_of_apdu(frame)
        if first is None or not (_is_segment(first) or (self._open and first >> 4 in _ENDS)):
            return None
        message, key = read(frame)
        apdu = message.apdu if message is not None else None
        if message is None or key is None or apdu is None or apdu.error is not None:
            return None
        if not apdu.segmented or apdu.sequence is None:
            self._end(key, apdu)
            return None
        if apdu.is_request and apdu.sequence == 0:
            self._drop((key, PduType.COMPLEX_ACK))
        return self._gather(no, frame.start, (key, apdu.type), apdu, message.parameters)

    def _end(self, key: Key, apdu: Apdu) -> None:
        """What an APDU that is no segment ends."""
        self._drop((key, PduType.COMPLEX_ACK))
        if apdu.type != PduType.CONFIRMED_REQUEST:
            self._drop((key, PduType.CONFIRMED_REQUEST))

    def _gather(self, no: int, now: int, place: tuple[Key, int], apdu: Apdu, piece: bytes) -> Assembly | None:
        known = self._open.get(place)
        if known is None or not known.goes_on_with(apdu, piece, now):
            self._drop(place)
            known = self._open[place] = _Open(apdu, now)
        self._open.move_to_end(place)
        known.touched = now
        position = known.position(apdu.sequence or 0)
        if not 0 <= position < SEGMENTS_MAX:
            return None
        known.newest = max(known.newest, position)
        grown = len(piece) - len(known.pieces.get(position, b""))
        known.pieces[position] = piece
        known.size += grown
        self._octets += grown
        if known.whole is None:
            known.frames[position] = no
        if not apdu.more_follows:
            known.last = position
        self._bound()
        return _said(known, position)

    def _drop(self, place: tuple[Key, int]) -> None:
        gone = self._open.pop(place, None)
        if gone is not None:
            self._octets -= gone.size

    def _bound(self) -> None:
        while len(self._open) > OPEN_MAX or self._octets > OCTETS_MAX:
            _, oldest = self._open.popitem(last=False)
            self._octets -= oldest.size


def _said(message: _Open, position: int) -> Assembly | None:
    """What to say at the segment that just came: the whole once it is there, holes at the last segment."""
    last = message.last
    if last is None or (position != last and len(message.pieces) <= last):
        return None
    if message.whole is not None:
        return message.whole if position == last else None
    missing = [place for place in range(last + 1) if place not in message.pieces]
    places = [place for place in range(last + 1) if place in message.pieces]
    frames = tuple(message.frames[place] for place in places)
    if missing:
        return Assembly(b"", frames, tuple(missing[:MISSING_TOLD])) if position == last else None
    message.whole = Assembly(_joined(message.first, b"".join(message.pieces[place] for place in places)), frames)
    return message.whole


def _joined(segment: Apdu, parameters: bytes) -> bytes:
    """The APDU as if it had come in one piece: the header of a segment without what belongs to the segment."""
    return apdus.encode(
        segment.type,
        parameters,
        invoke_id=segment.invoke_id or 0,
        service=segment.service or 0,
        flags=segment.flags & ~(SEGMENTED | MORE_FOLLOWS),
        max_segments=segment.max_segments or 0,
        max_apdu=segment.max_apdu or 0,
    )


_ENDS = frozenset((PduType.CONFIRMED_REQUEST, PduType.ABORT))
_ROUTED = NETWORK_MESSAGE | HAS_DESTINATION | HAS_SOURCE


def _is_segment(first: int) -> bool:
    return bool(first & SEGMENTED) and first >> 4 in (PduType.CONFIRMED_REQUEST, PduType.COMPLEX_ACK)


def _first_of_apdu(frame: Frame) -> int | None:
    """The first octet of a good frame's APDU, found without reading the layers where no router is named."""
    octets = frame.octets
    if len(octets) <= HEADER + 2 or octets[2] not in CARRIES_NPDU or frame.check is not Check.GOOD:
        return None
    if not is_encoded(octets[2]) and not octets[HEADER + 1] & _ROUTED:
        return octets[HEADER + 2]
    message, _ = read(frame)
    if message is None or message.npdu is None or message.apdu is None:
        return None
    return message.data[message.npdu.body]
