"""A stretch of a capture: by time, by frame numbers, or around what the rules found. Reads are kept whole."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING

from dissectors.findings import Finding
from dissectors.line import NS_PER_S
from sniff.analysis.judging import Judging
from sniff.bus.offline import survey
from sniff.devices import noted_devices
from sniff.engine.engine import Output, Row
from sniff.engine.event_texts import SettingsChange, settings_change
from sniff.engine.follow_settings import dissector_for
from sniff.engine.read_source import ReadSource
from sniff.engine.session import Item, LineEvent, LineEventKind, Session

if TYPE_CHECKING:
    from sniff.engine.blocks import Block
    from sniff.engine.table import Table

_SECONDS = re.compile(r"\+?(\d+(?:\.\d{1,9})?) ?(ms|s|m|min|h)?")
_UNITS = {"ms": 10**6, None: NS_PER_S, "s": NS_PER_S, "m": 60 * NS_PER_S, "min": 60 * NS_PER_S, "h": 3600 * NS_PER_S}
_CLOCK = re.compile(r"(\d{1,2}):(\d{2})(?::(\d{2})(?:\.(\d{1,9}))?)?")
_FRACTION = re.compile(r":\d\d[.,](\d+)|[T ]\d{6}[.,](\d+)")
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_DAY = 24 * 3600 * NS_PER_S
_FRAMES = re.compile(r"(\d+)?(?:[-–:](\d+)?)?")


@dataclass(frozen=True, slots=True)
class Stretch:
    """From `first` to `last`, ns, both included."""

    first: int
    last: int

    def widened(self, margin: int) -> Stretch:
        """With `margin` ns more on both sides."""
        return Stretch(self.first - margin, self.last + margin)


FOREVER = 1 << 62


def parse_time(text: str, session: Session) -> int:
    """ "+12.5", "90s" (from the start), "10:02:03.5" (the first one) or ISO 8601 → ns. UTC where no zone
    is said. Raises ValueError."""
    text = text.strip()
    if (match := _SECONDS.fullmatch(text)) is not None:
        whole, _, fraction = match[1].partition(".")
        return session.started + (int(whole) * 10**9 + int(fraction.ljust(9, "0"))) * _UNITS[match[2]] // 10**9
    try:
        if (clock := _CLOCK.fullmatch(text)) is not None:
            return _of_day(clock, session.started)
        moment = datetime.fromisoformat(text)
    except ValueError:
        raise ValueError(
            f"time {text!r}: expected seconds from the start (+12.5), 10:00:12.5 (UTC) or 2026-03-01T10:00:12.5Z"
        ) from None
    known = moment if moment.tzinfo is not None else moment.replace(tzinfo=UTC)
    whole = (known.replace(microsecond=0) - _EPOCH) // timedelta(seconds=1)  # no float: those before 1970 round up
    told = _FRACTION.search(text)
    return whole * NS_PER_S + int((told[1] or told[2] if told is not None else "")[:9].ljust(9, "0"))


def _of_day(clock: re.Match[str], start: int) -> int:
    """The first one behind `start` (ns), or up to an hour before it: a capture may begin a little after 10:00."""
    hours, minutes, seconds = (int(part or 0) for part in clock.group(1, 2, 3))
    if hours > 23 or minutes > 59 or seconds > 59:
        raise ValueError
    of_day = (hours * 3600 + minutes * 60 + seconds) * NS_PER_S + int((clock[4] or "").ljust(9, "0"))
    time = start - start % _DAY + of_day
    early = 3600 * NS_PER_S
    return time - _DAY if time - start >= _DAY - early else time + _DAY if start - time > early else time


def of_frames(capture: ReadSource, session: Session, text: str, reference: bool = False) -> Stretch:
    """The stretch of the frames "12-40", "12-", "-40" or "12", by their numbers in `show`. Raises ValueError.
    `reference`: row by row, for comparison."""
    match = _FRAMES.fullmatch(text.strip())
    if match is None or not (match[1] or match[2]):
        raise ValueError(f"frames {text!r}: expected numbers as 12-40")
    low = int(match[1] or 1)
    if not low:
        raise ValueError(f"frames {text!r}: they are counted from 1")
    high = int(match[2]) if match[2] else low if text.strip().isdigit() else FOREVER
    ends = _Ends(low, high)
    survey(capture, session, ends, reference=reference)
    if not ends.spans:
        raise ValueError(f"frames {text!r}: this capture has none of them")
    return Stretch(ends.spans[0][0], ends.spans[-1][1])


class _Ends:
    """Start and end, ns, of the first and the last of the rows `low` … `high`."""

    def __init__(self, low: int, high: int) -> None:
        self._low, self._high = low, high
        self.spans: list[tuple[int, int]] = []

    def add(self, output: Output) -> None:
        """Take rows."""
        self._keep([row for row in output.rows if self._low <= row.no <= self._high])

    def add_table(self, table: Table) -> None:
        """Take many rows."""
        first, last = max(self._low - table.first, 0), min(self._high - table.first, len(table) - 1)
        self._keep([table.row(place) for place in (first, last)] if first <= last else [])

    def _keep(self, rows: list[Row]) -> None:
        if rows:
            spans = [(row.event.start, row.event.end) for row in rows]
            self.spans = [(self.spans or spans)[0], spans[-1]]

    def add_line_event(self, event: LineEvent) -> None:
        """Nothing of it is kept."""


class _Times:
    """Start and end, ns, of some rows by their numbers."""

    def __init__(self, wanted: Iterable[int]) -> None:
        self._wanted = sorted(set(wanted))
        self.spans: dict[int, tuple[int, int]] = {}

    def add(self, output: Output) -> None:
        """Take rows."""
        for row in output.rows:
            if row.no in self._wanted:
                self.spans[row.no] = row.event.start, row.event.end

    def add_table(self, table: Table) -> None:
        """Take many rows."""
        for no in self._wanted:
            if 0 <= no - table.first < len(table):
                event = table.row(no - table.first).event
                self.spans[no] = event.start, event.end

    def add_line_event(self, event: LineEvent) -> None:
        """Nothing of it is kept."""


def around_finding(capture: ReadSource, session: Session, code: str, reference: bool = False) -> Stretch:
    """The stretch from the first to the last evidence of the first finding with that code. Raises ValueError.
    `reference`: row by row, for comparison."""
    judging = Judging(session, dissector_for(session), noted_devices(session))
    survey(capture, session, judging, reference=reference)
    findings = judging.findings()
    chosen: Finding | None = next((finding for finding in findings if finding.code == code.upper()), None)
    if chosen is None:
        there = ", ".join(sorted({finding.code for finding in findings})) or "none"
        raise ValueError(f"finding {code!r}: not in this capture; there are: {there}")
    times = _Times(chosen.evidence)
    survey(capture, session, times, reference=reference)
    evidence = list(times.spans.values())
    if not evidence:
        return Stretch(chosen.first, chosen.last)
    return Stretch(min(start for start, _ in evidence), max(end for _, end in evidence))


class CutOut:
    """A stretch of a capture. `char`: ns an octet."""

    def __init__(self, capture: ReadSource, stretch: Stretch, char: int) -> None:
        self._capture = capture
        self._stretch = stretch
        self._char = char

    def items(self) -> Iterator[Item]:
        """See `cut`."""
        return cut(self._capture.items(), self._stretch, self._char)

    def blocks(self) -> Iterator[Block | LineEvent]:
        """The same as columns."""
        import numpy as np

        first, last = (min(max(time, -FOREVER), FOREVER) for time in (self._stretch.first, self._stretch.last))
        searching: SettingsChange | None = None
        for item in self._capture.blocks():
            if isinstance(item, LineEvent):
                given, searching = _cut_one(item, 0, self._stretch, searching)
                yield from (one for one in given if isinstance(one, LineEvent))
                continue
            reads = item.reads
            times = np.clip(reads.times, -FOREVER, FOREVER)
            kept = item.take((times >= first) & (times - reads.lengths * self._char <= last))
            if kept is not None:
                if searching is not None:
                    yield LineEvent(int(kept.reads.times[0]), LineEventKind.SETTINGS, str(searching))
                searching = None
                yield kept


def cut(items: Iterable[Item], stretch: Stretch, char: int) -> Iterator[Item]:
    """The items that lie in a stretch; a read counts when any octet of it does (`char`: ns an octet).

    A stretch that begins within a search for settings begins with an event that says so.
    """
    searching: SettingsChange | None = None  # as it stands before the stretch
    for item in items:
        duration = len(getattr(item, "octets", b"")) * char
        given, searching = _cut_one(item, duration, stretch, searching)
        yield from given


def _cut_one(
    item: Item, duration: int, stretch: Stretch, searching: SettingsChange | None
) -> tuple[list[Item], SettingsChange | None]:
    """What is given for an item that took `duration`, ns; and the search that stands as the stretch begins."""
    change = settings_change(item)
    if item.time < stretch.first:
        if change is not None and (change.searching or searching is not None):
            searching = None if change.found else SettingsChange(change.line, searching=True)
        return [], searching
    if item.time - duration > stretch.last:
        return [], searching
    if searching is not None and not (change is not None and change.searching):
        return [LineEvent(item.time, LineEventKind.SETTINGS, str(searching)), item], None
    return [item], None
