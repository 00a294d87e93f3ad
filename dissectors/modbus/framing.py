"""Modbus RTU framing: silence proposes, predicted length and CRC dispose.

    [unit 1][function 1][data 0 … 252][CRC lo][CRC hi]     3.5 characters of silence before and after

No PC sees that silence reliably: adapters merge several frames into one read, cut one into pieces, and noise lies
in the gaps. So the framer works on octets with times, and never on chunks:

1. At the begin of the window, where a frame may begin (after a good frame, after proved silence), the predicted
   lengths of its function code are tried. A good one is taken as soon as the octet after it has come, unless a
   longer reading of the same octets is still open and would be the better one.
2. Where that finds nothing, all candidates of the window are weighed and the best segmentation wins
   (candidates.py, segmentation.py), at window lengths that depend on the octets alone.
3. Proved silence of 3.5 characters settles everything before it at once; only a tail that begins like a frame and is
   not complete is held, for `hold` ns of silence at most, in case a late read cut the frame in two.
4. Without silence the window never grows beyond WINDOW octets.
5. What is left over is a damaged frame of a station, or noise (remains.py).

Every decision depends on octets, their nominal times and proved silences only, so other chunks give the same events.
"""

from __future__ import annotations

from typing import Final

from dissectors.checksums import crc16_modbus
from dissectors.frame import Check, Chunk, Damage, Event, Found, Frame, Noise, Place, Reason
from dissectors.framer import UNKNOWN_SILENCE, OctetWindow
from dissectors.line import Timing
from dissectors.modbus.candidates import (
    CRC_BITS,
    ZERO_TAIL,
    Candidate,
    CandidateFinder,
    Reading,
    octet_bits,
    octet_hope,
    readings,
    whole_stretch,
    zeros_follow_good,
)
from dissectors.modbus.expectation import Expected, expectation
from dissectors.modbus.functions import BROADCAST, EXCEPTION_BIT, FUNCTIONS, MAX_FRAME, MAX_UNIT, MORE, is_open_length
from dissectors.modbus.remains import (
    ODD_LENGTH,
    Injury,
    Side,
    injury,
    noise_place,
    noise_reason,
    predicted,
    zeros_at_start,
)
from dissectors.modbus.segmentation import (
    ADJACENT,
    HEARD,
    LIKELY,
    PROVED,
    SILENCE_INSIDE,
    segment,
    worth,
)

WINDOW: Final = 2 * MAX_FRAME
"""Most octets held without silence: then all but the last MAX_FRAME are given out."""

_FIRST = 9  # a first look at a window: the commonest frame and the octet after it
_STEP = 32  # octets between looks at a window that does not begin with a frame
_PATIENT_STEP = 64  # the same while its begin may still become one
_MOST_CUTS = 3
_HOLD = 20_000_000


