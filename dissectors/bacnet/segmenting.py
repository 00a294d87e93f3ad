"""Sending and acknowledging segments (ANSI/ASHRAE 135, 5.3 and 5.4), for simulated stations. Pure: APDUs in and out.

`Sender` cuts an answer that is too long; `Receiver` says when to acknowledge. The first segment goes alone, then as
many as the window allows; a negative acknowledgement sends everything after it again, and so does silence.
"""

from __future__ import annotations

from dataclasses import dataclass

from dissectors.bacnet import apdu as apdus
from dissectors.bacnet.apdu import MORE_FOLLOWS, NEGATIVE_ACK, SEGMENTED, Apdu, PduType

WINDOW = 4
"""Segments before an acknowledgement, as far as the receiver allows."""

HEADER = 5
"""Octets of a ComplexACK segment before its piece."""

SEGMENT_TIMEOUT = 2_000_000_000
RETRIES = 3


@dataclass(slots=True)
class SegmentSender:
    """An answer on its way. `first`: the earliest segment not acknowledged; `sent_at`: ns, None until it is known."""

    invoke_id: int
    service: int
    pieces: tuple[bytes, ...]
    first: int = 0
    window: int = 1
    sent_at: int | None = None
    retries: int = RETRIES

    @classmethod
    def of(cls, invoke_id: int, service: int, parameters: bytes, max_apdu: int) -> SegmentSender:
        """An answer cut so that each APDU fits."""
        size = max(1, max_apdu - HEADER)
        pieces = tuple(parameters[at : at + size] for at in range(0, len(parameters), size))
        return cls(invoke_id, service, pieces)

    @property
    def is_over(self) -> bool:
        """Whether all was acknowledged, or nobody acknowledges any more."""
        return self.first >= len(self.pieces) or self.retries < 0

    def window_of_segments(self) -> list[bytes]:
        """The APDUs that may go now."""
        self.sent_at = None
        last = len(self.pieces) - 1
        return [
            apdus.encode(
                PduType.COMPLEX_ACK,
                self.pieces[number],
                invoke_id=self.invoke_id,
                service=self.service,
                flags=SEGMENTED | (MORE_FOLLOWS if number < last else 0),
                sequence=number & 0xFF,
                window=WINDOW,
            )
            for number in range(self.first, min(self.first + self.window, last + 1))
        ]

    def take(self, acknowledgement: Apdu) -> list[bytes]:
        """Take a SegmentACK; give the APDUs that follow from it."""
        step = ((acknowledgement.sequence or 0) - self.first) & 0xFF
        refused = bool(acknowledgement.flags & NEGATIVE_ACK)
        if step >= self.window and not (refused and step == 0xFF):
            return []  # acknowledged before
        self.first += (step + 1) & 0xFF
        self.window = max(1, min(WINDOW, acknowledgement.window or 1))
        self.retries = RETRIES
        return [] if self.is_over else self.window_of_segments()

    def wake(self, now: int) -> list[bytes]:
        """What to send again at `now` because no acknowledgement came."""
        if self.sent_at is None:
            self.sent_at = now
        if now - self.sent_at < SEGMENT_TIMEOUT:
            return []
        self.retries -= 1
        return [] if self.is_over else self.window_of_segments()


@dataclass(slots=True)
class SegmentReceiver:
    """What one side has of a message in segments. `window`: what it allows."""

    window: int = 2
    next: int = 0
    since: int = 0  # segments since the last acknowledgement
    is_whole: bool = False  # the last segment came

    def take(self, segment: Apdu) -> bytes | None:
        """Take a segment; give the SegmentACK that it asks for."""
        sequence = segment.sequence or 0
        fits = sequence == self.next & 0xFF
        if fits:
            self.next += 1
            self.since += 1
            self.is_whole = not segment.more_follows
        elif (sequence - self.next) & 0xFF < 0x80:  # one before it is missing
            return self._acknowledge(segment, NEGATIVE_ACK)
        if fits and sequence and segment.more_follows and self.since < min(self.window, segment.window or 1):
            return None
        return self._acknowledge(segment, 0)

    def _acknowledge(self, segment: Apdu, flags: int) -> bytes:
        self.since = 0
        return apdus.encode(
            PduType.SEGMENT_ACK,
            invoke_id=segment.invoke_id or 0,
            sequence=(self.next - 1) & 0xFF,
            window=self.window,
            flags=flags,
        )
