"""Times over a limit, put aside until it is sure that the bus was late and not the read.

A busy computer returns reads late, by more than any adapter's latency. Such a read shows itself by what follows: frames
that it holds stand back to back, closer than any driver can, or the next one comes sooner than a station may wait. Then
the first frame of it was on the line earlier than its time says, and nothing is judged. A frame that asks shows nothing
of that kind: the answer to it may take long.

An adapter that nobody named is not known to be exact: what is over a limit by less than a tick of its is not late.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from dissectors.bacnet.frame_types import FrameType
from dissectors.bacnet.limits import MS, T_USAGE_DELAY
from dissectors.bacnet.ring_events import RingEvent
from dissectors.frame import Frame

_MOST = 8
UNNAMED_TICK = 3 * MS
"""How unevenly reads come through USB where nobody said what the adapter is."""


@dataclass(slots=True)
class HeldReads:
    """What was late in the newest frame, and whether it may be said.

    `least_gap`: ns; frames of two senders are closer than that only where they came in one read. `margin`: ns that
    times may be off although they are taken as exact.
    """

    least_gap: int
    margin: int = 0
    _late: list[RingEvent] = field(default_factory=list)
    _before: Frame | None = None

    def add(self, event: RingEvent) -> None:
        """Something was late in the newest frame."""
        if len(self._late) < _MOST:
            self._late.append(event)

    def is_late(self, frame: Frame, before: Frame, limit: int) -> bool:
        """Whether the time between two frames is over a limit (ns) whatever the adapter."""
        return surely_over(frame, before, limit + self.margin)

    def settle(self, frame: Frame) -> Iterable[RingEvent]:
        """The next frame has come: give what was surely late, in order."""
        before, self._before = self._before, frame
        if not self._late or before is None:
            return ()
        gap = frame.start - before.end
        same = frame.octets[4:5] == before.octets[4:5]
        if gap < self.least_gap and same and before.octets[2] != FrameType.POLL_FOR_MASTER:
            return ()  # a station may send its frames without a pause: the one after them tells
        late, self._late = self._late, []
        if gap < self.least_gap:
            return ()
        hasty = before.octets[2] == FrameType.POLL_FOR_MASTER and same and gap < T_USAGE_DELAY
        return () if hasty else late

    @property
    def is_settled(self) -> bool:
        """Whether nothing is put aside."""
        return not self._late

    def pass_by(self, frame: Frame) -> None:
        """Frames came in which nothing was late, while nothing was put aside. `frame`: the last of them."""
        self._before = frame

    def forget(self) -> None:
        """Nothing of what was late may be said: octets were missed."""
        self._late, self._before = [], None


def surely_over(frame: Frame, before: Frame, limit: int) -> bool:
    """Whether the time between two frames is over a limit (ns) by its smallest reading."""
    return frame.start - frame.slack - before.end > limit
