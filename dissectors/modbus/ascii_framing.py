"""Modbus ASCII framing: characters between ':' and CR LF.

    ':' unit(2) function(2) data(2 each) LRC(2) CR LF          each octet as two hex digits, at most 513 characters

Rules (Modbus over Serial Line V1.02, 2.5.2):

1. ':' begins a frame, always; a frame that it cuts off is damaged ("restarted").
2. CR and the character after it end the frame. That is LF, or what function 08/0003 made it for the frame's station.
   A CR followed by anything else ends it too, flagged: some devices send no LF. An LF without CR ends a damaged one.
3. Silence of more than 1 s inside a frame ends it, damaged. No other silence means anything.
4. A frame is good when its characters are hex digits in pairs and its LRC is right. Lower case is accepted and
   flagged. So is bit 7 where it behaves as a parity bit (a line of 7 data bits read with 8).
5. A ':' without a station after it, and whatever stands outside frames, is noise.
6. Hex pairs with a right LRC and the length that their function predicts are a damaged frame, and known, if ':' or
   another character in its place, or CR LF is all that they lack.
"""

from __future__ import annotations

import re
from binascii import unhexlify
from typing import TYPE_CHECKING, Final

from dissectors.checksums import sum8
from dissectors.frame import Check, Chunk, Damage, Event, Flaw, FoundBy, Frame, LineError, Noise, Reason, Repair
from dissectors.framer import UNKNOWN_SILENCE, OctetWindow
from dissectors.line import NS_PER_S, Timing
from dissectors.modbus.damaged import ODD_LENGTH, Side, noise_place, predicted
from dissectors.modbus.functions import DIAGNOSTIC_DELIMITER, ascii_length, is_open_length

if TYPE_CHECKING:
    from dissectors.columns import FrameColumns, Octets
    from dissectors.framer import Framer

MAX_CHARACTERS: Final = 513
LONGEST_SILENCE: Final = NS_PER_S
"""ns of silence that a frame may contain (2.5.2.1)."""

MAX_NOISE: Final = 256

_CR, _LF = 0x0D, 0x0A
_MAX_FOREIGN = 8  # characters inside a frame that are no hex digits, before it is given up: a burst is not longer
_DIAGNOSTICS = 0x08


def _with_bit_7(characters: bytes) -> bytes:
    return re.escape(characters) + re.escape(bytes(c | 0x80 for c in characters))


_START = re.compile(b"[%s]" % _with_bit_7(b":"))
_NO_DIGIT = re.compile(b"[^%s]" % _with_bit_7(b"0123456789ABCDEFabcdef"))
_BIT_7_OFF = bytes(c & 0x7F for c in range(256))
_BARE = re.compile(rb"(?<![0-9A-Fa-f])[0-9A-Fa-f]?((?:[0-9A-Fa-f]{2}){3,}\r\n)")
_PAIRS = re.compile(rb"(?:[0-9A-Fa-f]{2})+")
_ODD_PARITY = bytes(c for c in range(256) if c.bit_count() & 1)
_EVEN_PARITY = bytes(c for c in range(256) if not c.bit_count() & 1)
_HIGH = bytes(range(0x80, 0x100))


