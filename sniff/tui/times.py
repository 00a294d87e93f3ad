"""Times and sizes as text for narrow columns. Pure."""

from __future__ import annotations

from datetime import datetime
from enum import Enum

from dissectors.line import MS, NS_PER_S
from dissectors.words import bare_milliseconds

UNTIMED = "not known: the log does not say when anything came"
"""Of a capture whose octets are laid one behind the other (`Session.has_times`)."""
LEAST = 5_000
"""ns; what is shorter would be written as 0.00 ms."""
UNTOLD = 0.012
"""Part of an interval by which two may differ and be counted as alike (`dissectors.histogram`), halved."""


class TimeMode(Enum):
    """How the time column counts; `t` goes round."""

    ABSOLUTE = "absolute"
    RELATIVE = "relative"
    DELTA = "delta"

    @property
    def title(self) -> str:
        """Title of the column, at most 12 characters, with the unit where it counts in one."""
        return _TITLES[self]

    @property
    def words(self) -> str:
        """What the column says then."""
        return _WORDS[self]

    def next(self) -> TimeMode:
        """The one after it."""
        modes = list(TimeMode)
        return modes[(modes.index(self) + 1) % len(modes)]


_TITLES = {TimeMode.ABSOLUTE: "time", TimeMode.RELATIVE: "s from start", TimeMode.DELTA: "s from last"}
_WORDS = {
    TimeMode.ABSOLUTE: "time of day",
    TimeMode.RELATIVE: "seconds since the capture began",
    TimeMode.DELTA: "seconds since the row above began",
}


def clock(time: int) -> str:
    """Local time of day to the millisecond, "10:00:00.123"; ns since the Unix epoch."""
    return f"{_local(time):%H:%M:%S}.{time % NS_PER_S // MS:03d}"


def day_and_clock(time: int, begin: int, end: int) -> str:
    """The same with its day where what is shown, from `begin` to `end` (ns), is of several: "03-02 10:00:00.123"."""
    days = {_local(one).date() for one in (begin, end)}
    return clock(time) if len(days) == 1 else f"{_local(time):%m-%d} {clock(time)}"


def between(first: int, last: int) -> str:
    """Two moments, or one: "10:00:00.123 … 10:02:03.456"."""
    begin = day_and_clock(first, first, last)
    return begin if first == last else f"{begin} … {day_and_clock(last, first, last)}"


def date_and_clock(time: int) -> str:
    """Local date and time to the microsecond with the zone, "2026-03-01 10:00:00.123456 +0000"."""
    local = _local(time)
    return f"{local:%Y-%m-%d %H:%M:%S}.{time % NS_PER_S // 1_000:06d} {local:%z}"


def seconds(time: int, places: int = 6) -> str:
    """A span in seconds with sign, "+12.345678"; the size of the column bounds what makes sense."""
    sign = "-" if time < 0 else "+"
    whole, rest = divmod(abs(time), NS_PER_S)
    return f"{sign}{whole}.{rest:09d}"[: len(str(whole)) + 2 + places]


def interval(time: int | None) -> str:
    """Milliseconds from one time to the next, with a decimal where there are few; "–" where nothing is known."""
    return "–" if time is None else f"{time / MS:.0f}" if time >= 10 * MS else f"{time / MS:.1f}"


def latency(time: int) -> str:
    """Milliseconds without the unit; no answer takes no time."""
    return "<0.01" if 0 <= time < LEAST else bare_milliseconds(time)


def jitter(time: int | None, usual: int | None) -> str:
    """By how much intervals differ, ms. `usual`: how long they are: smaller differences than counting them in classes
    tells apart are no 0."""
    if time or time is None or usual is None:
        return interval(time)
    return f"<{interval(max(MS // 10, int(usual * UNTOLD)))}"


def size(octets: int) -> str:
    """A file size in at most 8 characters, "12.3 MB" (decimal units)."""
    value, unit = float(octets), "B"
    for unit in ("B", "kB", "MB", "GB", "TB"):
        if value < 999.5 or unit == "TB":
            break
        value /= 1000
    return f"{value:.0f} {unit}" if unit == "B" or value >= 99.95 else f"{value:.1f} {unit}"


def ahead_of_utc(time: int) -> int:
    """By how many ns the clocks of this machine's zone are ahead of UTC at a time, ns."""
    ahead = _local(time).utcoffset()
    return 0 if ahead is None else int(ahead.total_seconds()) * NS_PER_S


def _local(time: int) -> datetime:
    """Local time; times that no calendar has are shown as the epoch's."""
    try:
        return datetime.fromtimestamp(time // NS_PER_S).astimezone()
    except (OverflowError, OSError, ValueError):
        return datetime.fromtimestamp(0).astimezone()
