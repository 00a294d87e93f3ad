"""Words that findings of PROFIBUS share."""

from __future__ import annotations

from dataclasses import replace

from dissectors.findings import Finding
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


def answered_again(finding: Finding, record: RequestsRecord, is_timed: bool) -> Finding:
    """What is found of requests without answer, where each is answered when it is sent again. `is_timed`: times tell
    that from an echo."""
    echo = "" if is_timed else "; or something on the line gives each request back (an echo)"
    return replace(
        finding,
        seen=f"{finding.seen}; {record.again} were answered when they were sent again",
        means="its answers come later than its master waits (slot time), which takes them for answers to the repeat; "
        f"or it misses each first request{echo}",
        next="the slot time of the project against the delay of the station (MaxTsdr in its GSD) and of repeaters, "
        "converters and optical links on the way",
    )
