"""The parts of one recording as one capture: what a rotation cut, a frame at the seam too, is whole again.

Parts belong together by the session that each of them carries (same port, same start) and by their numbers; they
follow each other by the numbers of their reads. A part that is missing between two others is a hole like any other: a
DROPPED event.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from sniff.engine.blocks import Block
from sniff.engine.capture import Capture
from sniff.engine.session import Completeness, Item, LineEvent, Session
from sniff.formats.mark_file import marked, unmarked
from sniff.recording.reader import McapCapture


class RotatedCapture:
    """Parts of one recording in their order, at least two. A `Capture`."""

    def __init__(self, parts: Sequence[McapCapture]) -> None:
        self.parts = tuple(sorted(parts, key=lambda part: (part.first_chunk, part.part)))
        known = (part.session for part in self.parts if not part.session.unknown)
        self.session: Session = next(known, self.parts[0].session)

    def items(self) -> Iterator[Item]:
        """Chunks and line events of all parts, in order. Raises CaptureError."""
        return self.parts[0].items(followed_by=self.parts[1:])

    def blocks(self) -> Iterator[Block | LineEvent]:
        """The same as columns. Raises CaptureError."""
        return self.parts[0].blocks(followed_by=self.parts[1:])

    def completeness(self) -> Completeness:
        """Whether all parts are whole; what is wrong, part by part."""
        found = [(part, part.completeness()) for part in self.parts]
        numbers = {part.part for part in self.parts}
        absent = [str(number) for number in range(min(numbers), max(numbers)) if number not in numbers]
        said = [f"part{'s' if len(absent) > 1 else ''} {', '.join(absent)} not given"] if absent else []
        said += [f"{part.path.name}: {complete.text}" for part, complete in found if not complete.whole]
        return Completeness(not said, "; ".join(said) if said else "complete")


def joined(opened: Sequence[tuple[str, Capture]]) -> list[tuple[str, Capture]]:
    """Captures by name, with the parts of one recording as one, at the place and under the names of the first of them:
    "night-0001.mcap and 4 more parts"."""
    groups: dict[Any, list[tuple[str, Capture]]] = {}
    for place, (name, capture) in enumerate(opened):
        groups.setdefault(_recording(capture) or place, []).append((name, capture))
    found: list[tuple[str, Capture]] = []
    for group in groups.values():
        plain = [unmarked(capture) for _, capture in group]
        parts = {capture.part: capture for capture, _ in plain if isinstance(capture, McapCapture)}
        if len(group) < 2 or len(parts) < len(group):  # pieces that were cut out, and copies, are all part 1
            found += group
            continue
        more = len(parts) - 1
        rotated = RotatedCapture(list(parts.values()))
        first = next(name for name, capture in group if unmarked(capture)[0] is rotated.parts[0])
        marks = sorted((mark for _, beside in plain for mark in beside), key=lambda mark: mark.time)
        found.append((f"{first} and {more} more part{'s' if more > 1 else ''}", marked(rotated, marks)))
    return found


def _recording(capture: Capture) -> tuple[str, int] | None:
    """What all parts of a recording have in common; None for what no rotation made."""
    capture, _ = unmarked(capture)
    if not isinstance(capture, McapCapture) or not capture.session.started:
        return None
    return capture.session.port, capture.session.started
