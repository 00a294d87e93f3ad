"""What dates of a log leave out: which year it is, and when summer time began. Pure."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

from dissectors.line import NS_PER_S
from sniff.formats.log_clock import DAY, Stamp

HOUR = 3600 * NS_PER_S

_MARCH = 59 * DAY
"""From the begin of a year that is no leap year."""

_LONGEST_WAIT = 300 * NS_PER_S
"""ns for which nobody may have spoken when summer time began; after a longer silence it was one."""

_MONTHS = frozenset((3, 4, 9, 10))
_LATEST_HOUR = 3
_SUNDAY = 6
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


class Year:
    """The year of dates that say none: after December comes the next one; it has a 29th of February once one was seen."""

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


def begins_summer(last: int, time: int) -> bool:
    """Whether clocks were put forward between two local times, ns: an hour is missing from a full one on, in a night to
    Sunday in which that is done somewhere."""
    full = (time - HOUR) // HOUR * HOUR
    if not last < full <= time - HOUR <= last + _LONGEST_WAIT:
        return False
    try:
        local = _EPOCH + timedelta(seconds=full // NS_PER_S)
    except OverflowError:
        return False
    return local.weekday() == _SUNDAY and local.month in _MONTHS and local.hour <= _LATEST_HOUR