class AsciiFramer:
    """Characters and times in, ASCII frames and noise out. `Frame.octets` are the characters as they came."""

    protocol = "modbus-ascii"
    primed = 6

    def __init__(self, timing: Timing) -> None:
        self._window = OctetWindow(timing)
        self._seven_bits = timing.line.data_bits == 7
        self._t35 = timing.t35
        self._inside = False  # the window begins with the start of a frame; else with noise
        self._at = 0  # characters before this index have been looked at
        self._foreign = 0
        self._delimiters: dict[int, int] = {}  # of the stations where it is not LF
        self._change: bytes | None = None  # a request to change one, not answered yet
        self._before = Side.SILENCE
        self._skipped = 0
        self._out: list[Event] = []

    # --- the framer contract ---------------------------------------------------------------------------------------

    def feed(self, chunk: Chunk) -> list[Event]:
        """Take one read; give the events it completes, in order."""
        if not chunk.octets:
            return self.advance(chunk.time)
        silence = self._window.least_silence_before(chunk)
        if silence is not None:
            self._hear_silence(silence)
        self._window.append(chunk)
        octets = self._window.octets
        while self._at < len(octets) and (self._scan_frame() if self._inside else self._scan_noise()):
            pass
        return self._give()

    def advance(self, now: int) -> list[Event]:
        """Say that no read returned up to `now` (ns); give what the silence completes."""
        silence = self._window.least_silence_at(now)
        if silence is not None:
            self._hear_silence(silence)
        return self._give()

    def close(self) -> list[Event]:
        """End of capture: give everything still held."""
        if self._inside:
            self._end_early(Damage.SHORT)
        if len(self._window):
            self._take_noise(len(self._window), Side.SILENCE)
        return self._give()

    def deadline(self) -> int | None:
        """When silence will mean something next (ns), or None when it never will."""
        if not len(self._window):
            return None
        return self._window.proves_silence(LONGEST_SILENCE + 1 if self._inside else self._t35)

    def remember(self, earlier: Framer, frames: FrameColumns, octets: Octets, begin: int, end: int) -> None:
        """See `dissectors.columns.Remembering`: what stations made of their end characters stays."""
        assert isinstance(earlier, AsciiFramer)
        self._delimiters = dict(earlier._delimiters)
        self._change = None if begin < end else earlier._change

    def _give(self) -> list[Event]:
        out, self._out = self._out, []
        return out

    # --- finding the limits ----------------------------------------------------------------------------------------

    def _hear_silence(self, silence: int) -> None:
        if not len(self._window):
            return
        if not self._inside:
            if silence >= self._t35:
                pending = self._at < len(self._window)  # a start, and not yet two characters after it
                self._take_noise(self._at if pending else len(self._window), Side.FRAME if pending else Side.SILENCE)
                if pending:
                    self._begin_frame()
        elif silence > LONGEST_SILENCE:
            self._end_early(Damage.TIMEOUT)

    def _end_early(self, damage: Damage) -> None:
        """Silence, or the end of the capture, ends the frame."""
        count = len(self._window)
        if self._window.octets[count - 1] & 0x7F == _CR and self._at == count - 1:
            self._take_ended(count, count - 1)  # the CR was all there is
        else:
            self._take_broken(count, damage, Side.SILENCE)

    def _scan_noise(self) -> bool:
        """Look for the start of a frame; whether the scan may go on."""
        octets = self._window.octets
        match = _START.search(octets, self._at)
        end = match.start() if match else len(octets)
        if end >= MAX_NOISE:
            self._take_noise(MAX_NOISE, Side.NOISE)
            return True
        if match is None:
            self._at = end
            return False
        if end:  # noise goes on until a start with a station after it
            station = octets[end + 1 : end + 3]
            if _NO_DIGIT.search(station):
                self._at = end + 1
                return True
            if len(station) < 2:
                self._at = end
                return False
            self._take_noise(end, Side.FRAME)
        self._begin_frame()
        return True

    def _begin_frame(self) -> None:
        self._inside, self._at, self._foreign = True, 1, 0

    def _go_on_as_noise(self, count: int) -> None:
        """The first `count` characters of the window are no frame; what follows is not known yet."""
        self._inside, self._at = False, count

    def _scan_frame(self) -> bool:
        """Look for the end of the frame; whether the scan may go on."""
        octets = self._window.octets
        match = _NO_DIGIT.search(octets, self._at, MAX_CHARACTERS - 1)
        if match is None:
            if len(octets) < MAX_CHARACTERS - 1:
                self._at = len(octets)
                return False
            self._take_broken(MAX_CHARACTERS - 1, Damage.LONG, Side.NOISE)
            return True
        at = match.start()
        character = octets[at] & 0x7F
        if character == _CR:
            if at + 1 == len(octets):
                self._at = at
                return False
            follows = octets[at + 1] & 0x7F
            self._take_ended(at + 2 if follows in (_LF, self._delimiter()) else at + 1, at)
        elif character == _LF:
            self._take_ended(at + 1, at)
        elif octets[at] == octets[0] or (character == 0x3A and self._seven_bits):
            if at <= 2:
                self._go_on_as_noise(at)
            else:
                self._take_broken(at, Damage.RESTARTED, Side.FRAME)
        elif at <= 2:
            self._go_on_as_noise(at)
        else:
            self._at = at + 1
            self._foreign += 1
            if self._foreign > _MAX_FOREIGN:
                self._take_broken(at + 1, Damage.FORM, Side.NOISE)
        return True

    def _delimiter(self) -> int:
        unit = self._unit()
        return _LF if unit is None else self._delimiters.get(unit, _LF)

    def _unit(self) -> int | None:
        """The station that the frame at the begin of the window names."""
        pair = bytes(self._window.octets[1:3]).translate(_BIT_7_OFF)
        return int(pair, 16) if len(pair) == 2 and _PAIRS.fullmatch(pair) else None

    # --- giving out ------------------------------------------------------------------------------------------------

    def _take_ended(self, count: int, digits_end: int) -> None:
        """Give a frame that its end characters end; they begin at `digits_end`."""
        if self._unit() is None:
            self._go_on_as_noise(count)
            return
        raw = bytes(self._window.octets[:count])
        plain = raw.translate(_BIT_7_OFF)
        digits, ending = plain[1:digits_end], plain[digits_end:]
        flags = set()
        if digits != digits.upper():
            flags.add("lower-case")
        if ending == b"\r":
            flags.add("cr-only")
        elif ending == b"\n":
            flags.add("lf-only")
        elif ending != b"\r\n":
            flags.add("own-delimiter")
        formed = _PAIRS.fullmatch(digits) is not None
        if plain != raw and not self._seven_bits:
            if _is_parity(raw):
                flags.add("parity-bit")
            else:
                formed = False
        body = unhexlify(digits) if formed else b""
        check, damage, length = _judge(body, formed)
        if damage is None and ending == b"\n":
            damage = Damage.FORM
        expected = None if length is None else ascii_length(length) - 2 + len(ending)
        if check is Check.GOOD and expected not in (None, count):
            flags.update(ODD_LENGTH)
        self._take(count, check, damage, expected, tuple(sorted(flags)))
        if damage is None:
            self._track_delimiter(body)

    def _take_broken(self, count: int, damage: Damage, after: Side) -> None:
        """Give a frame without its end."""
        if self._unit() is None:
            self._take_noise(count, after)
            return
        whole = bytes(self._window.octets[:count]) + b"\r\n"
        repair = None if _message(whole) is None else Repair(Flaw.LAST_TWO_MISSING, whole)
        self._take(count, Check.ABSENT, damage, None if repair is None else len(whole), (), repair)

    def _take(
        self,
        count: int,
        check: Check,
        damage: Damage | None,
        expected: int | None,
        flags: tuple[str, ...],
        repair: Repair | None = None,
    ) -> None:
        octets, start, end, slack, marks = self._window.take(count)
        skipped, self._skipped = self._skipped, 0
        self._out.append(
            Frame(
                self.protocol,
                octets,
                start,
                end,
                check,
                FoundBy.DELIMITER,
                damage,
                expected,
                skipped,
                slack,
                marks,
                flags,
                repair,
            )
        )
        self._inside, self._at, self._before = False, 0, Side.FRAME

    def _take_noise(self, count: int, after: Side) -> None:
        """Give the first `count` characters as noise, but for frames among them that lack their start."""
        stretch = bytes(self._window.octets[:count])
        if b"\r" in stretch or b"\x8d" in stretch:
            plain = stretch.translate(_BIT_7_OFF)
            taken = 0
            for match in _BARE.finditer(plain):
                begin, end = match.span(1)
                flaw = Flaw.FIRST_MISSING
                if begin > taken:  # the character before stands where the start should
                    flaw, begin = Flaw.FIRST_SPOILT, begin - 1
                whole = b":" + match[1]
                if _message(whole) is None:
                    continue
                if begin > taken:
                    self._take_piece(begin - taken, Side.FRAME)
                self._take(end - begin, Check.GOOD, Damage.FORM, len(whole), (), Repair(flaw, whole))
                taken = end
            count -= taken
        if count:
            self._take_piece(count, after)
        self._inside, self._at = False, 0

    def _take_piece(self, count: int, after: Side) -> None:
        window = self._window
        reason = Reason.FALSE_START if _START.match(window.octets) else Reason.NO_DELIMITER
        least, most = window.silence(0)
        before = Side.SILENCE if least >= self._t35 or most >= UNKNOWN_SILENCE else self._before
        if after is Side.FRAME and window.silence(count)[0] >= self._t35:
            after = Side.SILENCE  # a start that nothing came of, and the next frame long after it
        place = noise_place(before, after, window.gap(0), window.gap(count) if after is Side.FRAME else 0)
        octets, start, end, _, marks = window.take(count)
        if not octets.strip(b"\0") and any(mark.error & LineError.BREAK for mark in marks):
            reason = Reason.BREAK
        self._out.append(Noise(octets, start, end, place, reason, marks))
        self._skipped += count
        self._before = Side.NOISE

    def _track_delimiter(self, body: bytes) -> None:
        """Function 08/0003, asked and echoed, changes the end character of its station (V1.1b3, 6.8)."""
        asked, self._change = self._change, None
        if len(body) == 7 and body[1] == _DIAGNOSTICS and body[2:4] == bytes((0, DIAGNOSTIC_DELIMITER)):
            if body != asked:
                self._change = body
            elif body[4] & 0x7F == _LF:
                self._delimiters.pop(body[0], None)
            else:
                self._delimiters[body[0]] = body[4] & 0x7F


