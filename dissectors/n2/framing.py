"""N2 framing: `>` … CR from the master, `A` … CR and `N` … CR from a station.

    command    '>' AA C … KK CR      KK: sum of the characters after '>' up to the last before KK, modulo 256
    answer     'A' CR                no checksum
               'A' data KK CR        KK: sum of the data characters, the A not counted
    refusal    'N' EE CR             no checksum

Rules, in the order in which they decide:

1. `>` begins a command, always; what was being collected before it is damaged ("restarted").
2. `A` is a hex digit too, so `A` and `N` begin an answer only where one may stand: after the CR of a line, after
   proved silence of two characters, or, while a command waits for its answer, after an octet that is no text. At the
   begin of a capture, where a line may have been joined in its middle, an answer must prove itself by its checksum;
   and until a frame has, answers without one (`A` CR, `N` EE CR) are noise: any bus may carry such octets.
3. A frame ends with CR. It ends damaged at 256 octets, or when silence of SILENCE inside it is proved; N2 sets no
   limit between characters, so that one is ours.
4. Where a frame turns out bad and a good answer stands at its end, begun after silence or after an octet that is no
   text, the two are split.
5. What has no start, or began without looking like text, is noise. A line feed after CR is filler.
"""

from __future__ import annotations

import re
from enum import Enum, auto

from dissectors.checksums import sum8
from dissectors.frame import Check, Chunk, Damage, Event, Found, Frame, LineError, Noise, Place, Reason
from dissectors.framer import OctetWindow, Taken
from dissectors.line import Timing
from dissectors.n2.commands import expected_length

MAX_LENGTH = 256
"""Longest message in octets, start character to CR (TECO F510 manual 1.2.4, error 03)."""

SILENCE = 100_000_000
"""ns of proved silence that end a frame without CR."""

FOREIGN_SILENCE = 1_000_000_000
"""The same after a `:`, which begins a Modbus ASCII line: there 1 s between characters is allowed."""

_COMMAND, _CR, _LF, _COLON = 0x3E, 0x0D, 0x0A, 0x3A
_ANSWER = frozenset(b"AN")
_END = re.compile(rb"[\r>]")
_NOT_TEXT = re.compile(rb"[^\x20-\x7e]")
_AFTER_NOT_TEXT = re.compile(rb"(?<=[^\x20-\x7e])[AN]")
_HEX_PAIR = re.compile(rb"[0-9A-Fa-f]{2}")


class _Before(Enum):
    """What stands before the next octet, as far as rule 2 asks."""

    NOTHING = auto()  # the capture begins
    LINE_END = auto()  # CR, or proved silence
    NOT_TEXT = auto()
    TEXT = auto()


class _Trust(Enum):
    """How much the place of a start character speaks for it."""

    PROVE = auto()  # believed only with a good checksum
    TEXT = auto()  # believed as long as it is text
    EXPECTED = auto()  # kept even when damaged


def judge(octets: bytes) -> tuple[Check, Damage | None]:
    """The verdict on a whole frame that ends with CR: its check, and what is wrong with it (None: nothing)."""
    body = octets[1:-1]
    if octets[0] == _COMMAND:
        if len(body) < 5:
            return Check.ABSENT, Damage.SHORT
        return _judge_sum(octets, body)
    if octets[0] == 0x4E:
        if len(body) != 2:
            return Check.ABSENT, Damage.SHORT if len(body) < 2 else Damage.LONG
        return Check.ABSENT, None if _HEX_PAIR.fullmatch(body) else Damage.FORM
    if not body:
        return Check.ABSENT, None
    if len(body) < 2:
        return Check.ABSENT, Damage.SHORT
    return _judge_sum(octets, body)


def _judge_sum(octets: bytes, body: bytes) -> tuple[Check, Damage | None]:
    data, sent = body[:-2], body[-2:]
    if not _HEX_PAIR.fullmatch(sent):
        return Check.BAD, Damage.FORM
    if int(sent, 16) == sum8(data):
        return Check.GOOD, Damage.FORM if _NOT_TEXT.search(data) else None
    if _NOT_TEXT.search(data):
        return Check.BAD, Damage.FORM
    expected = expected_length(octets) if octets[0] == _COMMAND else None
    if expected is not None and len(octets) != expected:
        return Check.BAD, Damage.SHORT if len(octets) < expected else Damage.LONG
    return Check.BAD, Damage.CHECK


