"""What is said once of a bus that is followed, whatever screen is shown: of its capture, its recording, its rows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from sniff.analysis.sanitizing import sanitized
from sniff.tui.header import why_ended
from sniff.tui.seats import Seat


@dataclass(frozen=True, slots=True)
class Notice:
    """`text` may come from outside and is no markup."""

    text: str
    title: str
    severity: Literal["information", "warning", "error"] = "information"


def news(seat: Seat, bus: str) -> Iterator[Notice]:
    """What is new of the recording, the view and the capture. `bus`: what to put before it."""
    status, store = seat.status, seat.feed.store
    trouble = status.trouble
    if trouble != seat.told_trouble:
        seat.told_trouble = trouble
        said = bus + (sanitized(trouble) or "it goes on")
        yield Notice(said, "recording", "error" if trouble else "information")
    if seat.is_down != seat.told_down:
        seat.told_down, of_port = seat.is_down, seat.last_of_port()
        said = bus + sanitized("" if of_port is None else of_port.text)
        yield Notice(said, "the port is looked for" if seat.is_down else "the port", "warning")
    if store.dropped_rows and not seat.told_dropped:
        seat.told_dropped = True
        file = "the file keeps all" if status.in_file else "nothing is recorded"
        yield Notice(f"{bus}the oldest rows leave the view, {store.keep} stay; {file}", "memory")
    if status.ended and not seat.told_end:
        seat.told_end = True
        yield Notice(bus + sanitized(why_ended(status, store)[1]), "the capture has ended", "warning")


def found(seat: Seat, bus: str) -> Notice:
    """With which settings a search has ended."""
    return Notice(
        f"{bus}found: {sanitized(seat.status.protocol)}, {sanitized(seat.status.line)}", "the search has ended"
    )
