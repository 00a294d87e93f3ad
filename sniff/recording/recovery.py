"""Recovery: a whole file of a recording that was cut off or damaged."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from sniff.engine.session import Completeness
from sniff.recording.reader import read
from sniff.recording.writer import create


def recover(source: str | Path, target: str | Path) -> Completeness:
    """Write everything that can be read of a recording into a new one; give what was wrong with the old one.

    Chunks, marks and line events are kept, each hole as an event; results of the engine are left out, since they can
    be computed again. The new file's session has a note that says what was wrong. Raises CaptureError.
    """
    capture = read(source)
    found = capture.completeness()
    session = capture.session
    if not found.whole:
        session = replace(session, notes={**session.notes, "recovered": found.text})
    with create(target, session) as writer:
        for item in capture.items():
            writer.write(item)
    return found
