"""Marks and comments about a capture that cannot hold them itself: a small file beside it, `NAME.marks.jsonl`.

A line is a JSON object: "time", ns since the Unix epoch, the moment that is marked; "text", what was written; "gone":
true where the mark of that moment was taken away again. Later lines win. Lines are only ever added.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sniff.engine.capture import Capture
from sniff.engine.session import Completeness, Item, LineEvent, LineEventKind, Session

if TYPE_CHECKING:
    from sniff.engine.blocks import Block

SUFFIX = ".marks.jsonl"
LARGEST = 1 << 20
"""Octets of such a file that are read."""
LONGEST = 2000
"""Characters of a mark."""


def mark_file(path: str | Path) -> Path:
    """The file beside a capture that holds its marks."""
    return Path(f"{path}{SUFFIX}")


def add_mark(path: str | Path, time: int, text: str | None) -> None:
    """Write a mark beside a capture, or that the one of that moment (ns) is taken away (None). Raises OSError."""
    record: dict[str, Any] = {"time": time, "gone": True} if text is None else {"time": time, "text": text[:LONGEST]}
    with mark_file(path).open("a", encoding="utf-8") as stream:
        stream.write(json.dumps(record, ensure_ascii=False) + "\n")


def marks_beside(path: str | Path) -> list[LineEvent]:
    """Marks in the file beside a capture, in order of time; what is no mark is passed over."""
    try:
        with mark_file(path).open("rb") as stream:
            lines = stream.read(LARGEST).decode("utf-8", "replace").splitlines()
    except OSError:
        return []
    found: dict[int, str] = {}
    for line in lines:
        try:
            record = json.loads(line)
        except (ValueError, RecursionError):
            continue
        time = record.get("time") if isinstance(record, dict) else None
        if not isinstance(time, int) or isinstance(time, bool) or abs(time) >= 1 << 62:
            continue
        if record.get("gone"):
            found.pop(time, None)
        elif isinstance(record.get("text"), str):
            found[time] = record["text"][:LONGEST]
    return [LineEvent(time, LineEventKind.MARK, text) for time, text in sorted(found.items())]


class MarkedCapture:
    """A capture with the marks beside it among its events. Everything else is the capture's own."""

    def __init__(self, capture: Capture, marks: list[LineEvent]) -> None:
        self._capture = capture
        self._marks = marks

    def __getattr__(self, name: str) -> Any:
        return getattr(self._capture, name)

    @property
    def session(self) -> Session:
        """As the capture's."""
        return self._capture.session

    @session.setter
    def session(self, session: Session) -> None:
        self._capture.session = session

    def items(self) -> Iterator[Item]:
        """Chunks and events, marks before what is not earlier."""
        waiting = list(self._marks)
        for item in self._capture.items():
            while waiting and waiting[0].time <= item.time:
                yield waiting.pop(0)
            yield item
        yield from waiting

    def blocks(self) -> Iterator[Block | LineEvent]:
        """The same as columns; a mark stands before the block that holds its moment, which is all that it needs."""
        waiting = list(self._marks)
        for block in self._capture.blocks():
            last = block.time if isinstance(block, LineEvent) else int(block.reads.times[-1])
            while waiting and waiting[0].time <= last:
                yield waiting.pop(0)
            yield block
        yield from waiting

    def completeness(self) -> Completeness:
        """As the capture's."""
        return self._capture.completeness()


def with_marks(capture: Capture, path: str | Path) -> Capture:
    """The capture with the marks beside it, the capture itself where there are none."""
    marks = marks_beside(path)
    return MarkedCapture(capture, marks) if marks else capture
