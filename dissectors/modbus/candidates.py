"""Candidates: stretches of octets that may be RTU frames, each with the evidence that its octets give.

A function code predicts the length of its frame, as request and as response. Where the CRC is right at a predicted
length there is a candidate. Its `bits` say how unlikely chance is to make it; what stands round it (silence, other
frames, the open request) is weighed in best_split.py.
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from dissectors.checksums import crc16_modbus
from dissectors.modbus.functions import (
    BROADCAST,
    EXCEPTION_BIT,
    EXCEPTION_LENGTH,
    EXCEPTIONS,
    FUNCTIONS,
    ITEMS_ASKED,
    MAX_UNIT,
    VENDOR_EXCEPTIONS,
    is_open_length,
)
from dissectors.modbus.layout import MESSAGES
from dissectors.modbus.lengths import MAX_FRAME, MIN_FRAME, MORE, Octets, is_told_by_three
from dissectors.modbus.past import Past
from dissectors.modbus.ranges import AGREEMENTS

CRC_BITS: Final = 16
SHORT_FRAME: Final = -4
"""Frames of 4 and 5 octets say little beside their CRC, and random octets make more of them than of all others."""

VENDOR_CODE: Final = -2
UNKNOWN_CODE: Final = -4
HIGH_UNIT: Final = -4
"""Units above 247: the standard forbids them, drives use them; a gap or the open request makes up for it."""

ODD_BROADCAST: Final = -8
"""Unit 0 with anything but a write request."""

WHOLE_STRETCH: Final = 12
"""All octets between two silences with a good CRC, whatever their function: good with both gaps proved, only then."""

ANY_END: Final = CRC_BITS - 7
"""A good CRC that was looked for at every place behind a begin."""

ZERO_TAIL: Final = -8
"""A good frame and zeros after it is good again as a whole (the CRC is 0): where zeros stray, or are more than a CRC
has, the shorter reading wins (best_split.py)."""


class LengthGuess(NamedTuple):
    """A length that the first octets predict, and the directions that have it. MORE: not told yet."""

    length: int
    request: bool
    response: bool


class Candidate(NamedTuple):
    """A stretch with a good CRC. `start` counts from the first octet ever fed.

    `zeros`: how many zeros it ends with without which it would be a good frame of a predicted length too.
    """

    start: int
    length: int
    bits: int
    unit: int
    request: bool
    response: bool
    octets: bytes
    zeros: int = 0

    @property
    def end(self) -> int:
        return self.start + self.length


class Pending(NamedTuple):
    """A stretch that would be a frame if the octets to come make its CRC good.

    `start` as in Candidate. `bits`: what its octets and that CRC come to then (`octet_hope`).
    """

    start: int
    reading: LengthGuess
    bits: int


_NOTHING: Final = LengthGuess(-1, False, False)
_UNTOLD: Final = LengthGuess(MORE, True, True)
_EXCEPTION = (LengthGuess(EXCEPTION_LENGTH, False, True),)


_REQUESTS: Final = tuple(LengthGuess(length, True, False) for length in range(MAX_FRAME + 1))
_RESPONSES: Final = tuple(LengthGuess(length, False, True) for length in range(MAX_FRAME + 1))
_EITHER: Final = tuple((LengthGuess(length, True, True),) for length in range(MAX_FRAME + 1))


def readings(octets: Octets, start: int, end: int) -> tuple[LengthGuess, ...]:
    """The predicted lengths of a frame that begins at `start`, shorter first; looks at [start, end) only."""
    if end - start < 3:
        return _readings(octets, start, end) if end - start == 2 else ()
    code = octets[start + 1]
    if code not in _TOLD_BY_THREE:
        return _readings(octets, start, end)
    key = code << 8 | octets[start + 2]
    told = _told.get(key)
    if told is None:
        told = _told[key] = _readings(octets, start, end)
    return told


_TOLD_BY_THREE: Final = {code | EXCEPTION_BIT for code in FUNCTIONS} | {
    code
    for code, messages in MESSAGES.items()
    if is_told_by_three(messages.request) and is_told_by_three(messages.response)
}
_told: Final[dict[int, tuple[LengthGuess, ...]]] = {}
"""By function and the octet behind it: no more than 256 of each."""


def _readings(octets: Octets, start: int, end: int) -> tuple[LengthGuess, ...]:
    code = octets[start + 1]
    function = FUNCTIONS.get(code & ~EXCEPTION_BIT)
    if function is None:
        return ()
    if code & EXCEPTION_BIT:
        return _EXCEPTION
    asked = function.request.length(octets, start, end)
    answered = function.response.length(octets, start, end)
    if asked == answered:
        return _EITHER[asked] if asked >= MORE else ()
    if answered < MORE:
        return (_REQUESTS[asked],)
    if asked < MORE:
        return (_RESPONSES[answered],)
    if asked < answered:
        return _REQUESTS[asked], _RESPONSES[answered]
    return _RESPONSES[answered], _REQUESTS[asked]


def octet_bits(octets: Octets, start: int, reading: LengthGuess) -> int:
    """Evidence in a complete frame's octets beside the CRC: its shape, its address, its length."""
    unit, code = octets[start], octets[start + 1]
    function = FUNCTIONS[code & ~EXCEPTION_BIT]
    if code & EXCEPTION_BIT:
        bits = exception_bits(octets[start + 2])
        if unit == BROADCAST:
            bits += ODD_BROADCAST
    else:
        length = reading.length
        bits = -100
        if reading.request:
            bits = function.request.shape(octets, start, length)
            if unit == BROADCAST and not function.writes:
                bits += ODD_BROADCAST
        if reading.response:
            answer = function.response.shape(octets, start, length)
            if unit == BROADCAST:
                answer += ODD_BROADCAST
            if answer > bits:
                bits = answer
        if length <= EXCEPTION_LENGTH:
            bits += SHORT_FRAME
    return bits + HIGH_UNIT if unit > MAX_UNIT else bits


