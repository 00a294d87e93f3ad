"""Words that findings of PROFIBUS share."""

from __future__ import annotations

from dissectors.profibus.record import RequestsRecord
from dissectors.profibus.slave_watch import SlaveView


def unheard_words(record: RequestsRecord) -> str:
    """How many of its requests without answer had one that was not heard here; empty for none."""
    if not record.unheard:
        return ""
    return f"; after {record.unheard} of them the master counts on: it had an answer that this tap did not hear"


def watchdog_words(slave: SlaveView) -> str:
    """What its watchdog is set to; empty where nobody said."""
    watchdog = "" if slave.given is None else slave.given.watchdog_words
    return f"; its watchdog is set to {watchdog}" if watchdog else ""
