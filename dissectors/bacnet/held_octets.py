"""Octets that the MS/TP framer holds: what stands round a place of them, and how they are given out.

framing.py decides what is a frame.
"""

from __future__ import annotations

from dissectors.bacnet.frame_types import HEADER, PREAMBLE, total
from dissectors.bacnet.limits import FRAME_ABORT_BITS, T_FRAME_ABORT_MAX
from dissectors.bacnet.mending import header_is_good, mended
from dissectors.frame import Check, Chunk, Damage, FoundBy, Frame, LineError, Noise, Place, Reason, Repair
from dissectors.framer import OctetWindow, Taken
from dissectors.line import Timing

NAMED = 4
"""Preamble, type, destination: a frame has begun, and whose turn it was says who sent it."""

WAIT = -1
"""In place of a number of octets: what comes next decides."""


class HeldOctets:
    """The window of a framer, with the silences in it."""

    def __init__(self, timing: Timing) -> None:
        self._window = OctetWindow(timing)
        self._char = timing.char
        self._pause = timing.line.bits(FRAME_ABORT_BITS)
        self._least = min(self._pause, T_FRAME_ABORT_MAX)
        self._silences: list[tuple[int, int]] = []  # octets of the window with so much proved silence before them
        self._noise = 0  # octets at the front of the window that begin no frame
        self._skipped = 0  # octets of noise given out since the last frame
        self._after_frame = False  # the event before was a frame
        self._clear = (0, 0)  # between these places of the window no good header begins
        self._plain = 0  # octets of the good frame without silence inside at the front of the window, 0 unknown
        self._awaited = 0  # length of the window below which octets without silence before them decide nothing

    def _append(self, chunk: Chunk) -> None:
        index = len(self._window.octets)
        self._window.append(chunk)
        if chunk.octets:
            silence = self._window.newest_silence
            if silence >= self._least:
                self._silences.append((index, silence))

    # What stands round a place

    def _silence_in(self, begin: int, end: int, limit: int) -> int | None:
        """The first octet of [begin, end) with at least `limit` of proved silence before it."""
        for index, silence in self._silences:
            if begin <= index < end and silence >= limit:
                return index
        return None

    def _next_preamble(self, at: int, end: int, stop: int, ended: bool) -> int | None:
        """The first preamble before `end` that ends the frame at `at`, whose header is bad.

        It stands directly after proved silence, or where a frame without data ends or would, had it lost octets. WAIT
        where its second octet may yet come.
        """
        octets = self._window.octets
        nearest = octets.find(PREAMBLE, at + NAMED, min(at + HEADER + 2, end + 1, stop))
        if nearest != -1:
            return nearest
        if not ended and at + NAMED < stop <= at + HEADER and octets[stop - 1] == PREAMBLE[0]:
            return WAIT
        begin = at + 2
        while self._silences and (silent := self._silence_in(begin, end, self._pause)) is not None:
            if octets[silent : min(silent + 2, stop)] == PREAMBLE:
                return silent
            if not ended and silent + 1 == stop and octets[silent] == PREAMBLE[0]:
                return WAIT
            begin = silent + 1
        return None

    def _good_header(self, begin: int, end: int, stop: int) -> int | None:
        """The first place in [begin, end) where a good header begins that is whole before `stop`."""
        octets = self._window.octets
        clear_from, clear_to = self._clear
        known = clear_from <= begin <= clear_to
        at = octets.find(PREAMBLE, clear_to if known else begin, min(end + 1, stop))
        while at != -1 and at < end and at + HEADER <= stop:
            if header_is_good(octets[at : at + HEADER]):
                return at
            at = octets.find(PREAMBLE, at + 1, min(end + 1, stop))
        looked = min(end, stop - HEADER + 1)
        if looked > begin and (not known or looked > clear_to):
            self._clear = (clear_from if known else begin), looked
        return None

    def _undecided_header(self, begin: int, end: int, stop: int) -> bool:
        """Whether a header may begin in [begin, end) that is not whole before `stop`."""
        octets = self._window.octets
        for at in range(max(begin, stop - HEADER + 1), min(end, stop)):
            if octets[at] == PREAMBLE[0] and (at + 1 >= stop or octets[at + 1] == PREAMBLE[1]):
                return True
        return False

    def _found(self, at: int) -> FoundBy:
        if (at or self._skipped) and self._window.silence(at)[0] < self._pause:
            return FoundBy.SPLIT
        return FoundBy.LENGTH

    # Giving out

    def _take_frame(
        self, size: int, check: Check, damage: Damage | None, found: FoundBy, repair: Repair | None = None
    ) -> Frame:
        octets = self._window.octets
        expected = None
        if size >= HEADER and (damage is not Damage.HEADER):
            expected = total(octets[5] << 8 | octets[6])
        flags: tuple[str, ...] = ()
        end = slack = None
        if check is Check.GOOD and expected is not None and size > expected:
            flags = ("trailing-pad",)
            # it comes directly behind: a pad that was read later, or is none, makes the frame no longer
            end, slack = self._window.end(expected - 1) + self._char, self._window.slack(expected - 1)
        taken = self._take(size)
        skipped, self._skipped = self._skipped, 0
        self._plain = 0
        self._after_frame = True
        if repair is None and check is not Check.GOOD:
            repair = mended(taken.octets, damage)
        return Frame(
            "mstp",
            taken.octets,
            taken.start,
            taken.end if end is None else min(end, taken.end),
            check,
            found,
            damage,
            expected,
            skipped,
            taken.slack if slack is None else slack,
            taken.marks,
            flags,
            repair,
        )

    def _take_plain(self, size: int) -> Frame:
        """A good frame without pad, as `_look` has found it."""
        found = self._found(0) if self._skipped else FoundBy.LENGTH
        taken = self._take(size)
        skipped, self._skipped = self._skipped, 0
        self._plain = 0
        self._after_frame = True
        octets, start, end, slack, marks = taken
        return Frame("mstp", octets, start, end, Check.GOOD, found, None, size, skipped, slack, marks)

    def _take(self, count: int) -> Taken:
        self._awaited = 0
        if self._silences:
            self._silences = [(index - count, silence) for index, silence in self._silences if index >= count]
        if self._clear[1]:
            self._clear = max(0, self._clear[0] - count), max(0, self._clear[1] - count)
        return self._window.take(count)

    def _take_noise(self, before_frame: bool) -> Noise:
        window, count = self._window, self._noise
        place = Place.BETWEEN
        if self._after_frame and window.silence(0)[1] < self._pause:
            place = Place.AFTER
        elif before_frame and window.silence(count)[1] < self._pause:
            place = Place.BEFORE
        taken = self._take(count)
        self._noise = 0
        self._skipped += count
        self._after_frame = False
        reason = _reason(taken.octets, place, any(mark.error & LineError.BREAK for mark in taken.marks))
        return Noise(taken.octets, taken.start, taken.end, place, reason, taken.marks)


def _reason(octets: bytes, place: Place, broken: bool) -> Reason:
    if broken:
        return Reason.BREAK
    if not octets.strip(b"\x00"):
        return Reason.ZEROS if place is Place.AFTER else Reason.NO_FRAME
    if not octets.strip(b"\xff"):
        return Reason.PAD
    if octets[0] == PREAMBLE[0] and (len(octets) == 1 or octets[1] in PREAMBLE):
        return Reason.FALSE_START
    return Reason.NO_FRAME
