"""Marks and comments about a capture that cannot hold them itself: a small file beside it, `NAME.marks.jsonl`.

A line is a JSON object: "time", ns since the Unix epoch, the moment that is marked; "text", what was written; "gone":
true where the mark of that moment was taken away again; "bus", which it is about where the file holds several. Later
lines win. Lines are only ever added.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from sniff.engine.capture import Capture
from sniff.engine.session import Completeness, Item, LineEvent, LineEventKind, Session, encodable

if TYPE_CHECKING:
    from sniff.engine.blocks import Block


class _Many(Protocol):
    """Many reads, or rows. `latest`: ns, when the last of them came or ended."""

    @property
    def latest(self) -> int: ...


Many = TypeVar("Many", bound=_Many)

SUFFIX = ".marks.jsonl"
LARGEST = 1 << 20
"""Octets of such a file that are read."""
LONGEST = 2000
"""Characters of a mark."""


def mark_file(path: str | Path) -> Path:
    """The file beside a capture that holds its marks."""
    return Path(f"{path}{SUFFIX}")


@dataclass(frozen=True, slots=True)
class MarkPlace:
    """Where the marks of a capture are kept: beside which file, and of which bus in it; "": it holds one."""

    file: Path
    bus: str = ""


def place_of(name: str, capture: Capture) -> MarkPlace | None:
    """Where the marks of an open capture go that people know by a name: beside its file, the first of several parts.
    None where there is no such file, as of standard input."""
    if Path(name).is_file():
        return MarkPlace(Path(name))
    first = getattr(capture, "parts", (capture,))[0]
    path = getattr(first, "path", None)
    if path is None or not name.startswith(str(path)) or not Path(path).is_file():
        return None
    return MarkPlace(Path(path), capture.session.bus)


def add_mark(path: str | Path, time: int, text: str | None, bus: str = "") -> None:
    """Write a mark beside a capture, or that the one of that moment (ns) is taken away (None). Raises OSError."""
    said = None if text is None else encodable(text[:LONGEST])
    record: dict[str, Any] = {"time": time, "gone": True} if said is None else {"time": time, "text": said}
    if bus:
        record["bus"] = bus
    with mark_file(path).open("a", encoding="utf-8") as stream:
        stream.write(json.dumps(record, ensure_ascii=False) + "\n")


def marks_beside(path: str | Path, bus: str = "") -> list[LineEvent]:
    """Marks of a bus in the file beside a capture, and which moments have none any more, in order of time; what is no
    mark is passed over."""
    try:
        with mark_file(path).open("rb") as stream:
            lines = stream.read(LARGEST).decode("utf-8", "replace").splitlines()
    except OSError:
        return []
    found: dict[int, str | None] = {}
    for line in lines:
        try:
            record = json.loads(line)
        except (ValueError, RecursionError):
            continue
        time = record.get("time") if isinstance(record, dict) else None
        if not isinstance(time, int) or isinstance(time, bool) or abs(time) >= 1 << 62:
            continue
        if record.get("bus", bus) != bus:
            continue
        if record.get("gone"):
            found[time] = None  # which may be a mark that the capture holds itself
        elif isinstance(record.get("text"), str):
            found[time] = encodable(record["text"][:LONGEST])
    return [mark_event(time, text) for time, text in sorted(found.items())]


def mark_event(time: int, text: str | None) -> LineEvent:
    """A mark of a moment (ns), or that it has none any more (None)."""
    return LineEvent(time, LineEventKind.UNMARK if text is None else LineEventKind.MARK, text or "")


class MarksBeside:
    """The marks beside a capture while one looks at it: others may write some meanwhile."""

    def __init__(self, path: str | Path, bus: str = "") -> None:
        self._path = path
        self._bus = bus
        self._looked: tuple[int, int] | None = None  # time and size of the file when it was read
        self._known: dict[int, LineEvent] = {}

    def changes(self) -> list[LineEvent]:
        """What was marked, and which marks were taken away, since the last time; first, all that stands there."""
        try:
            stat = mark_file(self._path).stat()
            looked = stat.st_mtime_ns, stat.st_size
        except OSError:
            looked = None
        if looked == self._looked:
            return []
        self._looked = looked
        before, self._known = self._known, {one.time: one for one in marks_beside(self._path, self._bus)}
        now = self._known
        gone = [mark_event(time, None) for time in before if time not in now]
        return gone + [one for time, one in now.items() if before.get(time) != one]

    def add(self, time: int, text: str | None) -> None:
        """Write a mark, or that the one of that moment is taken away; whoever does it knows it. Raises OSError."""
        add_mark(self._path, time, text, self._bus)
        self._known[time] = mark_event(time, text[:LONGEST] if text is not None else None)


class MarkedCapture:
    """A capture with the marks beside it among its events. Everything else is the capture's own. What stands
    beside it of a moment that its own marks are about comes last, for it is later than they are."""

    def __init__(self, capture: Capture, marks: Sequence[LineEvent]) -> None:
        self._capture = capture
        self._marks = tuple(marks)

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
        waiting, own, last = self._waiting(), list[LineEvent](), 0
        for item in self._capture.items():
            while waiting and waiting[0].time <= item.time:
                yield waiting.pop(0)
            yield item
            last = item.time
            if isinstance(item, LineEvent) and item.kind is LineEventKind.MARK:
                own.append(item)
        yield from waiting
        yield from self._later_than(own, last)

    def blocks(self) -> Iterator[Block | LineEvent]:
        """The same as columns; a mark stands before the block that holds its moment, which is all that it needs."""
        return self._among(self._capture.blocks())

    def stored_tables(self, session: Session) -> Iterator[Any] | None:
        """What the capture holds (`engine.read_source.KeepsTables`), with the marks before what holds their moments."""
        stored = getattr(self._capture, "stored_tables", None)
        held = None if stored is None else stored(session)
        return None if held is None else self._among(held)

    def _among(self, items: Iterator[Many | LineEvent]) -> Iterator[Many | LineEvent]:
        waiting, own, last = self._waiting(), list[LineEvent](), 0
        for item in items:
            last = item.time if isinstance(item, LineEvent) else item.latest
            while waiting and waiting[0].time <= last:
                yield waiting.pop(0)
            yield item
            if isinstance(item, LineEvent) and item.kind is LineEventKind.MARK:
                own.append(item)
        yield from waiting
        yield from self._later_than(own, last)

    def _waiting(self) -> list[LineEvent]:
        return [one for one in self._marks if one.kind is LineEventKind.MARK]

    def _later_than(self, own: Sequence[LineEvent], last: int) -> list[LineEvent]:
        """What is said of these marks of the capture since; `last`: when it ends."""
        moments = {mark.moment for mark in own}
        said = [one for one in self._marks if one.time in moments]
        return [replace(one, time=max(one.time, last), count=max(one.time, last) - one.time) for one in said]

    def completeness(self) -> Completeness:
        """As the capture's."""
        return self._capture.completeness()


def with_marks(capture: Capture, path: str | Path) -> Capture:
    """The capture with the marks beside it, the capture itself where there are none."""
    return marked(capture, marks_beside(path, capture.session.bus))


def marked(capture: Capture, marks: Sequence[LineEvent]) -> Capture:
    """The capture with these marks, itself where there are none."""
    return MarkedCapture(capture, marks) if marks else capture


def unmarked(capture: Capture) -> tuple[Capture, tuple[LineEvent, ...]]:
    """The capture as its format reads it, and the marks that stand beside it."""
    return (capture._capture, capture._marks) if isinstance(capture, MarkedCapture) else (capture, ())
