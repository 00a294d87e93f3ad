"""The window of the RTU framer: octets not given out yet, what stands round them, and giving them out.

framing.py decides what is a frame; here is what it knows, and what becomes of its decisions.
"""

from __future__ import annotations

from dissectors.checksums import crc16_modbus
from dissectors.frame import Check, Damage, Event, Flaw, FoundBy, Frame, Noise, Place, Reason, Repair
from dissectors.framer import UNKNOWN_SILENCE, OctetWindow
from dissectors.line import Timing
from dissectors.modbus.best_split import LIKELY, PROVED
from dissectors.modbus.candidates import SHORT_FRAME, Candidate, LengthGuess, octet_bits, readings
from dissectors.modbus.damaged import (
    ODD_LENGTH,
    DamagedFrame,
    Side,
    classify_leftover,
    cut_echo_of,
    levels_at_start,
    noise_place,
    noise_reason,
    predicted,
    zeros_at_start,
)
from dissectors.modbus.functions import ANSWER_LENGTHS, BROADCAST, EXCEPTION_BIT, is_open_length
from dissectors.modbus.lengths import MIN_FRAME
from dissectors.modbus.open_request import Expected, expectation
from dissectors.modbus.past import Past
from dissectors.modbus.repair import repaired

_ALL_AGREES = frozenset({Flaw.CHECK_SWAPPED, Flaw.FIRST_MISSING, Flaw.FIRST_SPOILT})


