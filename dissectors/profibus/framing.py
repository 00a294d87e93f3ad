"""Octets and times → telegrams and noise. Telegrams are found by start, length, sum and end, never by silence.

    octets ─► search for a start
      ─► checked telegram (SD1, SD2, SD3): its sum and end are right; with line errors only where it is expected
      ─► token (SD4), no check: between known masters, or by one to somebody who then sends; where none is known, in a
         chain of tokens or in front of a request by the new holder
      ─► short acknowledgement (SC), no check: directly after a request that wants an answer, and no answer behind it
      ─► what lies between two of them: damaged, if its form tells so, and once a good one was seen; else noise

A stretch that is no telegram is given out when the next good one is found behind it, after MOST_HELD octets, or when
a silence that no telegram has inside is proved. The decision about an octet needs nothing but the octets before it
and a bounded number behind it, so cuts of reads do not show.
"""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

from dissectors.frame import Check, Event, FoundBy, Frame, LineError, Reason
from dissectors.line import MS, Timing
from dissectors.plain_framers import PlainFramer
from dissectors.profibus.control import REQUEST
from dissectors.profibus.envelope import damaged, damaged_token, head_inside, is_sound, length_of
from dissectors.profibus.telegram import FIXED, HIGHEST, LONGEST, SC, SD1, SD2, SD3, SD4, parse

if TYPE_CHECKING:
    from dissectors.columns import FrameColumns, Octets
    from dissectors.framer import Framer

SILENCE = 100 * MS
"""ns of silence that end what has begun: a busy sender may pause inside a telegram, but not so long."""

MOST_HELD = LONGEST + 45
"""Octets that are no telegram, given out together at most."""

_CHAIN = 3
"""Tokens in a row, each from whom the last one went to, that prove a ring."""

STRAY_MOST = 3
"""Stray octets between a request and its short acknowledgement."""

STARTS = re.compile(rb"[\x10\x68\xa2\xdc\xe5]")
_CHECKED = frozenset((SD1, SD2, SD3))