class RtuFramer:
    """Octets and times in, RTU frames and noise out.

    `hold`: ns of silence after which an incomplete frame is given up: twice t3.5, the latency, or 20 ms, whichever
    is longest. Reads come that late on a loaded host; a response 20 ms after a broken request is still told apart.
    """

    protocol = "modbus-rtu"

    def __init__(self, timing: Timing) -> None:
        self.hold = max(2 * timing.t35, timing.latency, _HOLD)
        self._t15, self._t35 = timing.t15, timing.t35
        self._window = OctetWindow(timing)
        self._finder = CandidateFinder()
        self._cuts: list[int] = []  # positions of proved silences inside the window
        self._next = _FIRST  # window length at which to look again
        self._settled = False  # the silence after the newest octet has been dealt with
        self._end: int | None = None  # index at which the known octets end in silence
        self._end_proved = False
        self._units: set[int] = set()
        self._expected: Expected | None = None
        self._before = Side.SILENCE  # what was given last, directly before the window
        self._good_before = False  # … and it was a good frame
        self._start: int | None = None  # evidence that a frame begins with the window; None until it is asked for
        self._start_proved = False
        self._skipped = 0
        self._out: list[Event] = []

    # --- the framer contract ---------------------------------------------------------------------------------------

    def feed(self, chunk: Chunk) -> list[Event]:
        """Take one read; give the events it completes, in order."""
        if not chunk.octets:
            return self.advance(chunk.time)
        window = self._window
        silence = window.least_silence_before(chunk)
        if silence is not None and silence >= self._t35:
            self._hear_silence(silence)
        window.append(chunk)
        self._settled = False
        octets = window.octets
        while len(octets) >= self._next:
            self._look(self._next)
        return self._give() if self._out else []

    def advance(self, now: int) -> list[Event]:
        """Say that no read returned up to `now` (ns); give what the silence completes."""
        silence = self._window.least_silence_at(now)
        if silence is not None and silence >= self._t35:
            self._hear_silence(silence)
        return self._give()

    def close(self) -> list[Event]:
        """End of capture: give everything still held."""
        self._settle(hold=False, proved=False)
        return self._give()

    def deadline(self) -> int | None:
        """When silence will mean something next (ns), or None when it never will."""
        if not len(self._window):
            return None
        return self._window.proves_silence(self.hold if self._settled else self._t35)

    def _give(self) -> list[Event]:
        out, self._out = self._out, []
        return out

    # --- when to decide --------------------------------------------------------------------------------------------

    def _hear_silence(self, silence: int) -> None:
        if not self._settled:
            self._settled = True
            self._settle(hold=True, proved=True)
        if silence >= self.hold:
            self._settle(hold=False, proved=True)

    def _settle(self, *, hold: bool, proved: bool) -> None:
        """Give everything: silence (or the end of the capture) follows. With `hold`, keep a tail that may go on."""
        octets = self._window.octets
        self._end, self._end_proved = len(octets), proved
        if octets and not self._cuts and self._take_whole(octets):
            self._end = None
            self._next = _FIRST
            return
        while octets and self._in_step() and self._take_head(readings(octets, 0, len(octets)), len(octets), hold):
            pass
        if octets:
            path, agreed = self._segment(len(octets))
            if not hold or (path and path[-1].end == self._finder.base + len(octets)):
                agreed = path  # a good frame that ends with the silence waits for nothing
            for candidate in agreed:
                self._take_candidate(candidate)
            if octets and hold:
                if self._may_go_on():
                    self._cuts.append(self._finder.base + len(octets))
                    self._end = None
                    self._next = max(_FIRST, len(octets) + 1)
                    return
                for candidate in path[len(agreed) :]:
                    self._take_candidate(candidate)
            if octets:
                self._take_rest(len(octets), Side.SILENCE)
        self._end = None
        self._next = _FIRST

    def _look(self, count: int) -> None:
        """Look at the first `count` octets of a window that goes on: commit what is certain, choose the next look."""
        base = self._finder.base
        found = readings(self._window.octets, 0, count) if self._in_step() else ()
        if found and self._take_head(found, count, True):
            self._next = max(_FIRST, count - self._finder.base + base)
            return
        wait = WINDOW + 1  # until the shortest reading of the head that is still open is complete
        for length, _, _ in found:
            if length >= count or length == MORE:
                wait = min(wait, length + 1 if length != MORE else WINDOW)
        if wait > WINDOW or count > _FIRST:
            for candidate in self._segment(count - 1)[1]:
                self._take_candidate(candidate)
            if self._finder.base == base and count >= WINDOW:
                self._take_rest(count - MAX_FRAME, Side.NOISE)
            if self._finder.base > base:
                self._next = max(_FIRST, count - self._finder.base + base)
                return
        self._next = min(wait, count + (_STEP if wait > WINDOW else _PATIENT_STEP), WINDOW)

    def _may_go_on(self) -> bool:
        """Whether the window, before a silence, looks like the first part of a frame that a late read cut."""
        octets = self._window.octets
        count = len(octets)
        if count >= MAX_FRAME or len(self._cuts) >= _MOST_CUTS or not self._in_step():
            return False
        unit = octets[0]
        if count == 1:
            return BROADCAST < unit <= MAX_UNIT or unit in self._units
        awaited = self._expected
        if awaited is not None and awaited.unit == unit and awaited.length is not None:
            if awaited.length == count:
                return False  # complete, and damaged
            if octets[1] == awaited.function and count < awaited.length:
                return True
        lengths = [r.length for r in readings(octets, 0, count)]
        if unit == BROADCAST and lengths and not FUNCTIONS[octets[1] & ~EXCEPTION_BIT].writes:
            return False
        return count not in lengths and any(n == MORE or n > count for n in lengths)

    # --- what to decide --------------------------------------------------------------------------------------------

    def _in_step(self) -> bool:
        """Whether the window begins where a frame may begin."""
        return self._good_before or self._start_bits() == PROVED

    def _take_whole(self, octets: bytearray) -> bool:
        """Take the window as one frame if it has silence on both sides, a predicted length and a good CRC.

        This is what a healthy bus on a good adapter gives; the general way would find the same, more slowly.
        """
        count = len(octets)
        if not octets[-1] or count > MAX_FRAME or self._start_bits() != PROVED:
            return False
        whole = bytes(octets)
        if crc16_modbus(whole):
            return False
        for length, request, response in readings(whole, 0, count):
            if length == count:
                self._take_frame(count, request, response)
                return True
        return False

    def _take_head(self, found: tuple[Reading, ...], count: int, hope: bool) -> bool:
        """Take the frame that the window begins with, if a reading of it is good and none still open is better.

        `found`: the readings of the head; `hope`: whether those that are not complete count.
        """
        octets, expected, end = self._window.octets, self._expected, self._end
        best: Reading | None = None
        best_worth = -1
        hopes = None
        for reading in found:
            length = reading.length
            if MORE < length < count or length == end:
                stretch = bytes(octets[:length])
                if crc16_modbus(stretch):
                    continue
                bits = CRC_BITS + octet_bits(stretch, 0, reading) + self.edge(self._finder.base + length)
                if not stretch[-1] and zeros_follow_good(stretch):
                    bits += ZERO_TAIL
                if expected is not None:
                    bits += expected.fit(stretch, 0, length)
                own = self._worth(bits, length)
                if own > best_worth:
                    best, best_worth = reading, own
            else:
                hopes = reading  # of two readings only the longer can be the one that is open
        if best is None:
            return False
        if hope and hopes is not None and best.length != end and self._hope(hopes, count) > best_worth:
            return False
        self._take_frame(best.length, best.request, best.response)
        return True

    def _hope(self, reading: Reading, count: int) -> int:
        """What the head may be worth once it is complete."""
        octets = self._window.octets
        length = reading.length if reading.length != MORE else count + 1
        bits = CRC_BITS + octet_hope(octets, 0, reading)
        if self._expected is not None:
            bits += self._expected.hope(octets, 0, length)
        return self._worth(bits, length)

    def _worth(self, bits: int, length: int) -> int:
        """Worth of a frame at the head of the window, by the rules of segmentation.py."""
        bits += self._start_bits() if not self._good_before else ADJACENT
        if self._window.octets[0] in self._units:
            bits += HEARD
        if self._cuts:
            bits += SILENCE_INSIDE * self.inside(self._finder.base, self._finder.base + length)
        return worth(bits, length)

    def _segment(self, count: int) -> tuple[list[Candidate], list[Candidate]]:
        """Best segmentation of the first `count` octets: its frames, and those that nothing to come can undo."""
        octets, finder = self._window.octets, self._finder
        finder.look(octets, count)
        found = finder.good
        if self._end is not None:
            found = found + self._whole_stretches(count)
        if not found:
            return [], []
        return segment(octets, finder.base, count, found, finder.pending(), self, self._expected, self._good_before)

    def _whole_stretches(self, count: int) -> list[Candidate]:
        """All octets between two silences: how functions are found that predict no length."""
        base, octets = self._finder.base, self._window.octets
        starts = [cut - base for cut in self._cuts]
        if self._start_bits() == PROVED:
            starts.append(0)
        found = (whole_stretch(octets, start, count, base + start) for start in starts)
        return [candidate for candidate in found if candidate is not None]

    # --- surroundings, for segmentation.py -------------------------------------------------------------------------

    def edge(self, position: int) -> int:
        """Bits of evidence that one frame ends, another begins at a position."""
        index = position - self._finder.base
        if index == 0:
            return self._start_bits()
        if index == self._end or (self._cuts and position in self._cuts):
            return PROVED
        return LIKELY if self._window.silence(index)[0] >= self._t15 else 0

    def inside(self, start: int, end: int) -> int:
        """Number of proved silences strictly between two positions."""
        return sum(start < cut < end for cut in self._cuts)

    def heard(self, unit: int) -> bool:
        """Whether good frames named this station."""
        return unit in self._units

    def _start_bits(self) -> int:
        """Evidence that a frame begins with the window; the begin of the capture is as good as silence."""
        if self._start is None:
            least, most = self._window.silence(0)
            self._start_proved = least >= self._t35
            if self._start_proved or most >= UNKNOWN_SILENCE:
                self._start = PROVED
            else:
                self._start = LIKELY if least >= self._t15 else 0
        return self._start

    # --- giving out ------------------------------------------------------------------------------------------------

    def _take_candidate(self, candidate: Candidate) -> None:
        before = candidate.start - self._finder.base
        if before:
            self._take_rest(before, Side.FRAME)
        self._take_frame(candidate.length, candidate.request, candidate.response)

    def _take_frame(self, count: int, request: bool, response: bool) -> None:
        """Give the first `count` octets as a frame with a good CRC."""
        found = self._found(count)
        octets, start, end, slack, marks = self._window.take(count)
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
        self._good_before = True
        self._expected = expectation(self._expected, octets, request, response)
        self._units.add(octets[0])

    def _take_rest(self, count: int, after: Side) -> None:
        """Give the first `count` octets as what no frame covers, in pieces between proved silences."""
        base = self._finder.base
        for cut in [c for c in self._cuts if base < c <= base + count]:
            self._take_piece(cut - self._finder.base, Side.SILENCE)
        left = base + count - self._finder.base
        if left:
            self._take_piece(left, after)

    def _take_piece(self, count: int, after: Side) -> None:
        before = self._side_before()
        stretch = bytes(self._window.octets[:count])
        if self._good_before and before is Side.FRAME:
            zeros = zeros_at_start(stretch)
            if zeros == count or zeros > 1:
                self._take_noise(zeros, before, after if zeros == count else Side.NOISE, Reason.ZEROS)
                if zeros == count:
                    return
                before, stretch, count = Side.NOISE, stretch[zeros:], count - zeros
        heard = stretch[0] in self._units if self._units else None
        hurt = injury(stretch, before, after, heard, self._expected)
        if hurt is None:
            self._take_noise(count, before, after, None)
        elif not crc16_modbus(stretch):  # too weak to be found in a run of octets, but nothing else is beside it
            fits = [r for r in readings(stretch, 0, count) if r.length == count]
            self._take_frame(count, any(r.request for r in fits), any(r.response for r in fits))
        else:
            self._take_damaged(count, hurt)

    def _take_noise(self, count: int, before: Side, after: Side, reason: Reason | None) -> None:
        place = self._place(count, before, after)
        taken = self._window.take(count)
        if reason is None:
            reason = noise_reason(taken.octets, taken.marks)
        self._taken(count, Side.NOISE)
        self._skipped += count
        self._out.append(Noise(taken.octets, taken.start, taken.end, place, reason, taken.marks))

    def _take_damaged(self, count: int, hurt: Injury) -> None:
        found = self._found(count)
        octets, start, end, slack, marks = self._window.take(count)
        check = Check.ABSENT if hurt.damage is Damage.SHORT else Check.BAD
        self._out.append(
            Frame(
                "modbus-rtu", octets, start, end, check, found, hurt.damage, hurt.expected, self._skipped, slack, marks
            )
        )
        self._skipped = 0
        self._taken(count, Side.FRAME)

    def _taken(self, count: int, kind: Side) -> None:
        self._finder.drop(count)
        self._before, self._good_before, self._start = kind, False, None
        if self._end is not None:
            self._end -= count
        if self._cuts:
            self._cuts = [cut for cut in self._cuts if cut > self._finder.base]

    def _found(self, count: int) -> Found:
        window, base, ends = self._window, self._finder.base, self._end == count
        self._start_bits()
        if self._cuts:
            if self.inside(base, base + count):
                return Found.JOINED
            end_proved = (ends and self._end_proved) or base + count in self._cuts
        else:
            end_proved = ends and self._end_proved
        if end_proved and self._start_proved:
            return Found.GAP
        touched = window.gap(0) < self._t15 or (not ends and window.gap(count) < self._t15)
        return Found.SPLIT if touched else Found.LENGTH

    def _side_before(self) -> Side:
        return Side.SILENCE if self._start_bits() == PROVED else self._before

    def _place(self, count: int, before: Side, after: Side) -> Place:
        gap_after = self._window.gap(count) if after is Side.FRAME else 0
        return noise_place(before, after, self._window.gap(0), gap_after)
