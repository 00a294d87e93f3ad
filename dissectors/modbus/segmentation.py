"""The best segmentation: which candidates of a window are frames.

Evidence is counted in bits. A candidate brings those of its octets (candidates.py); to them come

    +4  silence proved at its start, at its end; or a good frame directly before it
    +2  silence of 1.5 characters proved there
    +4  a station that has been heard before
    +2 … +10  it answers the open request, or repeats it (expectation.py)
    -6  each silence proved inside it

and THRESHOLD is taken off. What remains is its worth. A candidate that stands on its own gains a sixteenth of a bit an
octet, to decide between readings that contradict each other: a long frame is a better reading than noise with a short
one inside. The path of candidates with the greatest sum wins. So a weak request is taken together with the answer
that fits it, and neither alone.

A stretch that would be a frame if the octets to come make its CRC good is weighed too, at its best. Frames are
committed as far as the best path and the best path that ends in such a hope agree.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple, Protocol

from dissectors.modbus.candidates import CRC_BITS, Candidate, Pending, Reading, octet_hope
from dissectors.modbus.expectation import Expected, expectation
from dissectors.modbus.functions import MORE

THRESHOLD: Final = 20
SCALE: Final = 16
"""Worths are ints: SCALE to a bit, 1 to an octet covered."""

PROVED: Final = 4
LIKELY: Final = 2
ADJACENT: Final = 4
HEARD: Final = 4
SILENCE_INSIDE: Final = -6

_NEIGHBOURS: Final = 12
"""How many earlier candidates are tried as the one before; the best path of all is always tried."""


class Surroundings(Protocol):
    """The window, and what stands round a position of it (positions count from the first octet ever fed).

    `base`: position of the window's first octet. `expected`: the open request before it. `good_before`: a good frame
    ends directly before it.
    """

    octets: bytearray
    base: int
    expected: Expected | None
    good_before: bool

    def edge(self, position: int) -> int:
        """Bits of evidence that one frame ends, another begins there: PROVED, LIKELY or 0."""
        ...

    def inside(self, start: int, end: int) -> int:
        """Number of proved silences strictly between."""
        ...

    def heard(self, unit: int) -> bool:
        """Whether good frames named this station."""
        ...


class _Step(NamedTuple):
    """A path: the candidate it ends with, the path before, and its worth."""

    worth: int
    candidate: Candidate | None
    before: _Step | None
    end: int  # position directly after a good frame, or -1
    expected: Expected | None


def worth(bits: int, length: int) -> int:
    """Worth of a candidate of `length` octets with that much evidence; not negative when it stands on its own.

    One that does not still breaks a tie: it is taken where a neighbour gains from it what it lacks.
    """
    excess = bits - THRESHOLD
    return excess * SCALE + (length if excess >= 0 else 1)


def context_bits(window: Surroundings, unit: int, start: int, end: int, adjacent: bool) -> int:
    """Bits from what stands round a stretch, without its end and the open request."""
    bits = ADJACENT if adjacent else window.edge(start)
    if window.heard(unit):
        bits += HEARD
    silences = window.inside(start, end)
    return bits + SILENCE_INSIDE * silences if silences else bits


def segment(
    window: Surroundings, count: int, candidates: Sequence[Candidate], pending: Sequence[Pending]
) -> tuple[list[Candidate], list[Candidate]]:
    """The frames of the best path, and those of them that nothing yet to come can undo, both in order.

    `count`: how many octets of the window are known.
    """
    root = _Step(0, None, None, window.base if window.good_before else -1, window.expected)
    steps = [root]
    for candidate in sorted(candidates):
        best: _Step | None = None
        for step in _before(steps, candidate.start):
            total = step.worth + _worth(candidate, step, window)
            if best is None or total > best.worth:
                after = expectation(step.expected, candidate.octets, candidate.request, candidate.response)
                best = _Step(total, candidate, step, candidate.end, after)
        if best is not None:
            steps.append(best)
    winner = max(steps, key=_by_worth)
    path = _frames(winner)
    hope: _Step | None = None
    most = winner.worth
    for start, reading in pending:
        for step in _before(steps, start):
            total = step.worth + _hope(start, reading, count, step, window)
            if total > most:
                most, hope = total, step
    if hope is None:
        return path, path
    agreed = []
    for ours, theirs in zip(path, _frames(hope), strict=False):
        if ours is not theirs:
            break
        agreed.append(ours)
    return path, agreed


def _by_worth(step: _Step) -> int:
    return step.worth


def _before(steps: Sequence[_Step], start: int) -> list[_Step]:
    """Paths that end at or before `start`: the nearest few, and the best."""
    fitting = [s for s in steps if s.candidate is None or s.candidate.start + s.candidate.length <= start]
    if len(fitting) <= _NEIGHBOURS:
        return fitting
    return [max(fitting, key=_by_worth), *fitting[-_NEIGHBOURS:]]


def _worth(candidate: Candidate, step: _Step, window: Surroundings) -> int:
    start, length = candidate.start, candidate.length
    bits = candidate.bits + window.edge(start + length)
    bits += context_bits(window, candidate.unit, start, start + length, step.end == start)
    if step.expected is not None:
        bits += step.expected.fit(candidate.octets, 0, length)
    return worth(bits, length)


def _hope(start: int, reading: Reading, count: int, step: _Step, window: Surroundings) -> int:
    octets, at = window.octets, start - window.base
    length = reading.length if reading.length != MORE else count - at + 1
    bits = CRC_BITS + octet_hope(octets, at, reading)
    bits += context_bits(window, octets[at], start, start + length, step.end == start)
    if step.expected is not None:
        bits += step.expected.hope(octets, at, length)
    return worth(bits, length)


def _frames(step: _Step | None) -> list[Candidate]:
    found = []
    while step is not None and step.candidate is not None:
        found.append(step.candidate)
        step = step.before
    found.reverse()
    return found
