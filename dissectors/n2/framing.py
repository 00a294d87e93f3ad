"""N2 framing: `>` … CR from the master, `A` … CR and `N` … CR from a station.

Octets are collected into a stretch until its end is seen; then it is taken apart (`stretch.py` has the rules for what
is a frame in it). A stretch ends

1. with CR;
2. damaged at 256 octets: what follows the last place where a frame may begin goes on into the next;
3. damaged when silence of SILENCE is proved and a frame may have begun in it: N2 sets no limit between characters, so
   that one is ours. Where none may have begun, two characters of silence end it.

What is no frame is noise. A line feed after CR is filler.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from dissectors.frame import Check, Chunk, Damage, Event, FoundBy, Frame, LineError, Noise, Place, Reason
from dissectors.framer import OctetWindow, Taken
from dissectors.line import NS_PER_S, Timing
from dissectors.n2.commands import Command, expected_length, has_other_length, parse_command
from dissectors.n2.envelope import COMMAND, CR, NOT_TEXT, is_good, judge
from dissectors.n2.stretch import SHORTEST, Before, N2Stretch, Piece, good_whole

if TYPE_CHECKING:
    from dissectors.columns import FrameColumns, Octets
    from dissectors.framer import Framer

__all__ = ["MAX_LENGTH", "SILENCE", "N2Framer", "judge"]

MAX_LENGTH = 256
"""Longest message in octets, start character to CR (TECO F510 manual 1.2.4, error 03)."""

SILENCE = 100_000_000
"""ns of proved silence that end a frame without CR."""

FOREIGN_SILENCE = NS_PER_S
"""The same after a `:`, which begins a Modbus ASCII line: there 1 s between characters is allowed."""

_LF = 0x0A


class N2Framer:
    """Octets and times in, N2 frames and noise out."""

    protocol = "n2"
    primed = 6

    def __init__(self, timing: Timing) -> None:
        self._window = OctetWindow(timing)
        self._near = 2 * timing.char
        self._limit = max(SILENCE, self._near)
        self._start = 0  # of the stretch; the octets before it are noise
        self._seams: list[int] = []  # where silence was proved inside it
        self._before = Before.NOTHING
        self._foreign = False  # a `:` since the last line end
        self._waits = False  # a command has no answer yet
        self._asked: Command | None = None  # which, where it was good
        self._command = b""  # its octets
        self._short = (0, 0)  # octets that lacked when the command before it, and it itself, was given back
        self._proved = False  # a checksum was right: this bus does speak N2
        self._attached = False  # the held noise stands directly after a frame
        self._skipped = 0
        self._out: list[Event] = []

    def feed(self, chunk: Chunk) -> list[Event]:
        """Take one read; give the events it completes, in order."""
        if not chunk.octets:
            return self.advance(chunk.time)
        silence = self._window.least_silence_before(chunk)
        if silence is not None:
            self._hear_silence(silence)
        at = len(self._window)
        self._window.append(chunk)
        self._scan(at)
        return self._give()

    def advance(self, now: int) -> list[Event]:
        """Say that no read returned up to `now` (ns); give what the silence completes."""
        silence = self._window.least_silence_at(now)
        if silence is not None:
            self._hear_silence(silence)
        return self._give()

    def close(self) -> list[Event]:
        """End of capture: give everything still held."""
        if len(self._window) > self._start:
            self._conclude(len(self._window), Damage.SHORT)
        self._flush_noise(self._last_place)
        return self._give()

    def deadline(self) -> int | None:
        """When silence will mean something next (ns), or None when it never will."""
        if not len(self._window):
            return None
        return self._window.proves_silence(self._limit if self._holds_frame() else self._near)

    def remember(self, earlier: Framer, frames: FrameColumns, octets: Octets, begin: int, end: int) -> None:
        """See `dissectors.columns.Remembering`: a bus that has proved to speak N2 still does."""
        from dissectors.columns import CHECKS  # who feeds row by row needs no numpy

        assert isinstance(earlier, N2Framer)
        self._proved = earlier._proved or bool((frames.check[begin:end] == CHECKS.index(Check.GOOD)).any())

    @property
    def _last_place(self) -> Place:
        """Where noise stands that no frame follows."""
        return Place.AFTER if self._attached else Place.BETWEEN

    def _give(self) -> list[Event]:
        out, self._out = self._out, []
        return out

    # --- silence ---

    def _hear_silence(self, silence: int) -> None:
        """Draw the conclusions of a proved silence after the newest octet."""
        if silence < self._near:
            return
        end = len(self._window)
        if end > self._start:
            if self._holds_frame():
                if not self._seams or self._seams[-1] != end:
                    self._seams.append(end)
                if silence < self._limit:
                    return
            self._conclude(end, Damage.TIMEOUT)
        self._flush_noise(self._last_place)
        self._attached = False
        if not self._foreign or silence >= FOREIGN_SILENCE or (self._waits and self._proved):
            self._foreign = False
            self._before = Before.LINE_END

    def _holds_frame(self) -> bool:
        """Whether a frame may have begun in the stretch."""
        end = len(self._window)
        return end > self._start and self._stretch(end, None).may_hold_frame()

    # --- octets ---

    def _scan(self, at: int) -> None:
        """Go through the window from `at`; everything before is already understood."""
        octets = self._window.octets
        while True:
            limit = self._start + MAX_LENGTH
            end = octets.find(CR, at, limit)
            if end >= 0:
                self._conclude(end + 1, None)
            elif len(octets) >= limit:
                begin = self._stretch(limit, Damage.LONG).last_begin()
                self._conclude(self._start + begin if begin else limit, Damage.LONG)
            else:
                return
            at = self._start

    def _stretch(self, end: int, damage: Damage | None) -> N2Stretch:
        start = self._start
        seams = tuple(seam - start for seam in self._seams if start < seam < end)
        octets = bytes(self._window.octets[start:end])
        known = self._waits, self._asked, self._proved, self._command, self._short[0]
        return N2Stretch(octets, damage, seams, self._before, *known)

    def _conclude(self, end: int, damage: Damage | None) -> None:
        """Give what was collected up to `end`."""
        if damage is None and not self._seams and self._takes_at_once(end):
            return
        done = 0
        stretch = self._stretch(end, damage)
        for piece in stretch.pieces():
            octets = stretch.octets[done : piece.end]
            if piece.check is None:
                self._pass_noise(octets)
            else:
                joined = any(done < seam < piece.end for seam in stretch.seams)
                self._emit(octets, piece, piece.check, joined=joined)
            done = piece.end
        if self._seams:
            if self._start in self._seams:
                self._before = Before.LINE_END
            self._seams = [seam for seam in self._seams if seam > self._start]

    def _takes_at_once(self, end: int) -> bool:
        """Take a stretch that is one good frame, or too short for any that nobody waits for: nearly all are."""
        octets = bytes(self._window.octets[self._start : end])
        if octets.rfind(b">") > 0 or has_other_length(octets) or (self._short[0] and octets == self._command):
            return False
        check = good_whole(octets, self._before, waits=self._waits, proved=self._proved) if len(octets) > 1 else None
        if check is not None:
            self._emit(octets, Piece(end, check), check, joined=False)
            return True
        if len(octets) == 1 or (len(octets) < SHORTEST and not self._waits):
            self._pass_noise(octets)
            return True
        return False

    # --- noise ---

    def _pass_noise(self, octets: bytes) -> None:
        """Leave octets to the noise, and remember what they mean for the next one."""
        last = octets[-1]
        if last == CR or (last == _LF and (self._before is Before.LINE_END if len(octets) == 1 else octets[-2] == CR)):
            self._before, self._foreign = Before.LINE_END, False
        else:
            self._before = Before.NOT_TEXT if NOT_TEXT.match(octets[-1:]) else Before.TEXT
            self._foreign |= b":" in octets
        self._start += len(octets)
        if self._start >= MAX_LENGTH:
            self._flush_noise(self._last_place)
            self._attached = False

    def _flush_noise(self, place: Place) -> None:
        """Give the octets before the stretch as noise."""
        count = self._start
        if not count:
            return
        taken = self._window.take(count)
        self._start = 0
        self._seams = [seam - count for seam in self._seams]
        self._skipped += count
        self._out.append(Noise(taken.octets, taken.start, taken.end, place, _reason(taken, place), taken.marks))

    def _place_before_frame(self) -> Place:
        """Where the noise lies that a frame follows: at the nearer one where it may touch the frame before as well."""
        if not self._attached or not self._start:
            return Place.BEFORE
        before, after = self._window.gap(0), self._window.gap(self._start)
        if before == after:
            return Place.BETWEEN
        return Place.AFTER if before < after else Place.BEFORE

    # --- frames ---

    def _emit(self, octets: bytes, piece: Piece, check: Check, *, joined: bool) -> None:
        """Give octets at the begin of the stretch as a frame."""
        self._flush_noise(self._place_before_frame())
        taken = self._window.take(len(octets))
        self._seams = [seam - len(octets) for seam in self._seams]
        found = FoundBy.SPLIT if piece.split else FoundBy.JOINED if joined else FoundBy.DELIMITER
        told = octets if piece.repair is None else piece.repair.octets
        is_command = told[0] == COMMAND
        self._out.append(
            Frame(
                protocol=self.protocol,
                octets=octets,
                start=taken.start,
                end=taken.end,
                check=check,
                found=found,
                damage=piece.damage,
                expected=expected_length(told) if is_command else None,
                skipped=self._skipped,
                slack=taken.slack,
                marks=taken.marks,
                flags=("lower-case",) if octets != octets.upper() else (),
                repair=piece.repair,
            )
        )
        self._skipped = 0
        self._attached = True
        if is_command:
            self._waits = True
            if piece.damage is None:
                self._short = self._short[1], 0
            elif octets and self._command.startswith(octets):
                self._short = self._short[0], len(self._command) - len(octets)
            self._command = told if piece.damage is None or piece.repair is not None else b""
            self._asked = parse_command(told) if self._command else None
        elif piece.damage is None or (piece.repair is not None and is_good(told)):
            # any other damaged one may have been junk, and the answer come yet
            self._waits, self._asked, self._command = False, None, b""
        self._proved |= piece.damage is None and check is Check.GOOD
        self._foreign = False
        self._before = Before.LINE_END
        if octets[-1] != CR:
            self._before = Before.NOT_TEXT if NOT_TEXT.match(octets[-1:]) else Before.TEXT


def _reason(taken: Taken, place: Place) -> Reason:
    if not taken.octets.strip(b"\r\n"):
        return Reason.PAD
    if not taken.octets.strip(b"\0"):
        if any(LineError.BREAK in mark.error for mark in taken.marks):
            return Reason.BREAK
        if place is Place.AFTER:
            return Reason.ZEROS
    if taken.octets[0] == COMMAND:
        return Reason.FALSE_START
    return Reason.NO_DELIMITER