class ProfibusFramer(PlainFramer):
    """The framer of one bus."""

    primed = 6  # tokens and requests of several masters

    def __init__(self, timing: Timing) -> None:
        super().__init__(timing, "profibus", SILENCE)
        self._masters: set[int] = set()
        self._is_open = False  # the telegram before wants an answer
        self._asked: tuple[int | None, int | None] = (None, None)  # whom the last request was for, and by whom
        self._holder: int | None = None  # of the token
        self._is_proved = False  # a checked telegram was seen
        self._at = 0  # where the search goes on: nothing begins before it

    def remember(self, earlier: Framer, frames: FrameColumns, octets: Octets, begin: int, end: int) -> None:
        """See `dissectors.columns.Remembering`."""
        from dissectors.profibus.header_columns import masters_shown

        assert isinstance(earlier, ProfibusFramer)
        frames = frames.take(slice(begin, end))
        self._masters = earlier._masters | masters_shown(frames)
        self._is_proved = earlier._is_proved or bool((frames.length > FIXED[SD4]).any())
        self._is_open, self._asked, self._holder = earlier._is_open, earlier._asked, earlier._holder
        for begin, length in zip(frames.offset[-2:].tolist(), frames.length[-2:].tolist(), strict=True):
            self._learn(octets[begin : begin + length].tobytes())

    def _scan(self, last: bool) -> list[Event]:
        events: list[Event] = []
        while self._window.octets:
            found = self._search(last)
            if found is None:
                break
            at, length = found
            self._at = 0
            events.append(self._between(at) if at else self._telegram(length))
        return events

    def _search(self, last: bool) -> tuple[int, int] | None:
        """Place and length of the next telegram; length 0 where none begins before that place; None: not yet known."""
        octets = self._window.octets
        most = min(len(octets), MOST_HELD)
        while match := STARTS.search(octets, self._at, most):
            self._at = match.start()
            length = self._length(self._at, last)
            if length is None:
                return None
            if length:
                return self._at, length
            self._at += 1
        self._at = most
        return (most, 0) if last or most == MOST_HELD else None

    def _length(self, at: int, last: bool) -> int | None:
        """Octets of the telegram at `at`; 0: none begins there; None: too few octets yet to tell."""
        octet = self._window.octets[at]
        if octet == SC:
            return self._acknowledgement(at, last)
        length = self._token(at) if octet == SD4 else self._checked(at)
        return 0 if length is None and last else length

    def _checked(self, at: int) -> int | None:
        octets = self._window.octets
        length = length_of(octets, at)
        if not length:
            return length
        if len(octets) < at + length:
            return None
        whole = bytes(octets[at : at + length])
        if not is_sound(whole) or (self._is_marked(at, length) and not self._is_in_place(whole)):
            return 0
        return length

    def _is_in_place(self, octets: bytes) -> bool:
        """Whether a telegram with line errors is expected here: two wrong bits may leave its sum right."""
        telegram = parse(octets)
        if telegram.is_request:
            return telegram.source in self._masters
        return (telegram.source, telegram.destination) == self._asked

    def _acknowledgement(self, at: int, last: bool) -> int | None:
        """1 where a short acknowledgement stands; with the answer that is due right behind it is a stray octet."""
        if not (self._is_open and self._may_acknowledge(at)):
            return 0
        answers = [self._answers(at + 1 + skip) for skip in range(STRAY_MOST + 1)]
        if True in answers:
            return 0
        return None if None in answers and not last else 1

    def _answers(self, at: int) -> bool | None:
        """Whether the answer that is due begins there, by its head; None: too few octets yet to tell."""
        octets = self._window.octets
        if len(octets) <= at:
            return None
        if octets[at] not in _CHECKED:
            return False
        begin = at + (4 if octets[at] == SD2 else 1)
        if len(octets) < begin + 3:
            return None
        to, source, control = octets[begin : begin + 3]
        return (source & 0x7F, to & 0x7F) == self._asked and not control & REQUEST

    def _may_acknowledge(self, at: int) -> bool:
        return not at or (at <= STRAY_MOST and not STARTS.search(self._window.octets, 0, at))

    def _token(self, at: int) -> int | None:
        octets = self._window.octets
        if len(octets) < at + 3:
            return None
        to, source = octets[at + 1], octets[at + 2]
        if to > HIGHEST or source > HIGHEST:
            return 0
        if source in self._masters:
            if not self._is_marked(at, 3):
                return 3 if to in self._masters else self._chained(at + 3, to, source, 2)
            return self._chained(at + 3, to, source, 2) if source == self._holder else 0
        return 0 if self._masters else self._chained(at + 3, to, source, _CHAIN)

    def _is_marked(self, at: int, count: int) -> bool:
        return bool(self._window.errors(at, at + count) & ~LineError.OVERRUN)

    def _chained(self, at: int, holder: int, source: int, count: int) -> int | None:
        """3 where what follows the token proves it: more of them, `count` in all, or a request by the new holder."""
        octets = self._window.octets
        for _ in range(count - 1):
            if len(octets) <= at:
                return None
            if octets[at] in _CHECKED:
                length = self._checked(at)
                if not length:
                    return length
                following = parse(bytes(octets[at : at + length]))
                return 3 if following.is_request and following.source == holder else 0
            if octets[at] != SD4:
                return 0
            if len(octets) < at + 3:
                return None
            to, by = octets[at + 1], octets[at + 2]
            if to > HIGHEST or (by != holder and (to, by) != (holder, source)):
                return 0
            holder, source, at = to, by, at + 3
        return 3

    def _telegram(self, length: int) -> Frame:
        is_checked = length > 3
        found, check = (FoundBy.DELIMITER, Check.GOOD) if is_checked else (FoundBy.LENGTH, Check.ABSENT)
        frame = self._frame(length, found, check, None, length)
        self._learn(frame.octets)
        self._is_proved |= is_checked
        return frame

    def _between(self, count: int) -> Event:
        """What lies in front of the next telegram, or of silence: all of it, or the damaged telegram at its begin."""
        octets = bytes(self._window.octets[:count])
        told = None
        if self._is_proved:
            told = damaged(octets) or damaged_token(octets, self._holder, self._masters)
            inside = head_inside(octets) if told is None else 0
            if inside:
                return self._between(inside)
        if told is None:
            self._is_open &= count <= STRAY_MOST
            return self._noise(count, Reason.NO_FRAME)
        meant = octets[: told.count] if told.repair is None else told.repair.octets
        control = parse(meant).control
        self._is_open = control is not None and control.wants_answer
        frame = self._frame(told.count, FoundBy.DELIMITER, told.check, told.damage, told.expected)
        return frame if told.repair is None else replace(frame, repair=told.repair)

    def _learn(self, octets: bytes) -> None:
        """Who is a master, and whether an answer is due."""
        telegram = parse(octets)
        self._is_open = telegram.control is not None and telegram.control.wants_answer
        if telegram.is_request:
            self._asked, self._holder = (telegram.destination, telegram.source), telegram.source
        if telegram.is_token:
            self._masters.update(octets[1:3])
            self._holder = telegram.destination
        elif telegram.control is not None:
            master = telegram.source if telegram.is_request else telegram.destination
            if master is not None and master <= HIGHEST:
                self._masters.add(master)
