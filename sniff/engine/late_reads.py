"""Reads that came late: frames in them have no times of their own. Pure.

A busy computer does not come round to reading, and then gets all at once what came meanwhile: several frames in one
read, back to back as far as anybody knows, behind a silence that there never was. That a frame ended longer before the
read than the adapter may hold octets back, with room for another frame behind it, proves it. The octets of such a read
came at any time since the reads before, so its frames get that much slack (`Frame.slack`), and no rule takes a bound
from them that the computer may have made.

Where reads hold more octets than can have come again and again, the adapter is slower than it says: from then on every
frame has the slack that they prove. So a live bus follows what comes; a saved one has looked ahead (`read_times.py`).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import replace

from dissectors.frame import Chunk, Frame
from dissectors.line import Timing
from sniff.engine.read_times import Backlog

ANOTHER = 4
"""Octets that a frame has at least: fewer behind a frame are no second one."""

TOGETHER = 10_000_000
"""Reads that follow so soon, ns, may all be late: what a computer missed comes in several reads."""

OFTEN, RARELY = 3, 500
"""Stretches of reads that hold more than can have come, from which on the adapter is that slow: so many, and in so many
reads at most one fewer; else the computer was busy."""

MOST = 250_000_000
"""ns; no computer that is worth listening with is away for longer."""

KEPT = 2048
"""Reads that may still hold the end of a frame to come: more than the octets of the longest frame there is."""


class _Read:
    """A read: from when on its octets were on the line at the latest, when it came, how long after the one before
    (negative: it is short, so that no two frames end in it), how slow the adapter was known to be by then.

    `is_late`: a frame ended in it too long ago.
    """

    __slots__ = ("is_late", "latency", "pause", "start", "time")

    def __init__(self, start: int, time: int, pause: int, latency: int) -> None:
        self.start, self.time, self.pause, self.latency = start, time, pause, latency
        self.is_late = False


class LateReads:
    """Fed every read, it gives frames the slack that the reads leave.

    `latency`: how slow the adapter is known to be by now, ns; `backlog`: what proves it. `seen`: reads so far; `kept`:
    the last of them. `before_run`: when the read came after which reads follow one another, ns.
    """

    def __init__(self, timing: Timing) -> None:
        self._char = timing.char
        self._least = timing.latency + ANOTHER * timing.char
        self._together = timing.latency + TOGETHER
        self._allowed = self.latency = timing.latency
        self.backlog = Backlog(timing.char, timing.latency + timing.char)
        self.seen = 0
        self._before: int | None = None
        self.before_run = 0
        self.kept: deque[_Read] = deque(maxlen=KEPT)

    def go_on(self, kept: Iterable[tuple[int, int, int, int, bool]], latency: int, seen: int, before_run: int) -> None:
        """Go on where reads were seen many at a time: `kept`, the last of them, as `_Read` has them."""
        for start, time, pause, slow, is_late in kept:
            read = _Read(start, time, pause, slow)
            read.is_late = is_late
            self.kept.append(read)
            self._before = time
        self.latency, self.seen, self.before_run = latency, seen, before_run

    def see(self, chunk: Chunk) -> None:
        """Take the next read."""
        lasted = len(chunk.octets) * self._char
        if not lasted:
            return
        self.seen += 1
        if self._before is not None and self.backlog.add(chunk.time - self._before, len(chunk.octets)):
            stretches = self.backlog.stretches
            if stretches >= OFTEN and RARELY * stretches >= self.seen:
                self.latency = min(MOST, max(self.latency, int(self.backlog.worst)))
        if self._before is None or chunk.time - lasted - self._before > self._together:
            self.before_run = chunk.time - lasted if self._before is None else self._before
        start = chunk.time - lasted if self._before is None else max(chunk.time - lasted, self._before)
        is_long = lasted > self._least and self._before is not None
        pause = min(start - self.before_run, MOST) if is_long else -1
        self.kept.append(_Read(start, chunk.time, pause, self.latency))
        self._before = chunk.time

    def with_slack(self, frame: Frame) -> Frame:
        """The frame; with more slack where it ended in a read that was late, or where many are."""
        slack = frame.slack
        for read in reversed(self.kept):
            if read.time < frame.end:
                break
            if read.start < frame.end <= read.time:
                if read.latency > self._allowed:
                    slack = max(slack, read.latency)
                if read.pause >= 0:
                    read.is_late = read.is_late or read.time - frame.end >= self._least
                    if read.is_late:
                        slack = max(slack, read.pause)
                break
        return frame if slack == frame.slack else replace(frame, slack=slack)