class RtuWindow:
    """What the framer holds. Positions count from the first octet ever fed, indices from the window's first.

    `octets`: the window. `base`: position of its first octet. `cuts`: positions of proved silences inside it.
    `end`: index at which silence or the end of the capture follows, None while octets may follow at once;
    `end_proved`: that it is silence. `units`: stations that good frames named. `expected`: the open request.
    `good_before`: a good frame stands directly before the window. `past`: what was said before.
    """

    __slots__ = (
        "_before",
        "_last_good",
        "_latency",
        "_octets",
        "_out",
        "_skipped",
        "_start",
        "_start_proved",
        "_t15",
        "_t35",
        "base",
        "cuts",
        "end",
        "end_proved",
        "expected",
        "good_before",
        "octets",
        "past",
        "units",
    )

    def __init__(self, timing: Timing, octets: OctetWindow) -> None:
        self._octets = octets
        self._t15, self._t35, self._latency = timing.t15, timing.t35, timing.latency
        self.octets = octets.octets
        self.base = 0
        self.cuts: list[int] = []
        self.end: int | None = None
        self.end_proved = False
        self.units: set[int] = set()
        self.expected: Expected | None = None
        self.good_before = False
        self.past = Past()
        self._last_good = b""
        self._out: list[Event] = []
        self._before = Side.SILENCE  # what stands directly before the window
        self._start: int | None = None  # evidence that a frame begins with the window; None until it is asked for
        self._start_proved = False
        self._skipped = 0

    def give(self) -> list[Event]:
        """The events since the last call."""
        if not self._out:
            return []
        out, self._out = self._out, []
        return out

    # --- what stands round a place ---------------------------------------------------------------------------------

    def readings(self, count: int) -> tuple[LengthGuess, ...]:
        """Predicted lengths of a frame that begins with the window, of which `count` octets are known."""
        return readings(self.octets, 0, count)

    def in_step(self) -> bool:
        """Whether the window begins where a frame may begin."""
        return self.good_before or self.start_bits() == PROVED

    def edge(self, position: int) -> int:
        """Bits of evidence that one frame ends, another begins at a position."""
        index = position - self.base
        if index == 0:
            return self.start_bits()
        if index == self.end or (self.cuts and position in self.cuts):
            return PROVED
        gap = self._octets.gap(index)
        return LIKELY if gap and gap - self._latency >= self._t15 else 0

    def inside(self, start: int, end: int) -> int:
        """Number of proved silences strictly between two positions."""
        return sum(start < cut < end for cut in self.cuts)

    def start_bits(self) -> int:
        """Evidence that a frame begins with the window; the begin of the capture is as good as silence."""
        if self._start is None:
            least, most = self._octets.silence(0)
            self._start_proved = least >= self._t35
            if self._start_proved or most >= UNKNOWN_SILENCE:
                self._start = PROVED
            else:
                self._start = LIKELY if least >= self._t15 else 0
        return self._start

    # --- giving out ------------------------------------------------------------------------------------------------

    def take_candidate(self, candidate: Candidate) -> None:
        before = candidate.start - self.base
        if before:
            self.take_rest(before, Side.FRAME)
        self.take_frame(candidate.length, candidate.request, candidate.response)

    def take_frame(self, count: int, request: bool, response: bool) -> None:
        """Give the first `count` octets as a frame with a good CRC."""
        found = self._found(count)
        octets, start, end, slack, marks = self._octets.take(count)
        expected: int | None = count
        flags: tuple[str, ...] = ()
        if not (request or response):  # its octets contradict its length, not its CRC
            expected, flags = predicted(octets), ODD_LENGTH
        elif is_open_length(octets):
            expected = None
        self._out.append(
            Frame(
                "modbus-rtu", octets, start, end, Check.GOOD, found, None, expected, self._skipped, slack, marks, flags
            )
        )
        self._skipped = 0
        self._taken(count, Side.FRAME)
        self.good_before = True
        self.expected = expectation(self.expected, octets, request, response)
        to_all = octets[0] == BROADCAST and not octets[1] & EXCEPTION_BIT  # nobody answers for all
        confirms = request and response and octets[1] in ANSWER_LENGTHS  # it says again what was asked
        self.past.note(octets, self.expected is not None or not response or to_all or confirms)
        self._last_good = octets
        self.units.add(octets[0])

    def take_rest(self, count: int, after: Side) -> None:
        """Give the first `count` octets as what no frame covers, in pieces between proved silences."""
        base = self.base
        for cut in [c for c in self.cuts if base < c <= base + count]:
            self._take_piece(cut - self.base, Side.SILENCE)
        left = base + count - self.base
        if left:
            self._take_piece(left, after)

    def _take_piece(self, count: int, after: Side) -> None:
        before = self._side_before()
        stretch = bytes(self.octets[:count])
        if self.good_before and before is Side.FRAME:
            zeros = zeros_at_start(stretch)
            if zeros == count or zeros > 1:
                self._note_stray_zeros(zeros)
                self._take_noise(zeros, before, after if zeros == count else Side.NOISE, Reason.ZEROS)
                if zeros == count:
                    return
                before, stretch, count = Side.NOISE, stretch[zeros:], count - zeros
        if level := self._level_before_answer(stretch, before):
            self._take_noise(level, before, Side.FRAME, None)
            stretch, count = stretch[level:], count - level
        heard = stretch[0] in self.units if self.units else None
        called = count > 1 and self.past.has_called(stretch[0], stretch[1] & ~EXCEPTION_BIT)
        hurt = classify_leftover(stretch, before, after, heard, called, self.expected)
        bounded = before is not Side.NOISE and after is not Side.NOISE
        if bounded and (echoed := cut_echo_of(stretch, self.expected)):
            self._take_damaged(count, DamagedFrame(echoed, Damage.SHORT), None)
        elif bounded and crc16_modbus(stretch) and (repair := repaired(stretch, self.expected, self.past, self.units)):
            self._take_repaired(count, repair)
        elif hurt is None:
            self._take_noise(count, before, after, None)
        elif not crc16_modbus(stretch):  # too weak to be found in a run of octets, but nothing else is beside it
            fits = [r for r in readings(stretch, 0, count) if r.length == count]
            self.take_frame(count, any(r.request for r in fits), any(r.response for r in fits))
        else:
            self._take_damaged(count, hurt, None)

    def _level_before_answer(self, stretch: bytes, before: Side) -> int:
        """How many octets FF or 00 stand before what begins as the awaited answer and is no good frame: a driver that
        was switched on late spoils the answer neither way."""
        awaited, level = self.expected, levels_at_start(stretch)
        if awaited is None or before is Side.NOISE or not 0 < level <= len(stretch) - MIN_FRAME:
            return 0
        return level if stretch[0] != awaited.unit and awaited.is_for(stretch, level) else 0

    def _take_repaired(self, count: int, repair: Repair) -> None:
        """Give a damaged frame that is known all the same. A request of which all of the check agrees is open now."""
        whole = repair.octets
        self._take_damaged(
            count, DamagedFrame(len(whole), Damage.CHECK if len(whole) == count else Damage.SHORT), repair
        )
        fits = [r for r in readings(whole, 0, len(whole)) if r.length == len(whole)]
        request = any(r.request for r in fits) or is_open_length(whole)
        if request and (repair.flaw in _ALL_AGREES or self.past.has_asked(whole)):
            response = any(r.response for r in fits) or is_open_length(whole)
            self.expected = expectation(self.expected, whole, request, response)

    def _note_stray_zeros(self, count: int) -> None:
        """Zeros follow a frame: they teach where no well-formed frame ends with them."""
        good = self._last_good
        if is_open_length(good):
            return
        whole = good + bytes(min(count, 2))
        for reading in readings(whole, 0, len(whole)):
            if len(good) < reading.length <= len(whole) and octet_bits(whole, 0, reading) >= SHORT_FRAME:
                return
        self.past.note_stray_zero()

    def _take_noise(self, count: int, before: Side, after: Side, reason: Reason | None) -> None:
        place = self._place(count, before, after)
        taken = self._octets.take(count)
        if reason is None:
            reason = noise_reason(taken.octets, taken.marks)
        self._taken(count, Side.NOISE)
        self._skipped += count
        self._out.append(Noise(taken.octets, taken.start, taken.end, place, reason, taken.marks))

    def _take_damaged(self, count: int, hurt: DamagedFrame, repair: Repair | None) -> None:
        found = self._found(count)
        octets, start, end, slack, marks = self._octets.take(count)
        check = Check.ABSENT if hurt.damage is Damage.SHORT else Check.BAD
        skipped, self._skipped = self._skipped, 0
        self._out.append(
            Frame(
                "modbus-rtu",
                octets,
                start,
                end,
                check,
                found,
                hurt.damage,
                hurt.expected,
                skipped,
                slack,
                marks,
                repair=repair,
            )
        )
        self._taken(count, Side.FRAME)

    def _taken(self, count: int, kind: Side) -> None:
        self.base += count
        self._before, self.good_before, self._start = kind, False, None
        if self.end is not None:
            self.end -= count
        if self.cuts:
            self.cuts = [cut for cut in self.cuts if cut > self.base]

    def _found(self, count: int) -> FoundBy:
        base, ends = self.base, self.end == count
        if self.cuts:
            if self.inside(base, base + count):
                return FoundBy.JOINED
            end_proved = (ends and self.end_proved) or base + count in self.cuts
        else:
            end_proved = ends and self.end_proved
        if end_proved:
            self.start_bits()  # it says whether silence before is proved, too
            if self._start_proved:
                return FoundBy.GAP
        touched = self._octets.gap(0) < self._t15 or (not ends and self._octets.gap(count) < self._t15)
        return FoundBy.SPLIT if touched else FoundBy.LENGTH

    def _side_before(self) -> Side:
        return Side.SILENCE if self.start_bits() == PROVED else self._before

    def _place(self, count: int, before: Side, after: Side) -> Place:
        gap_after = self._octets.gap(count) if after is Side.FRAME else 0
        return noise_place(before, after, self._octets.gap(0), gap_after)
