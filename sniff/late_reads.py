"""Reads that came late: frames in them have no times of their own. Pure.

A busy computer does not come round to reading, and then gets all at once what came meanwhile: several frames in one
read, back to back as far as anybody knows, behind a silence that there never was. That a frame ended longer before the
read than the adapter may hold octets back, with room for another frame behind it, proves it. The octets of such a read
came at any time since the reads before, so its frames get that much slack (`Frame.slack`), and no rule takes a bound
from them that the computer may have made.
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace

from dissectors.frame import Chunk, Frame
from dissectors.line import Timing

ANOTHER = 4
"""Octets that a frame has at least: fewer behind a frame are no second one."""

TOGETHER = 10_000_000
"""Reads that follow so soon, ns, may all be late: what a computer missed comes in several reads."""

MOST = 250_000_000
"""ns; no computer that is worth listening with is away for longer."""

KEPT = 16
"""Reads that may still hold the end of a frame to come."""


class _Read:
    """A long read: from when on its octets were on the line at the latest, when it came, how long after the one before.

    `is_late`: a frame ended in it too long ago.
    """

    __slots__ = ("is_late", "pause", "start", "time")

    def __init__(self, start: int, time: int, pause: int) -> None:
        self.start, self.time, self.pause = start, time, pause
        self.is_late = False


class LateReads:
    """Fed every read, it gives frames the slack that the reads leave."""

    def __init__(self, timing: Timing) -> None:
        self._char = timing.char
        self._least = timing.latency + ANOTHER * timing.char
        self._together = timing.latency + TOGETHER
        self._before: int | None = None
        self._before_run = 0  # when the read came after which reads follow one another
        self._reads: deque[_Read] = deque(maxlen=KEPT)

    def see(self, chunk: Chunk) -> None:
        """Take the next read."""
        lasted = len(chunk.octets) * self._char
        if not lasted:
            return
        if self._before is None or chunk.time - lasted - self._before > self._together:
            self._before_run = chunk.time - lasted if self._before is None else self._before
        if lasted > self._least and self._before is not None:
            start = max(chunk.time - lasted, self._before)
            self._reads.append(_Read(start, chunk.time, min(start - self._before_run, MOST)))
        self._before = chunk.time

    def with_slack(self, frame: Frame) -> Frame:
        """The frame; with more slack where it ended in a read that was late."""
        for read in reversed(self._reads):
            if read.start < frame.end <= read.time:
                read.is_late = read.is_late or read.time - frame.end >= self._least
                if read.is_late and read.pause > frame.slack:
                    return replace(frame, slack=read.pause)
                break
        return frame
