"""Dates and times of day in BACnet, with wildcards and with what cannot be meant (ANSI/ASHRAE 135, 20.2.12, 13)."""

from __future__ import annotations

from calendar import monthrange
from dataclasses import dataclass
from datetime import date
from enum import Enum

ANY = 255
"""In any part of a date or time: not said, or any."""

WEEKDAYS = ("Monday", "Tuesday", "Wednesday", "Thursday", "Friday", "Saturday", "Sunday")

MONTHS = (  # noqa: SIM905
    "January February March April May June July August September October November December"
).split()
_ODD_MONTH, _EVEN_MONTH = 13, 14
_LAST_DAY, _ODD_DAY, _EVEN_DAY = 32, 33, 34


class WhenFlaw(Enum):
    """Why a date or time of day cannot be meant."""

    NO_SUCH_DAY = "no such day"
    NO_SUCH_TIME = "no such time"
    NO_SUCH_WEEKDAY = "no such weekday"
    OTHER_WEEKDAY = "the date is another weekday"


@dataclass(frozen=True, slots=True)
class Date:
    """A date as sent: `year` since 1900, 255 in any part = any; months 13 odd, 14 even; day 32 = last of the month."""

    year: int
    month: int
    day: int
    weekday: int  # 1 = Monday

    @property
    def plain(self) -> str:
        """The date without its weekday: "2024-04-05", "*-12-last"."""
        year = "*" if self.year == ANY else str(1900 + self.year)
        month = {ANY: "*", _ODD_MONTH: "odd", _EVEN_MONTH: "even"}.get(self.month, f"{self.month:02}")
        day = {ANY: "*", _LAST_DAY: "last", _ODD_DAY: "odd", _EVEN_DAY: "even"}.get(self.day, f"{self.day:02}")
        return f"{year}-{month}-{day}"

    @property
    def true_weekday(self) -> int | None:
        """The weekday of the calendar, 1 = Monday; None where the date is no single day."""
        try:
            return date(1900 + self.year, self.month, self.day).isoweekday() if self.year != ANY else None
        except ValueError:
            return None

    @property
    def flaw(self) -> WhenFlaw | None:
        """What is wrong with it, None where it can be meant."""
        if not self._exists():
            return WhenFlaw.NO_SUCH_DAY
        if self.weekday == ANY:
            return None
        if not 1 <= self.weekday <= 7:
            return WhenFlaw.NO_SUCH_WEEKDAY
        return WhenFlaw.OTHER_WEEKDAY if self.true_weekday not in (None, self.weekday) else None

    def _exists(self) -> bool:
        if not (1 <= self.month <= _EVEN_MONTH or self.month == ANY):
            return False
        if not (1 <= self.day <= _EVEN_DAY or self.day == ANY):
            return False
        if self.day > 31 or self.month > 12:
            return True
        leap = self.year == ANY or monthrange(1900 + self.year, 2)[1] == 29
        longest = 29 if self.month == 2 and leap else monthrange(1901, self.month)[1]
        return self.day <= longest

    def __str__(self) -> str:
        """The date, its weekday where it has one, and what does not fit: "2024-04-05 Thursday (it is a Friday)"."""
        known = 1 <= self.weekday <= 7
        weekday = WEEKDAYS[self.weekday - 1] if known else f"weekday {self.weekday}"
        words, flaw = "" if self.weekday == ANY else " " + weekday, self.flaw
        if flaw is WhenFlaw.OTHER_WEEKDAY and self.true_weekday is not None:
            words += f" (it is a {WEEKDAYS[self.true_weekday - 1]})"
        elif flaw is not None:
            words += f" ({flaw.value})"
        return self.plain + words


@dataclass(frozen=True, slots=True)
class Time:
    """A time of day as sent; 255 in any part = any."""

    hour: int
    minute: int
    second: int
    hundredths: int

    @property
    def plain(self) -> str:
        """The time: "19:23:00.00", "*" for any."""
        parts = ["*" if part == ANY else f"{part:02}" for part in (self.hour, self.minute, self.second)]
        tail = "*" if self.hundredths == ANY else f"{self.hundredths:02}"
        return ":".join(parts) + "." + tail

    @property
    def flaw(self) -> WhenFlaw | None:
        """What is wrong with it, None where it can be meant."""
        parts = ((self.hour, 23), (self.minute, 59), (self.second, 59), (self.hundredths, 99))
        return None if all(part <= most or part == ANY for part, most in parts) else WhenFlaw.NO_SUCH_TIME

    def __str__(self) -> str:
        return self.plain if self.flaw is None else f"{self.plain} ({WhenFlaw.NO_SUCH_TIME.value})"


_WEEKS = {
    1: "days 1-7",
    2: "days 8-14",
    3: "days 15-21",
    4: "days 22-28",
    5: "days 29-31",
    6: "last 7 days",
    7: "7 days before the last 7",
    8: "7 days before the last 14",
    9: "7 days before the last 21",
    ANY: "any week",
}


def week_and_day(octets: bytes) -> str | None:
    """A BACnetWeekNDay: "Friday of last 7 days of any month"; None where the octets are none (clause 21)."""
    if len(octets) != 3:
        return None
    month, week, weekday = octets
    months = {ANY: "any month", _ODD_MONTH: "odd months", _EVEN_MONTH: "even months"} | dict(enumerate(MONTHS, 1))
    days = {ANY: "any day"} | dict(enumerate(WEEKDAYS, 1))
    if month not in months or week not in _WEEKS or weekday not in days:
        return None
    return f"{days[weekday]} of {_WEEKS[week]} of {months[month]}"
