"""The past of a bus, as far as it helps to weigh octets: requests, lengths of answers, stray zeros.

A master asks the same again and again, and a station answers it at the same length. Only good frames teach; memory is
bounded.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable, Sequence
from typing import Final

from dissectors.frame import Flaw
from dissectors.modbus.functions import ANSWER_LENGTHS, EXCEPTION_BIT, FUNCTIONS

KNOWN_REQUEST: Final = 14
"""Bits for octets that were a request before, octet for octet."""

KNOWN_LENGTH: Final = 6
"""Bits for an answer as long as one that this station gave to this function before, where lengths differ at all."""

MOST_REQUESTS: Final = 512
"""Requests that are remembered: those that came last."""

_MOST_LENGTHS: Final = 4096
_CONSTANT: Final = 4
"""So many frames of one length, and none of another, make it the length of their kind."""

_STRAY: Final = 1024
_STRAY_BUS: Final = 1500
"""Each stray zero adds _STRAY to a sum that loses 1/64 with every frame: two within some thirty frames make a habit."""


class Past:
    """Requests and lengths of answers by station and function; whether zeros tend to follow frames on this bus."""

    __slots__ = ("_calls", "_constant", "_flaws", "_lengths", "_requests", "_strays", "learnt")

    def __init__(self) -> None:
        self._requests: OrderedDict[bytes, None] = OrderedDict()  # in the order they came last
        self._lengths: dict[int, int] = {}  # unit, function, direction → a bit for each length
        self._constant: dict[int, tuple[int, int]] = {}  # of functions of unknown layout: first length, how often
        self._calls: set[int] = set()  # unit and function of all requests
        self._flaws: dict[int, Flaw] = {}  # of the newest answer, by station
        self._strays = 0
        self.learnt: object = None  # of what was noted many at a time (past_columns.py)

    def bits(self, octets: bytes, request: bool, response: bool) -> int:
        """Evidence for a complete frame that may be a request, a response or either."""
        if request and octets in self._requests:
            return KNOWN_REQUEST
        if response and octets[1] < EXCEPTION_BIT and self.knows_length(octets[0], octets[1], len(octets)):
            return KNOWN_LENGTH
        return 0

    def has_asked(self, octets: bytes) -> bool:
        """Whether octets were a request before, octet for octet."""
        return octets in self._requests

    def has_called(self, unit: int, code: int) -> bool:
        """Whether this station was asked for this function before."""
        return unit << 8 | code in self._calls

    def knows_length(self, unit: int, code: int, length: int) -> bool:
        """Whether a frame of this length has answered."""
        return bool(self._lengths.get(_key(unit, code, True), 0) >> length & 1)

    def only_length(self, unit: int, code: int, answer: bool) -> int | None:
        """The length that requests or answers of a function of unknown layout always had, or None."""
        length, times = self._constant.get(_key(unit, code, answer), (0, 0))
        return length if times >= _CONSTANT else None

    def is_habit(self, unit: int, flaw: Flaw) -> bool:
        """Whether the answer before of this station had the same flaw; the answer under way has it."""
        before = self._flaws.get(unit)
        self._flaws[unit] = flaw
        return before is flaw

    @property
    def only_gathers(self) -> bool:
        """Whether noting an answer that was noted before changes nothing: nothing is forgotten or counted down."""
        return not self._strays and not self._flaws

    def note(self, octets: bytes, request: bool) -> None:
        """A good frame, and what it was taken for."""
        if self._strays:
            self._strays -= self._strays >> 6
        if self._flaws and not request:
            self._flaws.pop(octets[0], None)
        code = octets[1]
        known = code & ~EXCEPTION_BIT in FUNCTIONS
        if request:
            self._calls.add(octets[0] << 8 | code)
        if request:
            self._requests[octets] = None
            self._requests.move_to_end(octets)
            if len(self._requests) > MOST_REQUESTS:
                self._requests.popitem(last=False)
        if (known and request) or code & EXCEPTION_BIT or code in ANSWER_LENGTHS:
            return
        key = _key(octets[0], code, not request)
        lengths = self._lengths.get(key, 0)
        if not lengths and len(self._lengths) >= _MOST_LENGTHS:
            return
        self._lengths[key] = lengths | 1 << len(octets)
        if not known:
            length, times = self._constant.get(key, (len(octets), 0))
            self._constant[key] = (
                (length, min(times + 1, _CONSTANT)) if length == len(octets) and times >= 0 else (0, -1)
            )

    def note_requests(self, count: int, newest: Sequence[bytes], calls: Iterable[int]) -> None:
        """So many good requests of functions whose layout is known: the same as `note` of one after the other.

        `newest`: the last MOST_REQUESTS of them that differ, each in the order it came last. `calls`: units and
        functions of all, unit << 8 | function."""
        for _ in range(count):
            if not self._strays >> 6:
                break
            self._strays -= self._strays >> 6
        self._calls.update(calls)
        requests = self._requests
        if len(newest) >= MOST_REQUESTS:  # nothing older stays
            requests.clear()
        for octets in newest:
            requests[octets] = None
            requests.move_to_end(octets)
        for _ in range(len(requests) - MOST_REQUESTS):
            requests.popitem(last=False)

    def note_stray_zero(self) -> None:
        """A zero behind a frame that cannot be its last octet."""
        self._strays = min(self._strays + _STRAY, 8 * _STRAY)

    @property
    def zeros_stray(self) -> bool:
        """Whether a zero behind a frame is nothing unusual here."""
        return self._strays >= _STRAY_BUS


def _key(unit: int, code: int, answer: bool) -> int:
    return unit << 9 | code << 1 | answer
