"""Segments gathered into one message (ANSI/ASHRAE 135, 5.2 and 20.1.2.4): pure, bounded, in whatever order they come.

Every segment repeats the APDU's header; what follows the service choice is joined in the order of the sequence numbers,
which count modulo 256. A segment that was never seen leaves its message incomplete: the pieces stay as they are.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field, replace

from dissectors.bacnet import codec
from dissectors.bacnet import message as messages
from dissectors.bacnet.apdu import MORE_FOLLOWS, SEGMENTED, Apdu
from dissectors.bacnet.exchange import Key, read
from dissectors.frame import Frame

OPEN_MAX = 32
"""Messages that are gathered at the same time; the one longest untouched is given up."""

SEGMENTS_MAX = 1024


@dataclass(frozen=True, slots=True)
class Gathered:
    """A message made of segments.

    `apdu`: the header of its first segment, as if it were whole. `parameters`: all octets after it, in order (with
    holes left out when not complete). `frames`: numbers of the frames. `missing`: positions of lost segments.
    """

    key: Key
    apdu: Apdu
    parameters: bytes
    frames: tuple[int, ...]
    missing: tuple[int, ...] = ()

    @property
    def complete(self) -> bool:
        """Whether no segment is missing."""
        return not self.missing

    def decode(self) -> codec.Decoded | None:
        """The parameters of the whole message; None while it is not complete."""
        return messages.decode_parameters(self.apdu, self.parameters) if self.complete else None


@dataclass(slots=True)
class _Open:
    first: Apdu
    pieces: dict[int, bytes] = field(default_factory=dict)
    frames: list[int] = field(default_factory=list)
    newest: int = 0
    last: int | None = None  # position of the segment after which none follows


class Reassembler:
    """Takes every frame of a bus; gives a message when its last segment is there."""

    def __init__(self) -> None:
        self._open: OrderedDict[tuple[Key, int], _Open] = OrderedDict()

    def add(self, no: int, frame: Frame) -> Gathered | None:
        """Take the next frame; give the message that it completes, or ends with holes. Total."""
        message, key = read(frame)
        apdu = message.apdu if message is not None else None
        if message is None or key is None or apdu is None or not apdu.segmented or apdu.sequence is None:
            return None
        place = (key, apdu.type)
        gathering = self._open.get(place)
        anew = gathering is not None and apdu.sequence == 0 and gathering.newest < 128
        if gathering is None or (
            anew and gathering.pieces.get(0) != message.parameters
        ):  # not a repeat: another message
            gathering = self._open[place] = _Open(apdu)
        self._open.move_to_end(place)
        while len(self._open) > OPEN_MAX:
            self._open.popitem(last=False)
        step = (apdu.sequence - gathering.newest) & 0xFF
        position = gathering.newest + (step if step < 128 else step - 256)
        if position < 0 or position >= SEGMENTS_MAX:
            return None
        gathering.newest = max(gathering.newest, position)
        gathering.pieces.setdefault(position, message.parameters)
        gathering.frames.append(no)
        if not apdu.more_follows:
            gathering.last = position
        if gathering.last is None or (apdu.more_follows and len(gathering.pieces) <= gathering.last):
            return None
        missing = tuple(n for n in range(gathering.last + 1) if n not in gathering.pieces)
        if not missing:
            del self._open[place]
        flags = gathering.first.flags & ~(SEGMENTED | MORE_FOLLOWS)
        header = replace(gathering.first, flags=flags, sequence=None, window=None)
        joined = b"".join(gathering.pieces[n] for n in sorted(gathering.pieces))
        return Gathered(key, header, joined, tuple(gathering.frames), missing)
