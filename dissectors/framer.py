"""The framer contract, and the mechanics that protocols share.

A framer turns chunks into events. It is sans-I/O: it reads no clock; silence is told to it.
Every framer obeys, and one shared property suite (sniff/testing/framer_contract.py) checks:

1. Conservation: the octets of all events, in order, are exactly the octets fed.
2. Cut invariance: the same octets and times, cut into other chunks, give the same events.
3. Total: any octets, any times (backwards too): no exception, bounded memory, bounded delay.
4. Resynchronisation: after any rubbish the next good frame is found.
5. Provenance: each frame says how it was found and what was skipped.

How time is read. The last octet of a chunk had ended by `chunk.time`; the octets before it stand back to back at line
speed, so each has a *nominal* end. The true end lies in [nominal - slack, nominal], where the slack of an octet is
at most `Timing.latency` and no more than the room before it. Silence between two octets is therefore

    proved    when even the smallest reading of it reaches the limit:  gap - latency >= limit
    possible  when the largest does:                                   gap + slack of the octet before >= limit

`advance(now)` proves silence after the last octet the same way. An octet not yet delivered at `now` ends no earlier
than now - latency. It may come as the first of a long read, which puts its nominal end that early, and the smallest
reading of its silence is one latency earlier still: hence twice the latency in `least_silence_at`. So what `advance`
decides, the next octet would have decided too, and a saved capture (fed without `advance`) gives the same events as
the live bus. Two things are asked of the caller: `Timing.latency` is a true upper bound, and `now` is a time up to
which the *reader* vouches that it has handed over everything it read, not the clock of the process that decodes.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from typing import Final, NamedTuple, Protocol

from dissectors.frame import Chunk, Event, LineError, Mark
from dissectors.line import Timing

UNKNOWN_SILENCE: Final = 86_400 * 1_000_000_000
"""Largest reading of the silence before the first octet of a capture, ns."""


class Framer(Protocol):
    """Octets and times in, events out."""

    protocol: str

    def feed(self, chunk: Chunk) -> list[Event]:
        """Take one read; give the events it completes, in order."""
        ...

    def advance(self, now: int) -> list[Event]:
        """Say that no read returned up to `now` (ns); give what the silence completes."""
        ...

    def close(self) -> list[Event]:
        """End of capture: give everything still held."""
        ...

    def deadline(self) -> int | None:
        """When silence will mean something next (ns), or None when it never will."""
        ...


class Taken(NamedTuple):
    """Octets taken out of a window; times as in `Frame`."""

    octets: bytes
    start: int
    end: int
    slack: int
    marks: tuple[Mark, ...]


@dataclass(slots=True)
class _Run:
    """Octets back to back: octet k of the run ends at max(floor, first_end + k * char)."""

    index: int  # of its first octet in the window
    first_end: int
    floor: int  # no octet ends before the one before the run
    gap: int  # nominal silence before its first octet
    room: int  # slack of the octet before the run
    slack: int  # of each of its octets


class OctetWindow:
    """Octets not yet given out, each with its nominal end, the silence before it, its slack and its line errors.

    The octets of one chunk share one run, so the cost is by chunk, not by octet. Times that run backwards are read
    as "no time passed".
    """

    __slots__ = ("_char", "_last_end", "_last_slack", "_latency", "_marks", "_runs", "octets", "timing")

    def __init__(self, timing: Timing) -> None:
        self.timing = timing
        self.octets = bytearray()
        self._char = timing.char
        self._latency = timing.latency
        self._last_end: int | None = None  # of the newest octet, also after it was taken
        self._last_slack = timing.latency
        self._runs: list[_Run] = []
        self._marks: dict[int, LineError] = {}

    def __len__(self) -> int:
        return len(self.octets)

    @property
    def last_end(self) -> int | None:
        """Nominal end of the newest octet ever appended, ns; None before the first."""
        return self._last_end

    def append(self, chunk: Chunk) -> None:
        """Add the octets of a chunk."""
        count = len(chunk.octets)
        if not count:
            return
        octets, char = self.octets, self._char
        index = len(octets)
        first_end = chunk.time - (count - 1) * char
        floor = self._last_end
        if floor is None:  # nothing is known of the time before the first octet of a capture
            gap, floor = UNKNOWN_SILENCE, first_end - char
        else:
            gap = first_end - char - floor
            if gap < 0:
                gap = 0
        room = self._last_slack
        slack = gap + room
        if slack > self._latency:
            slack = self._latency
        self._runs.append(_Run(index, first_end, floor, gap, room, slack))
        octets += chunk.octets
        if chunk.marks:
            for mark in chunk.marks:
                if 0 <= mark.offset < count:
                    at = index + mark.offset
                    self._marks[at] = self._marks[at] | mark.error if at in self._marks else mark.error
        self._last_end = chunk.time if chunk.time > floor else floor
        self._last_slack = slack

    def least_silence_before(self, chunk: Chunk) -> int | None:
        """Smallest reading of the silence between the newest octet and a chunk not yet appended, ns."""
        if self._last_end is None or not chunk.octets:
            return None
        return max(0, chunk.time - len(chunk.octets) * self._char - self._last_end - self._latency)

    def least_silence_at(self, now: int) -> int | None:
        """Smallest reading of the silence after the newest octet when nothing was read up to `now`, ns."""
        if self._last_end is None:
            return None
        return max(0, now - self._char - self._last_end - 2 * self._latency)

    def proves_silence(self, limit: int) -> int | None:
        """The time from which `least_silence_at` reaches `limit` (ns); None before the first octet."""
        if self._last_end is None:
            return None
        return self._last_end + limit + self._char + 2 * self._latency

    def silence(self, index: int) -> tuple[int, int]:
        """Smallest and largest reading of the silence before octet `index` of the window, ns.

        Before the very first octet of a capture nothing is known: (0, 24 h).
        """
        run = self._run(index)
        if run.index != index:
            return 0, run.slack
        if run.gap == UNKNOWN_SILENCE:
            return 0, UNKNOWN_SILENCE
        return max(0, run.gap - self._latency), run.gap + run.room

    @property
    def newest_silence(self) -> int:
        """Smallest reading of the silence before the chunk appended last, ns; 0 before the first of a capture."""
        gap = self._runs[-1].gap
        return gap - self._latency if self._latency < gap != UNKNOWN_SILENCE else 0

    def gap(self, index: int) -> int:
        """Nominal silence before octet `index` of the window, ns; 24 h before the first octet of a capture."""
        runs = self._runs
        run = runs[-1] if runs[-1].index <= index else self._run(index)
        return run.gap if run.index == index else 0

    def start(self, index: int) -> int:
        """Latest possible begin of octet `index`, ns."""
        run = self._run(index)
        before = self._end_in(run, index - 1) if index > run.index else run.floor
        return max(self._end_in(run, index) - self._char, before)

    def end(self, index: int) -> int:
        """Nominal (latest) end of octet `index`, ns."""
        return self._end_in(self._run(index), index)

    def slack(self, index: int) -> int:
        """How much sooner than nominally octet `index` may have ended, ns."""
        return self._run(index).slack

    def errors(self, begin: int, end: int) -> LineError:
        """What the UART reported about octets `begin` … `end` - 1 of the window, together."""
        together = LineError(0)
        for at in range(begin, end) if self._marks else ():
            together |= self._marks.get(at, together)
        return together

    def take(self, count: int) -> Taken:
        """Remove and give the first `count` octets (1 … len)."""
        runs, char = self._runs, self._char
        first = runs[0]
        start = first.first_end - char
        if start < first.floor:
            start = first.floor
        last = first if len(runs) == 1 else self._run(count - 1)
        end = last.first_end + (count - 1 - last.index) * char
        if end < last.floor:
            end = last.floor
        octets = bytes(self.octets[:count])
        del self.octets[:count]
        marks: tuple[Mark, ...] = ()
        if self._marks:
            marks = tuple(Mark(i, e) for i, e in sorted(self._marks.items()) if i < count)
            self._marks = {i - count: e for i, e in self._marks.items() if i >= count}
        if self.octets:
            self._drop_runs(count)
        else:
            runs.clear()
        return Taken(octets, start, end, last.slack, marks)

    def _drop_runs(self, count: int) -> None:
        runs = self._runs
        gone = 0
        while gone + 1 < len(runs) and runs[gone + 1].index <= count:
            gone += 1
        if gone:
            del runs[:gone]
        run = runs[0]
        cut = count - run.index
        if cut:  # inside the run: what is left stands directly after the octet before it
            run.first_end += cut * self._char
            run.gap, run.room = 0, run.slack
        run.index = 0
        for later in runs[1:]:
            later.index -= count

    def _run(self, index: int) -> _Run:
        runs = self._runs
        if runs[-1].index <= index:
            return runs[-1]
        return runs[bisect_right(runs, index, key=_index_of) - 1]

    def _end_in(self, run: _Run, index: int) -> int:
        return max(run.floor, run.first_end + (index - run.index) * self._char)


def _index_of(run: _Run) -> int:
    return run.index
