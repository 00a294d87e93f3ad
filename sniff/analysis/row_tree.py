"""The field tree's lines about a row besides its octets: how it was found, and its transaction."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING

from dissectors.frame import Frame
from dissectors.words import milliseconds
from sniff.analysis.packet_tree import Field, fields_of
from sniff.analysis.sanitizing import sanitized
from sniff.analysis.wording import duration, mark_names

if TYPE_CHECKING:
    from dissectors.manifest import Dissector
    from dissectors.meaning import Meaning
    from dissectors.tracker import Transaction
    from sniff.engine.engine import Row

_ASIDE = re.compile(r" \([^()]*\)")


def tree_of(
    dissector: Dissector,
    row: Row,
    transaction: Transaction | None,
    time_text: Callable[[int], str] | None,
    meaning: Meaning | None = None,
) -> tuple[Field, ...]:
    """Everything about a row: what it means to its device, the layers of its packet, how it was found, its transaction
    where that has closed.

    `time_text` writes times (ns since the epoch); None: nobody knows when anything came.
    """
    event = row.event
    known = [_event(row, time_text)]
    if transaction is not None:
        known.append(_transaction(transaction, row.no))
    if isinstance(event, Frame):
        role = row.placement.role if row.placement is not None else row.header.role if row.header else None
        said = () if meaning is None else values_of(dissector, event, meaning)
        return (*said, *fields_of(dissector, event, role), *known) if role is not None else tuple(known)
    return tuple(known)


def values_of(dissector: Dissector, frame: Frame, meaning: Meaning) -> tuple[Field, ...]:
    """Every value by name, as one part of the tree: "drive 3", below it "Register 2524h (wire 0x2524) output
    frequency: 30.00 Hz (3000)"; nothing where the frame tells none."""
    if meaning.refused:
        return (Field(sanitized(meaning.who), sanitized(meaning.refused)),)
    spans = meaning.spans_in(frame, dissector.spans)
    lines = []
    items = list(zip(meaning.items(dissector.place), spans, strict=False))
    for item, span in items:
        begin, end = span or (None, None)
        parts = tuple(Field(sanitized(name), sanitized(text)) for name, text in item.parts)
        brief, text = sanitized(item.brief), sanitized(item.text)
        lines.append(Field(sanitized(item.name), text, begin, end, parts, brief, folded=len(items) > 1))
    if not lines and meaning.asked:
        asked = tuple(_asked(sanitized(where), sanitized(title)) for where, title in meaning.questions(dissector.place))
        return (Field(sanitized(meaning.who), f"is asked for {len(asked)}", None, None, asked),)
    if not lines:
        return ()
    count = f"{len(lines)} value{'s' if len(lines) != 1 else ''}"
    return (Field(sanitized(meaning.who), count, *_cover(lines), tuple(lines)),)


def _asked(where: str, title: str) -> Field:
    """A place that is asked for; where there is little room without what stands in brackets."""
    return Field(where, title, brief=_ASIDE.sub("", where))


def _cover(lines: list[Field]) -> tuple[int | None, int | None]:
    begins = [line.begin for line in lines if line.begin is not None]
    ends = [line.end for line in lines if line.end is not None]
    return min(begins, default=None), max(ends, default=None)


def _event(row: Row, time_text: Callable[[int], str] | None) -> Field:
    event = row.event
    count = len(event.octets)
    times = (
        [
            Field("start", time_text(event.start)),
            Field("end", time_text(event.end)),
            Field("lasts", milliseconds(event.end - event.start)),
        ]
        if time_text is not None
        else []
    )
    marks = [
        Field(f"octet {mark.offset}", mark_names(mark.error), mark.offset, mark.offset + 1)
        for mark in event.marks[:100]
    ]
    errors = [Field("line errors", str(len(event.marks)), None, None, tuple(marks))] if marks else []
    if not isinstance(event, Frame):
        about = [Field("place", event.place.value), Field("why", event.reason.value)]
        return Field("noise", f"{row.no}: {_octets(count)}", 0, count, (*about, *times, *errors))
    about = [Field("found by", event.found.value), Field("check", event.check.value)]
    if event.damage is not None:
        about.append(Field("damage", event.damage.value))
    if event.expected is not None and event.expected != count:
        about.append(Field("expected length", _octets(event.expected)))
    if event.skipped:
        about.append(Field("noise before", _octets(event.skipped)))
    if event.slack and time_text is not None:
        about.append(Field("ends up to", f"{milliseconds(event.slack)} earlier"))
    if event.flags:
        about.append(Field("odd", sanitized(", ".join(event.flags))))
    if row.header is not None and row.header.error:
        about.append(Field("error", sanitized(row.header.error)))
    return Field("frame", f"{row.no}: {_octets(count)}", None, None, (*about, *times, *errors), folded=True)


def _transaction(transaction: Transaction, no: int) -> Field:
    parts = [
        Field("kind", sanitized(transaction.kind)),
        Field("station", "none" if transaction.station is None else str(transaction.station)),
        Field("request", "not seen" if transaction.request is None else _frame(transaction.request, no)),
        Field("response", "none" if transaction.response is None else _frame(transaction.response, no)),
    ]
    if transaction.latency is not None:
        parts.append(Field("latency", duration(transaction.latency)))
    if transaction.attempt > 1 or transaction.of is not None:
        of = "" if transaction.of is None else f" of transaction {transaction.of}"
        parts.append(Field("attempt", f"{transaction.attempt}{of}"))
    if transaction.error:
        parts.append(Field("error", sanitized(transaction.error)))
    told = f"{transaction.id}: {transaction.verdict.words}"
    return Field("transaction", told, None, None, tuple(parts), folded=True)


def _frame(number: int, here: int) -> str:
    return f"frame {number} (this)" if number == here else f"frame {number}"


def _octets(count: int) -> str:
    return f"{count} octet" if count == 1 else f"{count} octets"
