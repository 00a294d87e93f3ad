"""Clocks that set the same devices to different times (TimeSynchronization and its UTC kind; ASHRAE 135, 16.7, 16.8).

What one sender tells is compared with what another one told just before it, each by when it came: so a capture whose
clock was set shows once what two clocks show each time."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta

from dissectors.bacnet import message as messages
from dissectors.bacnet.station_address import remote
from dissectors.findings import Finding, Rule, Severity, Tally, times
from dissectors.frame import Event, Frame, Header
from dissectors.line import NS_PER_S, Timing
from dissectors.row_columns import RowColumns
from dissectors.words import duration

TIME_RULES = (
    Rule(
        "MS706",
        Severity.WARNING,
        "two clocks",
        "Two senders tell the time (TimeSynchronization, or its UTC kind), one behind the other, and what they tell "
        "differs by over a minute, measured by when it came. Once is only noted: a clock may have been set. Not where "
        "the capture has no times.",
        "two programs set the clocks of the same devices: schedules run twice or not at all, records are out of order",
        "let one of them tell the time; the time zone and the summer time of the other",
    ),
)

KINDS = ("time-synchronization", "utc-time-synchronization")
APART = 60 * NS_PER_S
_DATE, _TIME = 0xA4, 0xB4  # application tags with their lengths
_CENTURY = 1900
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


@dataclass(slots=True)
class _Told:
    """What was told of one kind. `by`, `ahead`: who told the time last, and what it told less when it came, ns.
    `apart`: how often another one told another time then; `words`: the newest of these."""

    by: str | None = None
    ahead: int = 0
    apart: Tally = field(default_factory=Tally)
    words: str = ""

    def tell(self, who: str, ahead: int, no: int, frame: Frame) -> None:
        by, between = self.by, ahead - self.ahead
        if by is not None and by != who and abs(between) > APART:
            first, last = (by, who) if between > 0 else (who, by)
            self.words = f"that of {last} is {duration(abs(between))} ahead of that of {first}"
            self.apart.add(frame.end, no)
        self.by, self.ahead = who, ahead


class ToldTimes:
    """Fed row by row, or many at once; gives findings at any time."""

    def __init__(self, timing: Timing) -> None:
        self._has_times = timing.has_times
        self._told = {kind: _Told() for kind in KINDS}

    def see(self, no: int, event: Event, header: Header | None) -> None:
        """Take the next row."""
        if header is None or header.kind not in KINDS or not header.ok or not isinstance(event, Frame):
            return
        message = messages.read(event)
        if message is None or message.npdu is None or message.source is None:
            return
        time = _time_of(message.parameters)
        npdu = message.npdu
        who = f"MAC {message.source}" if npdu.snet is None else remote(npdu.snet, npdu.sadr or b"")
        if time is not None and self._has_times:
            self._told[header.kind].tell(who, time - event.end, no, event)

    def take(self, rows: RowColumns) -> None:
        """Take many rows."""
        frames = rows.frames
        for kind in KINDS:
            if kind in frames.names:
                for place in (rows.good & (frames.kind == frames.names.index(kind))).nonzero()[0].tolist():
                    row = rows.row(place)
                    self.see(row.no, row.event, row.header)

    def findings(self) -> Iterable[Finding]:
        """What was found so far."""
        for kind, told in self._told.items():
            count = told.apart.count
            if count:
                seen = f"{kind}: {times(count)} another time than just before; {told.words}"
                yield told.apart.found(TIME_RULES[0], "bus", seen, Severity.NOTE if count == 1 else None)


def _time_of(parameters: bytes) -> int | None:
    """The time that is told, ns, as if it were UTC; None where it is not whole, or no time."""
    if len(parameters) < 10 or (parameters[0], parameters[5]) != (_DATE, _TIME):
        return None
    year, month, day, _ = parameters[1:5]
    hour, minute, second, hundredth = parameters[6:10]
    try:
        told = datetime(_CENTURY + year, month, day, hour, minute, second, hundredth * 10_000, tzinfo=UTC)
    except ValueError:
        return None
    return (told - _EPOCH) // timedelta(microseconds=1) * 1000
