"""Rows as the command line shows them: a line of text, a JSON object, chosen fields."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from dissectors.frame import Frame, Role
from dissectors.line import MS, NS_PER_S
from dissectors.manifest import Dissector
from sniff.analysis.json_text import dumps
from sniff.analysis.json_text import iso as iso
from sniff.analysis.sanitizing import ascii_of
from sniff.analysis.wording import describe, duration, is_error
from sniff.engine.session import Session
from sniff.formats.parquet import Kind

if TYPE_CHECKING:
    from sniff.engine.verdict_join import JudgedRow

JSON_KEYS = (
    "no", "t", "start_ns", "end_ns", "proto", "src", "dst", "role", "kind", "ok", "error", "found", "noise_before",
    "tx", "verdict", "latency_ms", "text", "hex",
)  # fmt: skip
"""Keys of `to_json`, in order: a promise."""

COLUMNS = {
    **dict.fromkeys(JSON_KEYS, Kind.TEXT),
    **dict.fromkeys(("no", "start_ns", "end_ns", "src", "dst", "noise_before", "tx"), Kind.INTEGER),
    "t": Kind.TIME,
    "ok": Kind.TRUTH,
    "latency_ms": Kind.NUMBER,
}
"""The same as columns with types."""

GOOD_VERDICTS = {"answered", "broadcast", "data", "open"}


def to_json(item: JudgedRow, dissector: Dissector, session: Session, with_fields: bool = False) -> dict[str, Any]:
    """One object a frame; the keys and their order are a promise. Noise has null where it has no such thing.

    What a search heard is an object too: "kind" is "searching", and "ok" null, for it is neither. Of a capture that
    does not say when anything came all times are null.
    """
    row, transaction = item.row, item.transaction
    event, header, placement = row.event, row.header, row.placement
    frame = event if isinstance(event, Frame) else None
    latency = transaction.latency if transaction is not None else None
    has_times = session.has_times
    result: dict[str, Any] = {
        "no": row.no,
        "t": iso(event.start) if has_times else None,
        "start_ns": since_start(event.start, session) if has_times else None,
        "end_ns": since_start(event.end, session) if has_times else None,
        "proto": header.protocol if header else None,
        "src": placement.source if placement else header.source if header else None,
        "dst": placement.destination if placement else header.destination if header else None,
        "role": role_of(item).value if header else None,
        "kind": header.kind if header else "noise" if row.searched is None else "searching",
        "ok": frame.ok if frame is not None else None if row.searched is not None else False,
        "error": header.error if header else None,
        "found": frame.found.value if frame is not None else None,
        "noise_before": frame.skipped if frame is not None else 0,
        "tx": placement.tx if placement else None,
        "verdict": transaction.verdict.value if transaction is not None else None,
        "latency_ms": round(latency.nominal / MS, 6) if latency is not None else None,
        "text": describe(dissector, row, item.meaning),
        "hex": event.octets.hex(),
    }
    if with_fields:
        result["fields"] = fields_of(item, dissector)
        result["values"] = values_of(item, dissector)
        result["asks"] = asks_of(item, dissector)
    return result


def since_start(time: int, session: Session) -> int:
    """ns since the capture's start, at least 0.

    A foreign file's start is its first stamp, which is the end of a read: the first octets began before it.
    """
    return max(0, time - session.started)


def json_line(
    item: JudgedRow, dissector: Dissector, session: Session, with_fields: bool = False, source: str | None = None
) -> str:
    """The object on one line; it begins with its source where there is one."""
    told = to_json(item, dissector, session, with_fields)
    return dumps(told if source is None else {"source": source, **told})


def typed(item: JudgedRow, dissector: Dissector, session: Session) -> list[Any]:
    """The values of `to_json` in the types of `COLUMNS`: the time is ns since the epoch."""
    time = item.row.event.start if session.has_times else None
    return list({**to_json(item, dissector, session), "t": time}.values())


def role_of(item: JudgedRow) -> Role:
    """The role as the tracker decided it."""
    if item.row.placement is not None:
        return item.row.placement.role
    return item.row.header.role if item.row.header is not None else Role.UNKNOWN


def fields_of(item: JudgedRow, dissector: Dissector) -> dict[str, int | float | str]:
    """Wireshark's names (ours under frame. and tx.) to values."""
    row, transaction = item.row, item.transaction
    event = row.event
    fields: dict[str, int | float | str] = {"frame.number": row.no, "frame.len": len(event.octets)}
    if event.marks:
        fields["line.marks"] = len(event.marks)
    if transaction is not None:
        fields["tx.id"] = transaction.id
        fields["tx.verdict"] = transaction.verdict.value
        fields["tx.attempt"] = transaction.attempt
        if transaction.latency is not None:
            fields["tx.latency_ms"] = transaction.latency.nominal / MS
            fields["tx.latency_low_ms"] = transaction.latency.low / MS
            fields["tx.latency_high_ms"] = transaction.latency.high / MS
    if isinstance(event, Frame):
        fields.update(dissector.fields(event, role_of(item)))
        request = item.meaning.request if item.meaning is not None else None
        if request is not None and dissector.answer_fields is not None:
            fields.update(dissector.answer_fields(request, event))
    return fields


