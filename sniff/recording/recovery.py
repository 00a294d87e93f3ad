"""Recovery: a whole file of a recording that was cut off or damaged."""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from sniff.engine.session import Completeness, LineEvent
from sniff.recording.mcap_writer import PartPlace, create_part
from sniff.recording.reader import McapCapture, buses_of

if TYPE_CHECKING:
    from sniff.engine.blocks import Block

RECOVERED = "recovered"
"""Note of a session: what was wrong with the file that it was made from."""


def recover(source: str | Path, target: str | Path) -> Completeness:
    """Write everything that can be read of a recording into a new one; give what was wrong with the old one.

    Chunks, marks and line events of every bus are kept, each hole as an event; results of the engine are left out,
    since they can be computed again. A part of a rotation keeps its place in its recording. The new file's sessions
    have a note that says what was wrong. `target` may be the file itself. Raises CaptureError.
    """
    buses = buses_of(source)
    wrong = [one for one in (bus.completeness() for bus in buses) if not one.whole]
    found = wrong[0] if wrong else Completeness(True)
    sessions = [bus.session for bus in buses]
    if wrong:
        sessions = [replace(one, notes={**one.notes, RECOVERED: found.text}) for one in sessions]
    first = buses[0]
    firsts, before = tuple(one.first_chunk for one in buses), tuple(one.octets_before for one in buses)
    with create_part(target, sessions, PartPlace(first.part, firsts, before)) as writer:
        for _, bus, piece in _by_time(buses):
            if isinstance(piece, LineEvent):
                writer.write(piece, bus)
            else:
                writer.write_block(piece, bus)
    return found


def _by_time(buses: Sequence[McapCapture]) -> Iterator[tuple[int, int, Block | LineEvent]]:
    """What is in a file, of all its buses about in order of time: time (ns), bus, piece."""
    return heapq.merge(*(_timed(bus, capture) for bus, capture in enumerate(buses)), key=lambda one: one[0])


def _timed(bus: int, capture: McapCapture) -> Iterator[tuple[int, int, Block | LineEvent]]:
    for piece in capture.blocks():
        yield (piece.time if isinstance(piece, LineEvent) else int(piece.reads.times[0])), bus, piece
