"""Modbus RTU framing: silence proposes, predicted length and CRC dispose.

    [unit 1][function 1][data 0 … 252][CRC lo][CRC hi]     3.5 characters of silence before and after

No PC sees that silence reliably: adapters merge several frames into one read, cut one into pieces, and noise lies
in the gaps. So the framer works on octets with times, and never on chunks:

1. Proved silence of 3.5 characters settles everything before it at once. Only a tail that begins like a frame and is
   not complete is held, for `hold` ns of silence at most, in case a late read cut the frame in two.
2. Where a frame may begin (after silence, after a good frame), the lengths that its function code predicts are tried,
   as request and as response. A good one is taken, unless a longer reading of the same octets is still open and would
   be the better one. Without silence this waits for the next look, at most _FIRST octets later.
3. Where that finds nothing, all candidates of the window are weighed and the best segmentation wins
   (candidates.py, best_split.py, open_request.py).
4. Without silence the window is looked at when it has certain lengths, and never grows beyond WINDOW octets.
5. What is left over is a damaged frame of a station, or noise (damaged.py).

Every decision depends on octets, their nominal times and proved silences only, so other chunks give the same events.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from dissectors.checksums import crc16_modbus
from dissectors.frame import Chunk, Event
from dissectors.framer import Framer, OctetWindow
from dissectors.line import Timing
from dissectors.modbus.best_split import ADJACENT, HEARD, PROVED, SILENCE_INSIDE, Paths, worth
from dissectors.modbus.candidates import (
    ANY_END,
    CRC_BITS,
    Candidate,
    CandidateFinder,
    LengthGuess,
    begins_good,
    exception_bits,
    is_text,
    lacks_zeros,
    octet_bits,
    octet_hope,
    readings,
    whole_stretch,
)
from dissectors.modbus.damaged import Side, levels_at_start
from dissectors.modbus.functions import BROADCAST, EXCEPTION_BIT, FUNCTIONS, MAX_UNIT, is_open_length
from dissectors.modbus.lengths import MAX_FRAME, MORE
from dissectors.modbus.open_length import OpenLengthFinder, settled_end
from dissectors.modbus.open_request import EXACT, expectation
from dissectors.modbus.past import KNOWN_LENGTH
from dissectors.modbus.rtu_window import RtuWindow

if TYPE_CHECKING:
    from dissectors.columns import FrameColumns, Octets

WINDOW: Final = 2 * MAX_FRAME
"""Most octets held without silence: then all but the last MAX_FRAME are given out."""

_FIRST = 24  # a first look at a window: on a bus with silences most frames need none
_FIRST_OPEN = 96  # the same where nothing predicts the length of what the window begins with
_STEP = 32  # fewest octets between looks at a window that does not begin with a frame
_PATIENT_STEP = 64  # the same while its begin may still become one
_MOST_CUTS = 3  # silences over which a frame is pieced together
_HOLD = 20_000_000


class RtuFramer:
    """Octets and times in, RTU frames and noise out.

    `hold`: ns of silence after which an incomplete frame is given up: twice t3.5, the latency, or 20 ms, whichever
    is longest. Reads come that late on a loaded host; a response 20 ms after a broken request is still told apart.
    """

    protocol = "modbus-rtu"
    primed = 2  # an exchange: all else it is told

    def __init__(self, timing: Timing) -> None:
        self.hold = max(2 * timing.t35, timing.latency, _HOLD)
        self._t35 = timing.t35
        self._times = OctetWindow(timing)
        self._window = RtuWindow(timing, self._times)
        self._finder = CandidateFinder()
        self._open = OpenLengthFinder()
        self._paths = Paths(self._window)
        self._added = 0  # candidates of the finder that the paths have taken in
        self._next = _FIRST  # window length at which to look again
        self._settled = False  # the silence after the newest octet has been dealt with

    # --- the framer contract ---------------------------------------------------------------------------------------

    def feed(self, chunk: Chunk) -> list[Event]:
        """Take one read; give the events it completes, in order."""
        if not chunk.octets:
            return self.advance(chunk.time)
        silence = self._times.least_silence_before(chunk)
        if silence is not None and silence >= self._t35:
            self._hear_silence(silence)
        self._times.append(chunk)
        self._settled = False
        octets = self._window.octets
        while len(octets) >= self._next:
            self._look(self._next)
        return self._window.give()

    def advance(self, now: int) -> list[Event]:
        """Say that no read returned up to `now` (ns); give what the silence completes."""
        silence = self._times.least_silence_at(now)
        if silence is not None and silence >= self._t35:
            self._hear_silence(silence)
        return self._window.give()

    def close(self) -> list[Event]:
        """End of capture: give everything still held."""
        self._settle(hold=False, proved=False)
        return self._window.give()

    def deadline(self) -> int | None:
        """When silence will mean something next (ns), or None when it never will."""
        if not self._window.octets:
            return None
        return self._times.proves_silence(self.hold if self._settled else self._t35)

    def remember(self, earlier: Framer, frames: FrameColumns, octets: Octets, begin: int, end: int) -> None:
        """See `dissectors.columns.Remembering`."""
        from dissectors.modbus.past_columns import learn

        assert isinstance(earlier, RtuFramer)
        self._window.past, self._window.units = earlier._window.past, earlier._window.units
        self._window.expected = None if begin < end else earlier._window.expected
        learn(self._window.past, self._window.units, frames, octets, begin, end)

    # --- when to decide --------------------------------------------------------------------------------------------

    def _hear_silence(self, silence: int) -> None:
        if not self._settled:
            self._settled = True
            self._settle(hold=True, proved=True)
        if silence >= self.hold:
            self._settle(hold=False, proved=True)

    def _settle(self, *, hold: bool, proved: bool) -> None:
        """Give everything: silence (or the end of the capture) follows. With `hold`, keep a tail that may go on."""
        window, octets = self._window, self._window.octets
        if not octets:
            return
        window.end, window.end_proved = len(octets), proved
        if not self._take_whole():
            while octets and window.in_step() and self._take_head(window.readings(len(octets)), len(octets), hold):
                pass
            if octets:
                self._settle_slowly(hold)
        window.end = None
        self._next = max(_FIRST, len(octets) + 1)

    def _settle_slowly(self, hold: bool) -> None:
        """The same by the best segmentation."""
        window, octets = self._window, self._window.octets
        path, agreed = self._segment(len(octets))
        if not hold:
            agreed = path
        elif path and path[-1].end == window.base + len(octets):  # a good frame that ends with the silence …
            agreed = path[:-1] if lacks_zeros(path[-1].octets) else path  # … waits for nothing
        for candidate in agreed:
            window.take_candidate(candidate)
        if octets and hold:
            if self._may_go_on():
                window.cuts.append(window.base + len(octets))
                return
            for candidate in path[len(agreed) :]:
                window.take_candidate(candidate)
        if octets:
            window.take_rest(len(octets), Side.SILENCE)

    def _look(self, count: int) -> None:
        """Look at the first `count` octets of a window that goes on: commit what is certain, choose the next look."""
        window = self._window
        base = window.base
        found = window.readings(count) if window.in_step() else ()
        if found and self._take_head(found, count, True):
            self._next = max(_FIRST, count - window.base + base)
            return
        if not found and window.in_step() and is_open_length(window.octets):
            if self._take_open_heads(count):
                self._next = max(_FIRST, count - window.base + base)
                return
            if count < _FIRST_OPEN:
                self._next = _FIRST_OPEN
                return
        wait = WINDOW + 1  # until the shortest reading of the head that is still open is complete
        for length, _, _ in found:
            if length >= count or length == MORE:
                wait = min(wait, length + 1 if length != MORE else WINDOW)
        if wait > WINDOW or count > _FIRST:
            for candidate in self._segment(count - 1)[1]:
                window.take_candidate(candidate)
            if window.base == base and count >= WINDOW:
                window.take_rest(count - MAX_FRAME, Side.NOISE)
            if window.base > base:
                self._next = max(_FIRST, count - window.base + base)
                return
        self._next = min(wait, count + max(_STEP if wait > WINDOW else _PATIENT_STEP, count // 2), WINDOW)

    def _may_go_on(self) -> bool:
        """Whether the window, before a silence, looks like the first part of a frame that a late read cut."""
        window, octets = self._window, self._window.octets
        count = len(octets)
        if count >= MAX_FRAME or len(window.cuts) >= _MOST_CUTS or not window.in_step():
            return False
        unit = octets[0]
        if count == 1:
            return BROADCAST < unit <= MAX_UNIT or unit in window.units
        awaited = window.expected
        if awaited is not None and awaited.unit == unit and awaited.length is not None:
            if awaited.length == count:
                return False  # complete, and damaged
            if octets[1] == awaited.function and count < awaited.length:
                return True
        lengths = [r.length for r in window.readings(count)]
        if unit == BROADCAST and lengths and not FUNCTIONS[octets[1] & ~EXCEPTION_BIT].writes:
            return False
        return count not in lengths and any(n == MORE or n > count for n in lengths)

    # --- what to decide --------------------------------------------------------------------------------------------

    def _take_whole(self) -> bool:
        """Take the window as one frame if it has silence on both sides, a predicted length and a good CRC.

        This is what a healthy bus on a good adapter gives; the general way would find the same, more slowly.
        """
        window, octets = self._window, self._window.octets
        count = len(octets)
        if window.cuts or not octets[-1] or count > MAX_FRAME or window.start_bits() != PROVED:
            return False
        whole = bytes(octets)
        if crc16_modbus(whole):
            return False
        for length, request, response in readings(whole, 0, count):
            if length == count:
                window.take_frame(count, request, response)
                return True
        return False

    def _take_head(self, found: tuple[LengthGuess, ...], count: int, hope: bool) -> bool:
        """Take the frame that the window begins with, if a reading of it is good and none still open is better.

        `found`: the readings of the head; `hope`: whether those that are not complete count.
        """
        window = self._window
        octets, expected, end = window.octets, window.expected, window.end
        best: LengthGuess | None = None
        best_worth = -1
        hopes = None
        for reading in found:
            length = reading.length
            if MORE < length < count or length == end:
                stretch = bytes(octets[:length])
                if crc16_modbus(stretch):
                    continue
                if best is not None:
                    return False  # two good readings, one with zeros at its end: what follows is weighed too
                bits = CRC_BITS + octet_bits(stretch, 0, reading) + window.edge(window.base + length)
                fit = expected.fit(stretch, reading.response) if expected is not None else 0
                if fit < EXACT:
                    fit = max(fit, window.past.bits(stretch, reading.request, reading.response))
                bits += fit
                best, best_worth = reading, self._worth(bits, length)
            else:
                hopes = reading  # of two readings only the longer can be the one that is open
        if best is None or best_worth < 0:
            return False
        if hope and hopes is not None and best.length != end:
            followed = begins_good(octets, best.length, count)  # then the longer one would make two of chance
            if not followed and self._hope(hopes, count) > best_worth:
                return False
        window.take_frame(best.length, best.request, best.response)
        return True

    def _take_open_heads(self, count: int) -> bool:
        """Take the frames of unpredicted length that the window begins with, as long as nothing to come changes them.

        One that is weak on its own is taken with its answer. The general way would find the same, more slowly.
        """
        window = self._window
        known, begin, at = bytes(window.octets[:count]), window.base, 0
        weak, lacking, expected = 0, 0, window.expected  # length and worth of a request that waits for its answer
        while not window.cuts and (end := settled_end(known, at)):
            stretch = known[at:end]
            fit = expected.fit(stretch, True) if expected is not None else 0
            if not fit and (weak or (stretch[0] not in window.units and is_text(stretch))):
                break
            asks = not stretch[1] & EXCEPTION_BIT
            bits = ANY_END if asks else CRC_BITS + exception_bits(stretch[2])
            bits += max(fit, window.past.bits(stretch, asks, True)) + window.edge(begin + end)
            bits += ADJACENT if weak or window.good_before else window.start_bits()
            own = worth(bits + HEARD if stretch[0] in window.units else bits, len(stretch))
            if own + lacking < 0:
                if weak or not asks:
                    break
                weak, lacking, expected = len(stretch), own, expectation(expected, stretch, True, True)
            else:
                if weak:
                    window.take_frame(weak, True, True)
                window.take_frame(len(stretch), asks, True)
                weak, lacking, expected = 0, 0, window.expected
            at = end
        return window.base > begin

    def _hope(self, reading: LengthGuess, count: int) -> int:
        """What the head may be worth once it is complete."""
        window = self._window
        length = reading.length if reading.length != MORE else count + 1
        bits = CRC_BITS + octet_hope(window.octets, 0, reading)
        octets, expected = window.octets, window.expected
        known = KNOWN_LENGTH if reading.response and window.past.knows_length(octets[0], octets[1], length) else 0
        bits += max(known, expected.hope(octets, 0, length) if expected is not None else 0)
        return self._worth(bits, length)

    def _worth(self, bits: int, length: int) -> int:
        """Worth of a frame at the head of the window, by the rules of best_split.py."""
        window = self._window
        bits += ADJACENT if window.good_before else window.start_bits()
        if window.octets[0] in window.units:
            bits += HEARD
        if window.cuts:
            bits += SILENCE_INSIDE * window.inside(window.base, window.base + length)
        return worth(bits, length)

    def _segment(self, count: int) -> tuple[list[Candidate], list[Candidate]]:
        """Best segmentation of the first `count` octets: its frames, and those that nothing to come can undo."""
        window, finder = self._window, self._finder
        finder.look(window.octets, window.base, count)
        unpredicted = self._unpredicted(count)
        if unpredicted:
            paths = Paths(window)
            paths.extend(finder.good + unpredicted)
        else:
            paths = self._extended_paths()
        return paths.winner(), paths.agreed(finder.pending(), self._open.unfinished, count)

    def _extended_paths(self) -> Paths:
        """The paths through all candidates found, kept from look to look while nothing is taken."""
        good = self._finder.good
        if self._paths.base == self._window.base and self._paths.extend(good[self._added :]):
            self._added = len(good)
            return self._paths
        self._paths, self._added = Paths(self._window), len(good)
        self._paths.extend(good)
        return self._paths

    def _unpredicted(self, count: int) -> list[Candidate]:
        """Frames whose length nothing predicts: all octets between two silences, or several that lie together."""
        window, silent = self._window, self._window.end is not None
        octets, base = window.octets, window.base
        found: dict[tuple[int, int], Candidate] = {}
        starts = list(window.cuts)
        if window.start_bits() or window.good_before:
            starts.append(base)
            if silent and (level := levels_at_start(octets)):
                starts.append(base + level)
        known, good = bytes(octets[:count]), self._finder.good
        for each in self._open.look(known, base, starts, good, silent, window.expected, window.past, window.units):
            found[each.start, each.length] = each
        if silent:
            for start in starts:
                at, heard = start - base, False
                awaited = False
                if at + 2 <= count:
                    heard = octets[at] in window.units
                    awaited = window.expected is not None and window.expected.is_for(octets, at)
                whole = whole_stretch(octets, at, count, start, window.past, awaited, heard)
                if whole is not None:
                    found[start, whole.length] = whole
        return list(found.values())