def values_of(item: JudgedRow, dissector: Dissector) -> list[dict[str, Any]]:
    """Every register, object and property that a row tells, in the order of the wire; "name" and what follows it are
    null where no profile knows."""
    if item.meaning is None:
        return []
    return [
        {
            "place": one.place,
            "space": one.reading.space,
            "address": one.reading.address,
            "part": one.reading.part or None,
            "raw": one.reading.raw,
            "value": one.value.value if one.value is not None else one.reading.value,
            "text": one.text,
            "name": one.value.name if one.value is not None and one.value.entry is not None else None,
            "title": one.title or None,
            "unit": one.value.unit if one.value is not None and (one.value.entry or one.value.unit) else None,
            "bits": dict(one.parts),
        }
        for one in item.meaning.items(dissector.place)
    ]


def asks_of(item: JudgedRow, dissector: Dissector) -> list[dict[str, Any]]:
    """Every register, object and property that a row asks for, in the order of the wire; "title" is null where nobody
    knows what it is."""
    if item.meaning is None:
        return []
    asked = zip(item.meaning.asked, item.meaning.questions(dissector.place), strict=True)
    return [
        {
            "place": place,
            "space": one.space,
            "address": one.address,
            "part": one.part or None,
            "title": title or None,
        }
        for one, (place, title) in asked
    ]


NO_TIME = f"{'–':>12}  "
"""In place of the seconds of a row, where nobody knows when anything came."""


def text_line(item: JudgedRow, dissector: Dissector, session: Session, colour: bool = False, title: str = "") -> str:
    """One line for people: number, seconds since the start, what it is, verdict and response time, doubts. `title`: of
    its protocol, where that is not the bus's."""
    row, transaction = item.row, item.transaction
    seconds = f"{since_start(row.event.start, session) / NS_PER_S:12.6f} s" if session.has_times else NO_TIME
    notes: list[str] = []
    bad = is_error(row)
    if row.event.marks:
        notes.append(f"{len(row.event.marks)} line error{'s' if len(row.event.marks) != 1 else ''}")
    if transaction is not None and (transaction.response or transaction.request) == row.no:
        if transaction.verdict.value not in GOOD_VERDICTS:
            notes.append(transaction.verdict.words)
            bad = True
        if transaction.latency is not None:
            notes.append(duration(transaction.latency))
    text = f"{title}: " * bool(title) + describe(dissector, row, item.meaning)
    if not isinstance(row.event, Frame):
        shown = row.event.octets[:16].hex(" ").upper()
        text = f"{text}: {shown}{' …' if len(row.event.octets) > 16 else ''}"
    elif not row.event.ok and row.header is not None and row.header.error and row.header.error not in text:
        notes.insert(0, row.header.error)
    line = f"{row.no:>6} {seconds}  {'!' if bad else ' '} {text}{'  [' + '; '.join(notes) + ']' if notes else ''}"
    return f"\x1b[31m{line}\x1b[0m" if colour and bad else line


def hex_dump(octets: bytes) -> str:
    """Sixteen octets a line: offset, hex, printable characters."""
    lines = []
    for offset in range(0, len(octets), 16):
        part = octets[offset : offset + 16]
        lines.append(f"        {offset:04x}  {part.hex(' '):<47}  {ascii_of(part)}")
    return "\n".join(lines)
