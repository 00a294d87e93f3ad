"""What times of a log leave out: the day of a time of day, the year of a date, and when summer time began. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import UTC, datetime, timedelta
from decimal import Decimal, InvalidOperation

from dissectors.line import NS_PER_S
from dissectors.words import duration
from sniff.engine.session import LineEvent, LineEventKind
from sniff.formats.log_clock import DAY, Stamp, stamp_of
from sniff.formats.log_times import Times

HOUR = 3600 * NS_PER_S

_MARCH = 59 * DAY
"""From the begin of a year that is no leap year."""

_LONGEST_WAIT = 300 * NS_PER_S
"""ns for which nobody may have spoken when summer time began; after a longer silence it was one."""

_WRITTEN_LATE = 60 * NS_PER_S
"""ns after midnight within which a line may still have a time of before it."""

_BEGINS, _ENDS = frozenset((3, 4, 9, 10)), frozenset((3, 4, 10, 11))
"""Months in which summer time begins somewhere, and ends."""
_LATEST_HOUR = 3
_SUNDAY = 6
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


class Year:
    """The year of dates that say none: after December comes the next one; one is a leap year once it shows."""

    def __init__(self) -> None:
        self._begin = 0  # ns after that of 1970
        self._is_leap = False
        self._last = 0

    def time_of(self, stamp: Stamp) -> int:
        """ns since the begin of the first year, 1970 for all that the log says."""
        self._is_leap = self._is_leap or stamp.leap_day
        time = self._time_of(stamp)
        if time < self._last - 183 * DAY:
            self._begin += (366 if self._is_leap else 365) * DAY
            self._is_leap = stamp.leap_day
            time = self._time_of(stamp)
        self._last = time
        return time

    def _time_of(self, stamp: Stamp) -> int:
        is_later = self._is_leap and not stamp.leap_day and stamp.time >= _MARCH
        return self._begin + stamp.time + (DAY if is_later else 0)


class Calendar:
    """What the stamps of a log say, as times that go on over midnight, New Year and the begin of summer time. `steps`:
    each is the time since the one before."""

    def __init__(self, steps: bool) -> None:
        self._steps = steps
        self._year = Year()
        self._day = 0
        self._date = 0  # of the stamp that told one last
        self._clock = -1
        self._summer = 0  # ns
        self._last: int | None = None

    def time_of(self, stamp: Stamp) -> tuple[int, int]:
        """ns of a stamp, and by how much the clock was put forward before it."""
        time, turned = self._time_of(stamp), 0
        if self._last is not None and stamp.local and begins_summer(self._last, time):
            turned = HOUR
        self._summer, self._last = self._summer - turned, time
        return time + self._summer, turned

    def _time_of(self, stamp: Stamp) -> int:
        if self._steps:
            self._clock = max(self._clock, 0) + stamp.time
            return self._clock
        if not stamp.daily:
            time = self._year.time_of(stamp) if stamp.yearly else stamp.time
            if stamp.dated:
                self._date, self._clock = time // DAY * DAY - self._day * DAY, time % DAY
            return time
        if self._day and stamp.time > self._clock + DAY - _WRITTEN_LATE:
            return self._date + (self._day - 1) * DAY + stamp.time
        if self._clock >= 0 and stamp.time < self._clock - DAY // 2:
            self._day += 1
        self._clock = stamp.time
        return self._date + self._day * DAY + stamp.time


def begins_summer(last: int, time: int) -> bool:
    """Whether clocks were put forward between two local times, ns: an hour is missing from a full one on, in a night to
    Sunday in which that is done somewhere."""
    return _is_turn(last, time - HOUR, _BEGINS)


def ends_summer(last: int, time: int) -> bool:
    """Whether clocks were put back: an hour comes again."""
    return _is_turn(last, time + HOUR, _ENDS)


def _is_turn(last: int, time: int, months: frozenset[int]) -> bool:
    """`time`: by the clock before."""
    full = time // HOUR * HOUR
    if not last < full <= time <= last + _LONGEST_WAIT:
        return False
    try:
        local = _EPOCH + timedelta(seconds=full // NS_PER_S)
    except OverflowError:
        return False
    return local.weekday() == _SUNDAY and local.month in months and local.hour <= _LATEST_HOUR


def turn(time: int, by: int) -> LineEvent:
    """What is told of a clock that was put forward by so many ns, or back (less than 0)."""
    words = "goes ahead by an hour" if by > 0 else f"goes back by {duration(-by)}"
    return LineEvent(time, LineEventKind.CLOCK, f"the log's clock {words}", by)


def calendar_of(cells: Sequence[str], times: Times) -> tuple[bool, bool]:
    """Whether cells are times of a day, and whether they are dates without a zone."""
    stamps = [None if _is_number(cell) else stamp_of(cell.strip(), times) for cell in cells]
    told = [stamp for stamp in stamps if stamp is not None]
    if not told or len(told) < len(stamps):
        return False, False
    return all(stamp.daily for stamp in told), all(stamp.local for stamp in told)


def _is_number(cell: str) -> bool:
    try:
        return Decimal(cell.strip().replace(",", ".")).is_finite()
    except InvalidOperation:
        return False


def carried_on(times: Sequence[int], daily: bool, local: bool) -> Iterator[tuple[int, int]]:
    """Times, ns, that go on where those of rows did not, each with by how much the clock was put forward since the one
    before, or back (less than 0): by summer time (`local`). Times of day go on after midnight (`daily`).
    """
    shift, before = 0, times[0] if times else 0
    for time in times:
        turned = 0
        if daily and time < before - DAY // 2:
            shift += DAY
        elif local and begins_summer(before, time):
            turned = HOUR
        elif local and ends_summer(before, time):
            turned = -HOUR
        shift -= turned
        before = time
        yield time + shift, turned