class N2Framer:
    """Octets and times in, N2 frames and noise out."""

    protocol = "n2"

    def __init__(self, timing: Timing) -> None:
        self._window = OctetWindow(timing)
        self._near = 2 * timing.char
        self._start: int | None = None  # of the frame being collected; the octets before it are noise
        self._trust = _Trust.PROVE
        self._seams: list[int] = []  # where silence was proved inside that frame
        self._before = _Before.NOTHING
        self._foreign = False  # a `:` since the last line end
        self._waits = False  # a command has no answer yet
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
        if self._start is not None:
            self._conclude(len(self._window), Damage.SHORT)
        self._flush_noise(Place.AFTER if self._attached else Place.BETWEEN)
        return self._give()

    def deadline(self) -> int | None:
        """When silence will mean something next (ns), or None when it never will."""
        if not len(self._window):
            return None
        return self._window.proves_silence(self._near if self._start is None else self._limit)

    @property
    def _limit(self) -> int:
        return max(SILENCE, self._near)

    def _give(self) -> list[Event]:
        out, self._out = self._out, []
        return out

    # --- silence ---

    def _hear_silence(self, silence: int) -> None:
        """Draw the conclusions of a proved silence after the newest octet."""
        if silence < self._near:
            return
        if self._start is not None:
            end = len(self._window)
            if not self._seams or self._seams[-1] != end:
                self._seams.append(end)
            if silence < self._limit:
                return
            self._conclude(end, Damage.TIMEOUT)
        self._flush_noise(Place.AFTER if self._attached else Place.BETWEEN)
        self._attached = False
        if not self._foreign or silence >= FOREIGN_SILENCE:
            self._foreign = False
            self._before = _Before.LINE_END

    # --- octets ---

    def _scan(self, at: int) -> None:
        """Go through the window from `at`; everything before is already understood."""
        octets = self._window.octets
        while at < len(octets):
            if self._start is None:
                at = self._look_for_start(at)
                continue
            limit = self._start + MAX_LENGTH
            end = _END.search(octets, at, limit)
            if end is None and len(octets) < limit:
                return
            if end is None:
                at = self._conclude(limit, Damage.LONG)
            elif octets[end.start()] == _CR:
                at = self._conclude(end.end(), None)
            else:
                at = self._conclude(end.start(), Damage.RESTARTED)

    def _look_for_start(self, at: int) -> int:
        octet = self._window.octets[at]
        trust = self._trust_of(octet)
        if trust is not None:
            self._start, self._trust = at, trust
            self._seams.clear()
            return at + 1
        self._note(octet)
        if at + 1 < MAX_LENGTH:
            return at + 1
        self._flush_noise(Place.AFTER if self._attached else Place.BETWEEN)
        self._attached = False
        return 0

    def _trust_of(self, octet: int) -> _Trust | None:
        """Whether a frame may begin with this octet here (rule 2)."""
        if octet == _COMMAND:
            return _Trust.EXPECTED
        if octet not in _ANSWER or self._before is _Before.TEXT:
            return None
        if self._waits:
            return _Trust.EXPECTED
        if self._before is _Before.LINE_END:
            return _Trust.TEXT
        return _Trust.PROVE if self._before is _Before.NOTHING else None

    def _note(self, octet: int) -> None:
        """Remember what a noise octet means for the next one."""
        if octet == _CR or (octet == _LF and self._before is _Before.LINE_END):
            self._before, self._foreign = _Before.LINE_END, False
        elif 0x20 <= octet <= 0x7E:
            self._before = _Before.TEXT
            self._foreign |= octet == _COLON
        else:
            self._before = _Before.NOT_TEXT

    # --- frames ---

    def _conclude(self, end: int, damage: Damage | None) -> int:
        """Give what was collected up to `end`; give the index at which to go on."""
        assert self._start is not None
        start = self._start
        octets = bytes(self._window.octets[start:end])
        check = Check.ABSENT
        if damage is None:
            check, damage = judge(octets)
            if damage is not None and (seam := self._good_answer(octets)):
                self._start, self._trust = self._emit(seam, Check.ABSENT, Damage.FORM), _Trust.EXPECTED
                check, damage = judge(octets[seam:])
                return self._emit(end - start - seam, check, damage, found=Found.SPLIT)
        elif damage is Damage.LONG and (seam := self._last_seam(octets)):
            at = self._emit(seam, check, damage)
            self._start, self._trust = at, _Trust.TEXT
            self._seams = [index - start - seam + at for index in self._seams if index > start + seam]
            return at + end - start - seam
        joined = any(index < end for index in self._seams)
        return self._emit(end - start, check, damage, found=Found.JOINED if joined else Found.DELIMITER)

    def _good_answer(self, octets: bytes) -> int | None:
        """Where a good answer begins at the end of a bad frame (rule 4)."""
        for seam in self._places(octets):
            check, damage = judge(octets[seam:])
            after_silence = seam + (self._start or 0) in self._seams
            if damage is None and (check is Check.GOOD or after_silence):
                return seam
        return None

    def _last_seam(self, octets: bytes) -> int | None:
        places = self._places(octets)
        return places[-1] if places else None

    def _places(self, octets: bytes) -> list[int]:
        """Where else an answer may begin inside octets, ascending."""
        start = self._start or 0
        places = {m.start() for m in _AFTER_NOT_TEXT.finditer(octets)}
        places.update(s - start for s in self._seams if s - start < len(octets) and octets[s - start] in _ANSWER)
        places.discard(0)
        return sorted(places)

    def _emit(self, length: int, check: Check, damage: Damage | None, found: Found = Found.DELIMITER) -> int:
        """Give `length` collected octets as a frame, or leave them to the noise; give the index after them."""
        assert self._start is not None
        start, end = self._start, self._start + length
        octets = bytes(self._window.octets[start:end])
        self._start = None
        if not self._believed(octets, check, damage):
            for octet in octets:
                self._note(octet)
            if end < MAX_LENGTH:
                return end
            self._flush_noise(Place.AFTER if self._attached else Place.BETWEEN, end)
            self._attached = False
            return 0
        self._flush_noise(Place.BETWEEN if self._attached else Place.BEFORE, start)
        self._out.append(self._frame(self._window.take(length), check, damage, found))
        self._skipped = 0
        self._attached = True
        self._waits = octets[0] == _COMMAND
        self._proved |= damage is None and check is Check.GOOD
        self._before, self._foreign = _Before.TEXT, False
        if octets.endswith(b"\r"):
            self._before = _Before.LINE_END
        elif _NOT_TEXT.match(octets[-1:]):
            self._before = _Before.NOT_TEXT
        return 0

    def _believed(self, octets: bytes, check: Check, damage: Damage | None) -> bool:
        """Whether collected octets are a frame at all (rules 2 and 5)."""
        if damage is None:
            return check is Check.GOOD or self._proved
        if self._trust is _Trust.PROVE:
            return False
        foreign = len(_NOT_TEXT.findall(octets.removesuffix(b"\r")))
        if self._trust is _Trust.TEXT:
            return not foreign
        return len(octets) >= (4 if octets[0] == _COMMAND else 3) and 4 * foreign <= len(octets)

    def _frame(self, taken: Taken, check: Check, damage: Damage | None, found: Found) -> Frame:
        octets = taken.octets
        return Frame(
            protocol=self.protocol,
            octets=octets,
            start=taken.start,
            end=taken.end,
            check=check,
            found=found,
            damage=damage,
            expected=expected_length(octets) if octets[0] == _COMMAND else None,
            skipped=self._skipped,
            slack=taken.slack,
            marks=taken.marks,
            flags=("lower-case",) if octets != octets.upper() else (),
        )

    def _flush_noise(self, place: Place, count: int | None = None) -> None:
        """Give the first `count` octets held (all when None) as noise."""
        count = len(self._window) if count is None else count
        if not count:
            return
        taken = self._window.take(count)
        self._skipped += count
        reason = _reason(taken, place)
        self._out.append(Noise(taken.octets, taken.start, taken.end, place, reason, taken.marks))


def _reason(taken: Taken, place: Place) -> Reason:
    if not taken.octets.strip(b"\r\n"):
        return Reason.PAD
    if not taken.octets.strip(b"\0"):
        if any(LineError.BREAK in mark.error for mark in taken.marks):
            return Reason.BREAK
        if place is Place.AFTER:
            return Reason.ZEROS
    if taken.octets[0] == _COMMAND:
        return Reason.FALSE_START
    return Reason.NO_DELIMITER