def octet_hope(octets: Octets, start: int, reading: LengthGuess) -> int:
    """The same for a frame that is not complete: what its octets may still come to."""
    unit, code = octets[start], octets[start + 1]
    function = FUNCTIONS[code & ~EXCEPTION_BIT]
    if code & EXCEPTION_BIT:
        bits = SHORT_FRAME
    elif reading.length > 8 and code in _TOLD_EARLY:
        bits = octet_bits(octets, start, reading)
    else:
        bits = _HOPED_SHAPE
    if unit == BROADCAST and not (reading.request and function.writes):
        bits += ODD_BROADCAST
    return bits + HIGH_UNIT if unit > MAX_UNIT else bits


_HOPED_SHAPE: Final = 4
_TOLD_EARLY: Final = frozenset((*ITEMS_ASKED, *AGREEMENTS))
"""Functions whose shape is told by the octets that tell their length."""


def exception_bits(code: int) -> int:
    """Evidence in a frame of 5 octets with an exception code."""
    if code in EXCEPTIONS:
        return SHORT_FRAME
    return SHORT_FRAME + (VENDOR_CODE if code in VENDOR_EXCEPTIONS else UNKNOWN_CODE)


def candidate(stretch: bytes, reading: LengthGuess, start: int) -> Candidate:
    """The candidate that a stretch with a good CRC is, read in that way."""
    bits = CRC_BITS + octet_bits(stretch, 0, reading)
    zeros = 0 if stretch[-1] else zeros_follow_good(stretch)
    return Candidate(start, reading.length, bits, stretch[0], reading.request, reading.response, stretch, zeros)


def begins_good(octets: Octets, start: int, end: int) -> bool:
    """Whether a good frame of a predicted length begins at `start` and is over before `end`."""
    return any(
        MORE < length < end - start and not crc16_modbus(bytes(octets[start : start + length]))
        for length, _, _ in readings(octets, start, end)
    )


def zeros_follow_good(stretch: bytes) -> int:
    """Of a stretch with a good CRC that is a shorter good frame and zeros: how many zeros; else 0."""
    count = len(stretch)
    least = max(len(stretch.rstrip(b"\0")), MIN_FRAME)
    for length, _, _ in readings(stretch, 0, count):
        if least <= length < count and not crc16_modbus(stretch[:length]):
            return count - length
    return 0


def lacks_zeros(stretch: bytes) -> bool:
    """Whether a stretch with a good CRC may be a frame that lacks the zeros which its CRC ends with.

    One frame in 256 ends with a zero, and is good without it.
    """
    lengths = [reading.length for reading in readings(stretch, 0, len(stretch))]
    return len(stretch) not in lengths and any(n - len(stretch) in (1, 2) for n in lengths)


def whole_stretch(
    octets: Octets, at: int, end: int, start: int, past: Past, awaited: bool, heard: bool
) -> Candidate | None:
    """All of [at, end) as one frame; None when its CRC is wrong or it is no frame.

    Only for stretches with silence (or a good frame before, silence after) at both ends. Where nothing predicts the
    length, up to two zeros at the end are the frame's, unless frames of that kind were shorter before or zeros tend
    to follow frames here; else they are left off. Text is refused: it is another protocol's.
    `awaited`: the open request is for this station and function. `heard`: good frames named the station.
    """
    length = end - at
    if not MIN_FRAME <= length <= MAX_FRAME:
        return None
    stretch = bytes(octets[at:end])
    if crc16_modbus(stretch):
        return None
    if not stretch[-1]:
        stretch = without_zeros(stretch, past, awaited)
    code = stretch[1]
    if code & ~EXCEPTION_BIT not in FUNCTIONS:
        if code & EXCEPTION_BIT and len(stretch) != EXCEPTION_LENGTH:
            return None
        if not awaited and not heard and is_text(stretch):
            return None
    either = is_open_length(stretch)
    answers = either or bool(code & EXCEPTION_BIT and code ^ EXCEPTION_BIT not in FUNCTIONS)
    return Candidate(start, len(stretch), WHOLE_STRETCH, stretch[0], either, answers, stretch)


