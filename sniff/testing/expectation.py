"""A capture's reading as text: what stands beside it in `*.expect.txt`, made to be read in a diff.

Times are milliseconds after the capture's start. Nothing in it depends on the machine, the day or the place.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterator

from dissectors.frame import Frame
from dissectors.line import MS
from sniff.analysis.points import Point
from sniff.analysis.sanitizing import sanitized
from sniff.analysis.wording import describe, mark_names
from sniff.engine.verdict_join import JudgedRow
from sniff.testing.capture_reading import CaptureReading

MAGIC = "#!sniff-expect 1"


def render(reading: CaptureReading) -> str:
    """The whole expectation, ending with a newline; characters that a terminal obeys are escaped."""
    return "\n".join(map(sanitized, _lines(reading))) + "\n"


def difference(expected: str, found: str, name: str) -> str:
    """A unified diff from what was expected to what was found; empty when equal."""
    lines = difflib.unified_diff(
        expected.splitlines(), found.splitlines(), f"{name} (expected)", f"{name} (found)", lineterm="", n=2
    )
    return "\n".join(lines)


def _lines(reading: CaptureReading) -> Iterator[str]:
    session, counts = reading.session, reading.counts
    yield MAGIC
    yield f"# {session.protocol} {session.line}, adapter holds octets up to {session.adapter.latency / MS:g} ms"
    yield f"# {counts.frames} frames, {counts.damaged} damaged, {counts.noise} octets of noise"
    if reading.devices:
        yield f"# devices: {', '.join(f'{word}={name}' for word, name in reading.devices.items())}"
    if reading.unknown_devices:
        yield f"# devices not known here: {', '.join(map(ascii, reading.unknown_devices))}"
    if not reading.completeness.whole:
        yield f"# cut: {reading.completeness.text}"
    yield ""
    yield "[frames]"
    for item in reading.rows:
        yield _row(reading, item)
    yield ""
    yield "[transactions]"
    for transaction in sorted(reading.transactions, key=lambda one: one.id):
        latency = f" after {_ms(transaction.latency.nominal)}" if transaction.latency is not None else ""
        station = "bus" if transaction.station is None else f"station {transaction.station}"
        error = f" ({transaction.error})" if transaction.error else ""
        attempt = f", attempt {transaction.attempt}" if transaction.attempt > 1 else ""
        verdict = f"{transaction.verdict.value}{latency}{error}{attempt}"
        yield f"{transaction.id:>5}  {station}: {transaction.kind}: {verdict}"
    if reading.line_events:
        yield ""
        yield "[line]"
        for event in reading.line_events:
            yield f"{_ms(event.time - session.started)}  {event.kind.value} {event.count} {event.text}".rstrip()
    yield ""
    yield "[findings]"
    for finding in reading.findings:
        yield f"{finding.code} {finding.severity.label}: {finding.subject}: {finding.seen} (×{finding.count})"
    if reading.points:
        yield ""
        yield "[points]"
        yield from sorted(_point(point) for point in reading.points if not point.sample.value.bit)


def _point(point: Point) -> str:
    value = point.sample.value
    unit = f" {value.unit}" if value.unit else ""
    means = f": {value.words}" if value.words else ""
    times = "once" if point.count == 1 else f"{point.count} times"
    shown = f"{value.value}{unit}{means} (quality {int(value.quality)}, {times})"
    return f"{point.sample.station} {point.sample.name} = {shown}"


def _row(reading: CaptureReading, item: JudgedRow) -> str:
    row = item.row
    event = row.event
    start, end = (event.start - reading.session.started), (event.end - reading.session.started)
    notes = []
    if isinstance(event, Frame):
        notes.append(event.found.value)
        if not event.ok:
            notes.append(f"DAMAGED {event.damage.value if event.damage is not None else 'check'}")
        notes += event.flags
    notes += [f"{mark_names(mark.error)} at octet {mark.offset}" for mark in event.marks]
    text = describe(reading.dissector, row)
    return f"{row.no:>5} {_ms(start):>14} … {_ms(end):>14}  {text}  [{', '.join(notes)}]".replace("  []", "")


def _ms(value: int) -> str:
    return f"{value / MS:.3f} ms"
