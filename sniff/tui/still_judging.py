"""Notice on screens of findings and values while the rules and the readers of values are not done with a file."""

from __future__ import annotations

from sniff.bus.feed import FeedStatus
from sniff.bus.rows import Store


def still_judging(status: FeedStatus, store: Store) -> str:
    """Up to where it holds, in words; empty when it is final."""
    if not status.reading and status.judged >= 1:
        return ""
    rest = "the file is still being read" if status.reading else f"of {store.last_no:,}"
    return f"not final: rows up to {store.judged:,} are judged, {rest}"