def is_text(octets: bytes) -> bool:
    """Whether octets look like a line of text, or some of it: another protocol's."""
    return _TEXT.fullmatch(octets) is not None


def without_zeros(stretch: bytes, past: Past, answer: bool) -> bytes:
    """A good frame of unpredicted length, less the zeros at its end that are not its own."""
    bare = stretch
    while len(bare) > MIN_FRAME and not bare[-1] and not crc16_modbus(bare[:-1]):
        bare = bare[:-1]
    if stretch[1] & EXCEPTION_BIT:
        return stretch[: max(EXCEPTION_LENGTH, len(bare))]
    if len(bare) == len(stretch) or not is_open_length(stretch):
        return bare
    always = past.only_length(stretch[0], stretch[1], answer)
    if always is not None and len(bare) <= always <= len(stretch):
        return stretch[:always]
    return bare if len(stretch) - len(bare) > _CRC_OCTETS or past.zeros_stray else stretch


_CRC_OCTETS = 2
_TEXT = re.compile(rb"[\x20-\x7e\r\n]*[\r\n]|[\x20-\x7e\r\n]{7,}")
_HEADS = re.compile(
    b"(?=.[%s])" % b"".join(re.escape(bytes((code, code | EXCEPTION_BIT))) for code in FUNCTIONS), re.DOTALL
)


class CandidateFinder:
    """Finds every candidate of a growing window, looking at each octet once.

    Positions count from the first octet ever fed, so that nothing moves when octets are taken from the front.
    `good`: the candidates found, of those that the window still holds.
    """

    __slots__ = ("_base", "_scanned", "_unread", "_waiting", "good")

    def __init__(self) -> None:
        self.good: list[Candidate] = []
        self._base = 0  # position of the window's first octet
        self._scanned = 0
        self._unread: list[Pending] = []  # heads that need more octets to tell a length, and what they told so far
        self._waiting: list[Pending] = []

    def look(self, octets: Octets, base: int, end: int) -> None:
        """Take notice of a window that begins at position `base`, up to index `end`. Neither limit ever falls back."""
        if base > self._base:
            self._drop(base)
        known = bytes(octets[:end])
        waiting, self._waiting = self._waiting, []
        for pending in waiting:
            self._weigh(known, pending)
        unread, self._unread = self._unread, []
        for start, told, _ in unread:
            self._read_on(known, start, told)
        scan = max(self._scanned, base)
        if base + end - 2 > scan:  # a head is read when its third octet is there: then most lengths are told
            for match in _HEADS.finditer(known, scan - base, end - 1):
                at = match.start()
                found = readings(known, at, end)
                if found and found[0].length == MORE:
                    self._read_on(known, base + at, _NOTHING)
                    continue
                for reading in found:
                    length = reading.length
                    if at + length > end:
                        self._waiting.append(_pending(known, at, base + at, reading))
                    elif not crc16_modbus(known[at : at + length]):
                        self.good.append(candidate(known[at : at + length], reading, base + at))
            self._scanned = base + end - 2

    def pending(self) -> list[Pending]:
        """What is not complete yet; length MORE where the octets do not tell it yet."""
        return self._waiting + [Pending(start, _UNTOLD, bits) for start, _, bits in self._unread]

    def _drop(self, base: int) -> None:
        self._base = base
        self.good = [c for c in self.good if c.start >= base]
        self._waiting = [p for p in self._waiting if p.start >= base]
        self._unread = [p for p in self._unread if p.start >= base]

    def _weigh(self, known: bytes, pending: Pending) -> None:
        """A stretch that is a candidate when it is complete and its CRC is right."""
        start, reading, _ = pending
        at = start - self._base
        if at + reading.length > len(known):
            self._waiting.append(pending)
            return
        stretch = known[at : at + reading.length]
        if not crc16_modbus(stretch):
            self.good.append(candidate(stretch, reading, start))

    def _read_on(self, known: bytes, start: int, told: LengthGuess) -> None:
        """A head some of whose octets were not there when it was read: only what is new in it counts."""
        more, at = False, start - self._base
        for reading in readings(known, at, len(known)):
            if reading.length == MORE:
                more = True
            elif reading.length != told.length:
                self._weigh(known, _pending(known, at, start, reading))
                told = reading
            elif reading != told:
                other = LengthGuess(reading.length, not told.request, not told.response)
                self._weigh(known, _pending(known, at, start, other))
        if more:
            self._unread.append(_pending(known, at, start, _UNTOLD)._replace(reading=told))


def _pending(octets: Octets, at: int, start: int, reading: LengthGuess) -> Pending:
    return Pending(start, reading, CRC_BITS + octet_hope(octets, at, reading))