def _judge(body: bytes, formed: bool) -> tuple[Check, Damage | None, int | None]:
    """The verdict on a frame's octets (LRC included), and the predicted length that it should have had, as RTU."""
    if not formed:
        return Check.BAD, Damage.FORM, None
    if len(body) < 3:
        return Check.ABSENT, Damage.SHORT, None
    own = len(body) + 1  # as an RTU frame, whose check has one octet more
    right = None if is_open_length(body) else predicted(body + b"\0")
    if not sum8(body):
        return Check.GOOD, None, right
    if right is None or right == own:
        return Check.BAD, Damage.CHECK, right
    return Check.BAD, Damage.SHORT if own < right else Damage.LONG, right


def _message(whole: bytes) -> bytes | None:
    """Unit, PDU and LRC of a whole frame, where all is right with it and its function predicts its length."""
    digits = whole.translate(_BIT_7_OFF)[1:-2]
    if len(digits) < 6 or not _PAIRS.fullmatch(digits):
        return None
    body = unhexlify(digits)
    check, _, length = _judge(body, True)
    return body if check is Check.GOOD and length == len(body) + 1 else None


def _is_parity(raw: bytes) -> bool:
    """Whether bit 7 of all characters is even or odd parity of the others, or always set."""
    return any(not raw.translate(None, fitting) for fitting in (_EVEN_PARITY, _ODD_PARITY, _HIGH))
