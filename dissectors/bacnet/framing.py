"""MS/TP framing for a listener: preamble, header CRC, length, data CRC; no gap is needed (ANSI/ASHRAE 135, 9.5.4).

The rules:

1. A frame begins with 55 FF and six octets whose header CRC is good. From there its length is known, and nothing
   inside it restarts it while header and data are good: a preamble among the data of a good frame is data.
2. A frame whose data CRC is bad ends where the next good header begins inside it (it was cut short and the next frame
   ran into its place), else where silence of over 100 ms stands inside it, else at its length.
3. A good header directly after proved silence of 60 bit times (Tframe_abort) ends the frame before it, and so does
   the silence that loses the token (500 ms). Other silence inside a frame proves nothing: hosts read late.
4. A preamble with a bad header is kept as a damaged frame, up to the next good header, the next preamble after proved
   silence or where a frame without data would end, or the length it claims, when that many octets make sense: a node
   would have to drop it, we can often still say who sent it. Of a doubled preamble the second one counts.
5. A good header whose preamble lacks an octet or has a wrong one, directly after a frame or after silence, begins a
   damaged frame where no data are announced or the data CRC is good. Eight octets alone between frames or silences,
   with half a preamble and the length 0, are a token or a poll of which more is spoilt.
6. One FF directly after a good frame belongs to it (the tail octet that some drivers send): flag "trailing-pad".
7. All else is noise, cut at silence of 60 bit times and at NOISE_MAX octets.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

from dissectors.bacnet.frame_types import HEADER, PREAMBLE, is_encoded, total
from dissectors.bacnet.held_octets import NAMED, WAIT, HeldOctets
from dissectors.bacnet.limits import (
    MAX_DATA,
    MAX_ENCODED,
    MIN_ENCODED,
    T_FRAME_ABORT_MAX,
    T_NO_TOKEN,
)
from dissectors.bacnet.mending import after_spoilt_preamble, body_is_good, header_is_good, is_like_header
from dissectors.checksums import crc8_mstp
from dissectors.frame import Check, Chunk, Damage, Event, FoundBy, Repair
from dissectors.framer import UNKNOWN_SILENCE
from dissectors.line import Timing

__all__ = ["NOISE_MAX", "MstpFramer", "body_is_good", "header_is_good", "parse_header"]

NOISE_MAX = 1024
"""Most octets in one Noise event."""

_PIECE = 4096  # octets of a chunk taken at once: bounds memory and keeps the window cheap to cut


class _Mended(NamedTuple):
    """A frame whose preamble is not as it should be: how many octets, and what it was where that is proved."""

    size: int
    repair: Repair | None


class MstpFramer(HeldOctets):
    """Sans-I/O framer for MS/TP; see the rules above and `dissectors.framer` for the contract."""

    protocol = "mstp"

    def __init__(self, timing: Timing) -> None:
        super().__init__(timing)
        self._needs_pause = 0  # the silence that decides what is held; 0 while nothing is held

    def feed(self, chunk: Chunk) -> list[Event]:
        """Take one read; give the events it completes."""
        count = len(chunk.octets)
        if count <= _PIECE:
            silences = len(self._silences)
            self._append(chunk)
            if count and len(self._window.octets) < self._awaited and len(self._silences) == silences:
                return []
            return self._drain(0, final=False)
        events: list[Event] = []
        for begin in range(0, count, _PIECE):
            end = min(begin + _PIECE, count)
            self._append(_part(chunk, begin, end, self._char))
            events += self._drain(0, final=False)
        return events

    def advance(self, now: int) -> list[Event]:
        """Say that no read returned up to `now`; give what the silence completes."""
        return self._drain(self._window.least_silence_at(now) or 0, final=False) if len(self._window) else []

    def close(self) -> list[Event]:
        """End of capture: give everything still held."""
        return self._drain(0, final=True)

    def deadline(self) -> int | None:
        """When silence will mean something next; None when nothing is held."""
        return self._window.proves_silence(self._needs_pause) if len(self._window) else None

    def _drain(self, quiet: int, final: bool) -> list[Event]:
        events: list[Event] = []
        octets = self._window.octets
        self._awaited = 0  # what was awaited may wait for something else by now, e.g. for a header after silence
        while octets:
            event = self._next(quiet, final)
            if event is None:
                break
            events.append(event)
        return events

    # What comes next: noise up to the next candidate, or the frame there

    def _next(self, quiet: int, final: bool) -> Event | None:
        octets = self._window.octets
        if not self._noise:
            size = self._plain or self._look()
            if size and len(octets) > size and octets[size] != 0xFF:
                return self._take_plain(size)
            if size and len(octets) == size and not final and quiet < self._pause:
                self._needs_pause = self._pause
                return None
            if not size and octets[:2] != PREAMBLE[: len(octets)]:
                mended_frame = self._spoilt_preamble(quiet, final)
                if mended_frame == WAIT:
                    self._needs_pause = self._pause
                    return None
                if isinstance(mended_frame, _Mended):
                    return self._take_frame(
                        mended_frame.size, Check.BAD, Damage.HEADER, self._found(0), mended_frame.repair
                    )
        while True:
            at = self._noise
            if at:
                if at >= NOISE_MAX or (at < len(octets) and self._window.silence(at)[0] >= self._pause):
                    return self._take_noise(before_frame=False)
                if at == len(octets):
                    self._needs_pause = self._pause
                    return self._take_noise(before_frame=False) if final or quiet >= self._pause else None
            frame = self._frame_at(at, quiet, final) if octets[at] == PREAMBLE[0] else 1
            if isinstance(frame, int):
                if frame == WAIT:
                    return None
                self._noise += frame
            elif at:  # the noise before it goes first; the frame is found again at the front
                return self._take_noise(before_frame=True)
            else:
                return self._take_frame(*frame)

    def _look(self) -> int:
        """The plain case, which is nearly every case: octets of a good frame at the front with no gap in it, else 0."""
        octets = self._window.octets
        if len(octets) < HEADER or not octets.startswith(PREAMBLE) or crc8_mstp(bytes(octets[2:7])) != octets[7]:
            return 0
        frame_type, length = octets[2], octets[5] << 8 | octets[6]
        size = total(length)
        if length > MAX_DATA or is_encoded(frame_type) or len(octets) < size:
            return 0
        if self._silences and self._silence_in(1, size, self._least) is not None:
            return 0
        if length and not body_is_good(frame_type, length, bytes(octets[HEADER:size])):
            return 0
        self._plain = size
        return size

    def _spoilt_preamble(self, quiet: int, final: bool) -> _Mended | int | None:
        """Rule 5 at the front of the window, where a frame may begin: the frame, WAIT, or None where there is none."""
        octets = self._window.octets
        if self._skipped and not self._window.silence(0)[0] >= self._pause:
            return None  # in the middle of noise
        if self._window.gap(0) == UNKNOWN_SILENCE:
            return None  # the capture may have begun in the middle of a frame
        stop = self._silence_in(1, len(octets), self._pause)
        ended = stop is not None or final or quiet >= self._pause
        stop = len(octets) if stop is None else stop
        spoilt = after_spoilt_preamble(octets[: min(HEADER, stop)])
        if spoilt is None:
            undecided = not ended and stop < HEADER and PREAMBLE not in octets
            return WAIT if undecided else self._like_header(stop, ended)
        at, length, flaw = spoilt
        begin = at + HEADER - 2
        size = begin + (length + 2 if length else 0)
        if length and self._good_header(1, min(size, stop), stop) is not None:
            return None
        if size > stop:
            return None if ended else WAIT
        whole = PREAMBLE + bytes(octets[at:size])
        if not body_is_good(whole[2], length, whole[HEADER:]):
            return None
        return _Mended(size, Repair(flaw, whole))

    def _like_header(self, stop: int, ended: bool) -> _Mended | int | None:
        """What is left of a frame without data at the front of the window, up to silence or the next good header."""
        octets, whole = self._window.octets, _Mended(HEADER, None)
        if stop < HEADER or PREAMBLE in octets[:HEADER] or not is_like_header(octets[:HEADER]):
            return None
        if stop >= 2 * HEADER:
            return whole if header_is_good(octets[HEADER : 2 * HEADER]) else None
        if stop == HEADER and ended:
            return whole
        return None if ended or not PREAMBLE.startswith(bytes(octets[HEADER : HEADER + 2])) else WAIT

    def _frame_at(self, at: int, quiet: int, final: bool) -> int | tuple[int, Check, Damage | None, FoundBy]:
        """The frame at a 55: (octets, check, damage, found), or how many octets here are noise, or WAIT."""
        octets = self._window.octets
        stop, ended = self._reach(at, quiet, final)
        have = stop - at
        if have >= 2 and octets[at + 1] != PREAMBLE[1]:
            return 1
        if have < HEADER:
            if not ended:
                return self._await(at, at + (HEADER if have >= 2 else 2))
            named = have >= NAMED and octets[at + 2 : at + 4] != PREAMBLE
            return (have, Check.ABSENT, Damage.SHORT, self._found(at)) if named else 1
        frame_type, length = octets[at + 2], octets[at + 5] << 8 | octets[at + 6]
        if crc8_mstp(bytes(octets[at + 2 : at + 7])) != octets[at + 7]:
            return self._bad_header(at, frame_type, length, stop, ended)
        if length > MAX_ENCODED:
            return HEADER, Check.ABSENT, Damage.LONG, self._found(at)
        size = total(length)
        cut = self._restart(at, min(at + size, stop), stop, ended)
        if cut is not None:
            if cut == WAIT:
                return WAIT
            return cut - at, Check.ABSENT, Damage.RESTARTED, self._found(at)
        if have < size:
            return self._incomplete(at, size, stop, ended)
        if body_is_good(frame_type, length, bytes(octets[at + HEADER : at + size])):
            return self._complete(at, size, frame_type, length, quiet, ended)
        return self._bad_body(at, size, stop, ended)

    def _complete(
        self, at: int, size: int, frame_type: int, length: int, quiet: int, ended: bool
    ) -> int | tuple[int, Check, Damage | None, FoundBy]:
        octets, after = self._window.octets, at + size
        found = self._found(at)
        if self._silence_in(at + 1, after, T_FRAME_ABORT_MAX) is not None:
            found = FoundBy.JOINED
        if after == len(octets):
            if not ended and quiet < self._pause:
                self._needs_pause = self._pause
                return WAIT
        elif octets[after] == 0xFF and self._window.silence(after)[0] < self._pause:
            size += 1
        damage = None
        if is_encoded(frame_type):
            damage = Damage.FORM if length < MIN_ENCODED else None
        elif length > MAX_DATA:
            damage = Damage.LONG
        return size, Check.GOOD, damage, found

    def _restart(self, at: int, end: int, stop: int, ended: bool) -> int | None:
        """Where rule 3 ends the frame at `at` before `end`; WAIT when the header there is not whole yet."""
        begin = at + HEADER
        while (silent := self._silence_in(begin, end, self._pause)) is not None:
            if silent + HEADER <= stop:
                if header_is_good(self._window.octets[silent : silent + HEADER]):
                    first = self._good_header(at + HEADER, silent, stop)
                    return silent if first is None else first
            elif not ended and PREAMBLE.startswith(bytes(self._window.octets[silent : min(silent + 2, stop)])):
                self._needs_pause = T_NO_TOKEN
                return WAIT
            begin = silent + 1
        return None

    def _await(self, at: int, end: int) -> int:
        """Wait for the octets of what begins at `at` up to `end`: before they are there only silence decides."""
        self._needs_pause = T_NO_TOKEN
        heard = len(self._window.octets)
        self._awaited = 0 if self._silences and self._silence_in(at + 1, heard, 0) is not None else end
        return WAIT

    def _incomplete(
        self, at: int, size: int, stop: int, ended: bool
    ) -> int | tuple[int, Check, Damage | None, FoundBy]:
        if not ended:
            return self._await(at, at + size)
        cut = self._good_header(at + HEADER, stop, stop)
        if cut is not None:
            return cut - at, Check.ABSENT, Damage.RESTARTED, self._found(at)
        return stop - at, Check.ABSENT, Damage.SHORT, self._found(at)

    def _bad_body(self, at: int, size: int, stop: int, ended: bool) -> int | tuple[int, Check, Damage | None, FoundBy]:
        cut = self._good_header(at + HEADER, at + size, stop)
        if cut is None and not ended and self._undecided_header(at + HEADER, at + size, stop):
            self._needs_pause = T_NO_TOKEN
            return WAIT
        silent = self._silence_in(at + 1, at + size if cut is None else cut, T_FRAME_ABORT_MAX)
        if silent is not None:
            return max(silent - at, 1), Check.ABSENT, Damage.TIMEOUT, self._found(at)
        if cut is not None:
            return cut - at, Check.ABSENT, Damage.RESTARTED, self._found(at)
        return size, Check.BAD, Damage.CHECK, self._found(at)

    def _bad_header(
        self, at: int, frame_type: int, length: int, stop: int, ended: bool
    ) -> int | tuple[int, Check, Damage | None, FoundBy]:
        octets = self._window.octets
        if octets[at + 2 : at + 4] == PREAMBLE:  # a doubled preamble: the second one counts
            return 2
        plausible = length <= (MAX_ENCODED if is_encoded(frame_type) else MAX_DATA)
        limit = at + (total(length) if plausible else HEADER)
        cut = self._good_header(at + 1, min(limit, stop), stop)
        again = self._next_preamble(at, min(limit, stop) if cut is None else cut, stop, ended)
        if again == WAIT:
            self._needs_pause = T_NO_TOKEN
            return WAIT
        cut = cut if again is None else again
        if cut is None:
            if not ended and (limit > stop or self._undecided_header(at + 1, limit, stop)):
                self._needs_pause = T_NO_TOKEN
                return WAIT
            if limit <= stop and body_is_good(frame_type, length, bytes(octets[at + HEADER : limit])):
                return limit - at, Check.BAD, Damage.HEADER, self._found(at)
            cut = min(limit, stop)
        silent = self._silence_in(at + 1, cut, T_FRAME_ABORT_MAX)
        if silent is not None:
            cut = silent
        have = cut - at
        if have < NAMED:
            return have
        if have < HEADER:
            return have, Check.ABSENT, Damage.RESTARTED, self._found(at)
        return have, Check.BAD, Damage.HEADER, self._found(at)

    # Looking around

    def _reach(self, at: int, quiet: int, final: bool) -> tuple[int, bool]:
        """How far the octets from `at` on may belong together, and whether more can still come."""
        length = len(self._window.octets)
        cut = self._silence_in(at + 1, length, T_NO_TOKEN)
        if cut is not None:
            return cut, True
        return length, final or quiet >= T_NO_TOKEN


def _part(chunk: Chunk, begin: int, end: int, char: int) -> Chunk:
    """Octets [begin, end) of a chunk as a chunk of their own: the same octets at the same times."""
    marks = tuple(type(mark)(mark.offset - begin, mark.error) for mark in chunk.marks if begin <= mark.offset < end)
    return Chunk(chunk.time - (len(chunk.octets) - end) * char, chunk.octets[begin:end], marks)


def parse_header(octets: bytes) -> tuple[int, int, int, int, int] | None:
    """(type, destination, source, length, header CRC) of a frame's octets; None when they are fewer than eight."""
    if len(octets) < HEADER:
        return None
    found: tuple[int, int, int, int, int] = struct.unpack_from(">BBBHB", octets, 2)
    return found
