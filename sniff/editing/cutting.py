"""A stretch of a capture: by time, by frame numbers, or around what the rules found. Reads are kept whole."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime

from dissectors.findings import Finding
from dissectors.line import NS_PER_S
from sniff.analysis.judging import Judging
from sniff.bus.offline import outputs
from sniff.devices import noted_devices
from sniff.engine.capture import Capture
from sniff.engine.engine import Output
from sniff.engine.follow_settings import dissector_for
from sniff.engine.observer import observe
from sniff.engine.session import Item, LineEvent, LineEventKind, Session, SettingsChange, settings_change

_SECONDS = re.compile(r"\+?(\d+(?:\.\d{1,9})?)")
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
    """ "+12.5" (seconds from the start) or ISO 8601 (UTC where no zone is said) → ns. Raises ValueError."""
    match = _SECONDS.fullmatch(text.strip())
    if match is not None:
        whole, _, fraction = match[1].partition(".")
        return session.started + int(whole) * NS_PER_S + int(fraction.ljust(9, "0"))
    try:
        moment = datetime.fromisoformat(text.strip())
    except ValueError:
        raise ValueError(f"time {text!r}: expected seconds from the start (+12.5) or 2026-03-01T10:00:12.5Z") from None
    whole = moment.timestamp() if moment.tzinfo is not None else moment.replace(tzinfo=UTC).timestamp()
    return int(whole) * NS_PER_S + moment.microsecond * 1000


def of_frames(capture: Capture, session: Session, text: str) -> Stretch:
    """The stretch of the frames "12-40", "12-", "-40" or "12", by their numbers in `show`. Raises ValueError."""
    match = _FRAMES.fullmatch(text.strip())
    if match is None or not (match[1] or match[2]):
        raise ValueError(f"frames {text!r}: expected numbers as 12-40")
    low = int(match[1] or 1)
    high = int(match[2]) if match[2] else low if text.strip().isdigit() else FOREVER
    times = [time for no, time in _times(capture, session).items() if low <= no <= high]
    if not times:
        raise ValueError(f"frames {text!r}: this capture has none of them")
    return Stretch(times[0][0], times[-1][1])


def _times(capture: Capture, session: Session) -> dict[int, tuple[int, int]]:
    """Start and end of every row, ns, by its number."""
    return {
        row.no: (row.event.start, row.event.end)
        for output in outputs(capture.items(), session)
        if isinstance(output, Output)
        for row in output.rows
    }


def around_finding(capture: Capture, session: Session, code: str) -> Stretch:
    """The stretch from the first to the last evidence of the first finding with that code. Raises ValueError."""
    judging = Judging(session, dissector_for(session), noted_devices(session))
    observe(outputs(capture.items(), session), judging)
    findings = judging.findings()
    chosen: Finding | None = next((finding for finding in findings if finding.code == code.upper()), None)
    if chosen is None:
        there = ", ".join(sorted({finding.code for finding in findings})) or "none"
        raise ValueError(f"finding {code!r}: not in this capture; there are: {there}")
    times = _times(capture, session)
    evidence = [times[no] for no in chosen.evidence if no in times]
    if not evidence:
        return Stretch(chosen.first, chosen.last)
    return Stretch(min(start for start, _ in evidence), max(end for _, end in evidence))


def cut(items: Iterable[Item], stretch: Stretch, char: int) -> Iterator[Item]:
    """The items that lie in a stretch; a read counts when any octet of it does (`char`: ns an octet).

    A stretch that begins within a search for settings begins with an event that says so.
    """
    searching: SettingsChange | None = None  # as it stands before the stretch
    for item in items:
        octets = len(getattr(item, "octets", b""))
        change = settings_change(item)
        if item.time < stretch.first:
            if change is not None and (change.searching or searching is not None):
                searching = None if change.found else SettingsChange(change.line, searching=True)
        elif item.time - octets * char <= stretch.last:
            if searching is not None and not (change is not None and change.searching):
                yield LineEvent(item.time, LineEventKind.SETTINGS, str(searching))
            searching = None
            yield item
