"""The /line messages of a recording: marks of octets, events, and entries that go on with the one before them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass

from dissectors.frame import LineError, Mark
from sniff.engine.session import LineEvent, LineEventKind, encodable
from sniff.recording.topic_message import Message, stamp
from sniff.recording.topics import LINE

_CONTINUED = "continued"
_READS = "reads"
_MARK_FLAGS = {flag.name.lower(): flag for flag in LineError if flag.name}
_EVENT_KINDS = {kind.value: kind for kind in LineEventKind}

_LONGEST = 1 << 16  # octets of a message worth reading
_U64 = 1 << 64


def mark_record(error: LineError, number: int, offset: int) -> dict[str, object]:
    """The mark of an octet of the entry with that number."""
    return {"kind": mark_name(error), "chunk": number, "offset": offset}


def continued_record(number: int) -> dict[str, object]:
    """The entry with that number goes on with the one before it."""
    return {"kind": _CONTINUED, "chunk": number}


def event_record(event: LineEvent, number: int) -> dict[str, object]:
    """An event before the entry with that number."""
    record: dict[str, object] = {"kind": event.kind.value, "chunk": number}
    if event.text:
        record["text"] = event.text
    if event.count:
        record["count"] = event.count
    if stamp(event.time) != event.time:
        record["time_ns"] = event.time
    return record


def line_message(time: int, record: Mapping[str, object], sequence: int = 0) -> Message:
    """The message that holds a record; `time`: of what it tells, ns."""
    data = json.dumps(record, separators=(",", ":")).encode()
    return Message(LINE, stamp(time), stamp(time), sequence, data)


def loss_message(event: LineEvent, number: int, reads: int) -> Message:
    """An event by itself, before the entry with that number: so many entries before it were never written."""
    return line_message(event.time, event_record(event, number) | {_READS: reads})


@dataclass(frozen=True, slots=True)
class LineMessage:
    """A message that was read. `kind`: of a mark or an event, or "continued". `number`: of the entry that it is about,
    or that came next."""

    kind: str
    number: int
    _record: Mapping[str, object]

    @classmethod
    def decode(cls, data: bytes) -> LineMessage | None:
        """None when it is none; total."""
        if len(data) > _LONGEST:
            return None
        try:
            record = json.loads(data)
        except (ValueError, RecursionError):
            return None
        if not isinstance(record, dict):
            return None
        kind, number = record.get("kind"), _integer(record.get("chunk"), -1)
        return cls(kind, number, record) if isinstance(kind, str) and number >= 0 else None

    @property
    def is_continued(self) -> bool:
        """Whether the entry goes on with the one before it."""
        return self.kind == _CONTINUED

    @property
    def reads(self) -> int:
        """How many entries before it were never written, as the recorder itself says."""
        return _integer(self._record.get(_READS), 0)

    def event(self, log_time: int) -> LineEvent | None:
        """The event that it is; None for marks, and for what is nothing."""
        kind, text = _EVENT_KINDS.get(self.kind), self._record.get("text")
        if kind is None:
            return None
        time, count = _integer(self._record.get("time_ns"), log_time), _integer(self._record.get("count"), 0)
        return LineEvent(time, kind, encodable(text) if isinstance(text, str) else "", count)

    def mark(self) -> Mark | None:
        """The mark that it is; None for what is no mark: a later version may know more kinds."""
        error = mark_error(self.kind)
        return None if error is None else Mark(_integer(self._record.get("offset"), 0), error)


def line_event(data: bytes, log_time: int) -> LineEvent | None:
    """The event that a message is; None for marks, and for what is nothing."""
    message = LineMessage.decode(data)
    return None if message is None else message.event(log_time)


def mark_name(error: LineError) -> str:
    """ "parity", "parity+framing" …"""
    return "+".join(flag.name.lower() for flag in error if flag.name) or "none"


def mark_error(name: str) -> LineError | None:
    """What `mark_name` wrote; None for what is no mark."""
    error = LineError(0)
    for word in name.split("+"):
        if word not in _MARK_FLAGS:
            return LineError(0) if name == "none" else None
        error |= _MARK_FLAGS[word]
    return error


def _integer(value: object, default: int) -> int:
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) < _U64:
        return value
    return default
