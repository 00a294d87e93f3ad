"""Searches for a successor after a loss: which polls belong to one, and what it cost."""

from __future__ import annotations

from dissectors.bacnet.limits import MS
from dissectors.bacnet.ring_events import RingEventKind
from dissectors.bacnet.ring_tally import NodeTally, RingTally
from dissectors.frame import Frame

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
