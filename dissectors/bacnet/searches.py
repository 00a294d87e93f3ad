"""Searches for a successor after a loss: which polls belong to one, and what it cost."""

from __future__ import annotations

from dissectors.bacnet.frame_types import FrameType
from dissectors.bacnet.limits import MS
from dissectors.bacnet.ring_events import RingEventKind
from dissectors.bacnet.ring_tally import NodeTally, RingTally
from dissectors.frame import Frame

_TOKEN, _POLL = int(FrameType.TOKEN), int(FrameType.POLL_FOR_MASTER)
_AFTER_SEARCH = 10  # tokens after a search in which a poll still looks for the one that was lost

T_STOPPED = 1_000 * MS
"""A search for a successor that takes so long has stopped the bus."""


def begin_search(node: NodeTally, time: int) -> None:
    """The station has lost its successor, or has made a token and looks for one."""
    node.searches = True
    node.searching_since = time


def end_search(tally: RingTally, no: int, frame: Frame, source: int, node: NodeTally) -> None:
    """The token goes on: what a loss has cost, and for how long polls still belong to it."""
    if node.searches:
        node.after_search = _AFTER_SEARCH
    elif node.after_search:
        node.after_search -= 1
    node.searches = False
    since, node.searching_since = node.searching_since, None
    if since is not None and frame.start - since >= T_STOPPED:
        value = frame.start - since
        tally.note(RingEventKind.STOPPED, frame.start, no, source, node.highest_polled, value)


class PollSeries:
    """Polls of one station directly behind one another. One that has its successor polls once with a token."""

    def __init__(self) -> None:
        self._of: int | None = None
        self._since = 0

    def forget(self) -> None:
        """Something else came, or was missed."""
        self._of = None

    def goes_on(self, mac: int, since: int) -> None:
        """A series of that station began then, and its newest poll is the newest frame."""
        self._of, self._since = mac, since

    def see(self, tally: RingTally, no: int, frame: Frame, frame_type: int, source: int) -> None:
        """Take the next good frame, before the search that it ends is over."""
        if frame_type == _POLL:
            if source != self._of:
                self.goes_on(source, frame.start)
            return
        polled_by, self._of = self._of, None
        node = tally.nodes.get(source)
        took = frame.start - self._since
        if polled_by != source or took < T_STOPPED or node is None or frame_type != _TOKEN:
            return
        if node.next == frame.octets[3] and not node.searches:  # to whom it passed its token before, and lost nobody
            tally.note(RingEventKind.POLLED_ON, frame.start, no, source, node.highest_polled, took)
