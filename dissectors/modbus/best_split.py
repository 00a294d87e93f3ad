"""The best segmentation: which candidates of a window are frames.

Evidence is counted in bits. A candidate brings those of its octets (candidates.py); to them come

    +4  silence proved at its start, at its end; or a good frame directly before it
    +2  silence of 1.5 characters proved there
    +4  a station that has been heard before
    +2 … +14  it answers the open request, or repeats it, or asks the next unit the same (open_request.py)
    +6 … +14  this station was asked the same before, or answered at this length (past.py)
    -6  each silence proved inside it

and THRESHOLD is taken off. What remains is its worth. A candidate that stands on its own gains a sixteenth of a bit an
octet, to decide between readings that contradict each other: a long frame is a better reading than noise with a short
one inside. The path of candidates with the greatest sum wins. So a weak request is taken together with the answer
that fits it, and neither alone.

A good frame and zeros is good again (the CRC is 0), and one frame in 256 ends with a zero: two readings of the same
octets. The request that is open decides between them; where none speaks, a request is likelier than an answer that
nobody asked for, and between two silences the reading that uses all octets is likelier than one that leaves a zero.
More zeros than a CRC has, or a bus on which zeros tend to follow frames, speak for the shorter reading.

A path is extended by a candidate from the best path before it, the best that ends directly before it, and the best
that left the request open which it would answer.

A stretch that would be a frame if the octets to come make its CRC good is weighed too, at its best. Frames are
committed as far as the best path and all better ones that end in such a hope agree.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple, Protocol

from dissectors.modbus.candidates import ANY_END, ZERO_TAIL, Candidate, Pending
from dissectors.modbus.functions import EXCEPTION_BIT
from dissectors.modbus.lengths import MIN_FRAME, MORE
from dissectors.modbus.open_request import LOOSE, REPEATED, SAME_UNKNOWN, SEARCHED, Expected, expectation
from dissectors.modbus.past import KNOWN_LENGTH, Past
from dissectors.modbus.ranges import AGREEMENTS

THRESHOLD: Final = 20
SCALE: Final = 16
"""Worths are ints: SCALE to a bit, 1 to an octet covered."""

PROVED: Final = 4
LIKELY: Final = 2
ADJACENT: Final = 4
HEARD: Final = 4
SILENCE_INSIDE: Final = -6

WHOLE: Final = 12
"""A request whose last octets are zeros, and that fills the room between two silences: good without them, too."""

WHOLE_ANSWER: Final = 4
"""An answer whose last octets are zeros, and that is as long as was asked for."""

_WELL_TOLD: Final = frozenset(AGREEMENTS)
"""Functions whose first octets are ill formed by chance nearly always: a count must agree with another."""

_MOST_FROM_CONTEXT: Final = ADJACENT + SAME_UNKNOWN
_CRC_OCTETS: Final = 2


class Surroundings(Protocol):
    """The window, and what stands round a position of it (positions count from the first octet ever fed).

    `base`: position of the window's first octet. `expected`: the open request before it. `good_before`: a good frame
    ends directly before it. `past`: what was said before. `units`: stations that good frames named. `cuts`: positions
    of proved silences.
    """

    octets: bytearray
    base: int
    cuts: list[int]
    units: set[int]
    expected: Expected | None
    good_before: bool
    past: Past

    def edge(self, position: int) -> int:
        """Bits of evidence that one frame ends, another begins there: PROVED, LIKELY or 0."""
        ...

    def inside(self, start: int, end: int) -> int:
        """Number of proved silences strictly between."""
        ...


class _Step(NamedTuple):
    """A path: the candidate it ends with, the path before, and its worth; `asked`: the newest request in it."""

    worth: int
    candidate: Candidate | None
    before: _Step | None
    end: int  # position directly after a good frame, or -1
    expected: Expected | None
    asked: bytes


def worth(bits: int, length: int) -> int:
    """Worth of a candidate of `length` octets with that much evidence; not negative when it stands on its own.

    One that does not still breaks a tie: it is taken where a neighbour gains from it what it lacks.
    """
    excess = bits - THRESHOLD
    return excess * SCALE + (length if excess >= 0 else 1)


def zero_bits(window: Surroundings, candidate: Candidate, expected: Expected | None, fit: int) -> int:
    """Bits for a frame that is good without its last zeros too; `fit`: those it has from the open request."""
    if fit >= LOOSE:
        return 0 if window.past.zeros_stray else WHOLE_ANSWER
    if candidate.zeros > _CRC_OCTETS or window.past.zeros_stray:
        return ZERO_TAIL
    if candidate.request and window.edge(candidate.start) == PROVED and window.edge(candidate.end) == PROVED:
        return WHOLE
    awaited = expected is not None and expected.fit(candidate.octets[: -candidate.zeros], True) >= LOOSE
    return ZERO_TAIL if awaited else 0


class Paths:
    """The best paths through the candidates of a window, extended as more of them are complete.

    Valid until something is taken out of the window.
    """

    __slots__ = ("_awaiting", "_best", "_ends", "_steps", "_touching", "_window", "base")

    def __init__(self, window: Surroundings) -> None:
        self._window = window
        self.base = window.base
        root = _Step(0, None, None, window.base if window.good_before else -1, window.expected, b"")
        self._ends = [window.base]  # of every path found, ascending
        self._best = [root]  # the best of those that end there or before
        self._steps = [root]
        self._touching: dict[int, tuple[_Step, ...]] = {window.base: (root,)}  # by the position that they end at
        self._awaiting: dict[int, tuple[list[int], list[_Step]]] = {}  # as the first two, by request left open
        if root.expected is not None:
            self._remember_awaiting(window.base, root, root.expected)

    def extend(self, candidates: Iterable[Candidate]) -> bool:
        """Add candidates; False, and nothing done, when one ends before what was added earlier."""
        fresh = sorted(candidates, key=_by_end)
        if fresh and fresh[0].end < self._ends[-1]:
            return False
        for candidate in fresh:
            self._add(candidate)
        return True

    def winner(self) -> list[Candidate]:
        """The frames of the best path, in order."""
        return _frames(self._best[-1])

    def agreed(self, pending: Sequence[Pending], unfinished: Sequence[int], count: int) -> list[Candidate]:
        """Those of them that nothing yet to come can undo. `count`: how many octets of the window are known.

        `unfinished`: where frames of unpredicted length have begun (open_length.py).
        """
        winner = self._best[-1]
        if winner.candidate is None:
            return []
        path = _frames(winner)
        end = path[-1].end
        rivalled = self._is_rivalled(winner)
        hoping: dict[int, _Step] = {}  # paths that would be better than the best if their last frame comes true
        for each in pending:
            if each.start >= end and not rivalled:
                continue  # it follows the best path, whatever becomes of it
            total, step = self._hope(each, count)
            if step is not None and total > winner.worth:
                hoping[id(step)] = step
        for start in unfinished:
            total, step = self._open_hope(start)
            if total > winner.worth:
                hoping[id(step)] = step
        open_ended = set(unfinished)
        agreed = next((at for at, each in enumerate(path) if each.start in open_ended), len(path))
        for step in hoping.values():
            other = _frames(step)
            while other[:agreed] != path[:agreed]:
                agreed -= 1
        return path[:agreed]

    def _is_rivalled(self, winner: _Step) -> bool:
        """Whether another path is so near that what follows could make it the better one."""
        near, path = winner.worth - _MOST_FROM_CONTEXT * SCALE, set()
        step: _Step | None = winner
        while step is not None:
            path.add(id(step))
            step = step.before
        return any(each.worth > near and id(each) not in path for each in self._steps)

    def _add(self, candidate: Candidate) -> None:
        start, length, bits, unit, request, response, octets, zeros = candidate
        if start < self.base:
            return
        window, end = self._window, start + length
        bits += window.edge(end) + _standing(window, unit, start, end)
        known = window.past.bits(octets, request, response)
        edge = -1  # evidence that a frame begins at `start`, once it is asked for
        either = request and response
        chosen: dict[bool, tuple[int, _Step]] = {}  # one that may be both is tried as request and as answer
        for step in self._options(start, unit, octets[1]):
            expected = step.expected
            fit, asked = known, False
            if expected is not None and expected.is_for(octets, 0):
                fit, asked = expected.fit(octets, response), True
            elif expected is not None and request and expected.is_searched_on(octets):
                fit = SEARCHED
            if request and fit < REPEATED and octets == step.asked:
                fit = REPEATED
            own = bits + (fit if fit > known else known)
            if step.end == start:
                own += ADJACENT
            else:
                if edge < 0:
                    edge = window.edge(start)
                own += edge
            if zeros:
                own += zero_bits(window, candidate, expected, fit)
            reached = step.worth + worth(own, length)
            answers = either and asked
            if answers not in chosen or reached > chosen[answers][0]:
                chosen[answers] = reached, step
        for total, before in chosen.values():
            after = expectation(before.expected, octets, request, response)
            step = _Step(total, candidate, before, end, after, before.asked if after is None else octets)
            self._ends.append(end)
            self._best.append(step if total > self._best[-1].worth else self._best[-1])
            self._touching[end] = (*self._touching.get(end, ()), step)
            self._steps.append(step)
            if after is not None:
                self._remember_awaiting(end, step, after)

    def _options(self, start: int, unit: int, code: int) -> Sequence[_Step]:
        """Paths that a frame may follow; the best of them is among these."""
        ends = self._ends
        best = self._best[-1 if ends[-1] <= start else bisect_right(ends, start) - 1]
        options = self._touching.get(start, ())
        if best not in options:
            options = (*options, best)
        awaiting = self._awaiting.get(unit << 8 | code & ~EXCEPTION_BIT) if self._awaiting else None
        if awaiting is not None:
            at = bisect_right(awaiting[0], start) - 1
            if at >= 0 and awaiting[1][at] not in options:
                options = (*options, awaiting[1][at])
        return options

    def _hope(self, pending: Pending, count: int) -> tuple[int, _Step | None]:
        """The best path that ends in a frame whose CRC may yet be good, and its worth. None where nothing but its first
        octets speaks for such a frame: of 65536 of them one becomes a frame."""
        start, reading, bits = pending
        window = self._window
        octets, at = window.octets, start - window.base
        unit, code = octets[at], octets[at + 1]
        edge = window.edge(start)
        spoken_for = (
            unit in window.units
            or edge > 0
            or code in _WELL_TOLD
            or start in self._touching
            or unit << 8 | code & ~EXCEPTION_BIT in self._awaiting
        )
        if not spoken_for:
            return 0, None
        length = reading.length if reading.length != MORE else count - at + 1
        bits += _standing(window, unit, start, start + length)
        known = KNOWN_LENGTH if reading.response and window.past.knows_length(unit, code, length) else 0
        most, best = -1, self._best[0]
        for step in self._options(start, unit, code):
            own, expected = known, step.expected
            if expected is not None and expected.unit == unit:
                own = max(own, expected.hope(octets, at, length))
            total = step.worth + worth(bits + own + (ADJACENT if step.end == start else edge), length)
            if total > most:
                most, best = total, step
        return most, best

    def _open_hope(self, start: int) -> tuple[int, _Step]:
        """The same for a frame of unpredicted length, which answers one of its station and function."""
        window = self._window
        octets, at = window.octets, start - window.base
        unit, code = octets[at], octets[at + 1]
        edge = window.edge(start)
        most, best = -1, self._best[0]
        for step in self._options(start, unit, code):
            bits = ANY_END + (ADJACENT if step.end == start else edge) + (HEARD if unit in window.units else 0)
            if step.expected is not None and step.expected.is_for(octets, at):
                bits += SAME_UNKNOWN
            total = step.worth + worth(bits, MIN_FRAME)
            if total > most:
                most, best = total, step
        return most, best

    def _remember_awaiting(self, end: int, step: _Step, expected: Expected) -> None:
        ends, best = self._awaiting.setdefault(expected.unit << 8 | expected.function, ([], []))
        ends.append(end)
        best.append(step if not best or step.worth > best[-1].worth else best[-1])


def _standing(window: Surroundings, unit: int, start: int, end: int) -> int:
    """Bits for a known station, less those for silences inside."""
    bits = HEARD if unit in window.units else 0
    return bits + SILENCE_INSIDE * window.inside(start, end) if window.cuts else bits


def _by_end(candidate: Candidate) -> tuple[int, int]:
    return candidate.start + candidate.length, candidate.start


def _frames(step: _Step | None) -> list[Candidate]:
    found = []
    while step is not None and step.candidate is not None:
        found.append(step.candidate)
        step = step.before
    found.reverse()
    return found
