"""The times that tools write into a line of text. Pure. A new clock is a line of CLOCKS."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from decimal import Decimal

from dissectors.checksums import ends_with_crc16
from dissectors.line import MS, NS_PER_S
from dissectors.quick_values import quickly_made
from sniff.formats.log_times import AS_WRITTEN, BARE, EPOCH, Order, Times, day_of
from sniff.formats.table_cells import MOST, UNITS, seconds

_TIME = (
    r"(?:(?P<ahead>[AaPp]\.?[Mm]\.?|上午|下午|오전|오후) ?)?"
    r"(?P<clock>\d{1,2}:\d{2}:\d{2}"
    r"(?:[.,]\d{3},\d{3}(?=[\]\s])"
    r"|[.,]\d{1,9}(?!\d|[A-Fa-f](?![Mm]\b)|(?<=,\d\d)\.\d|(?<=,\d)\.\d)|:\d{3}(?![\d:]))?)"  # not ,01CB or ,21.5
    r"(?!\d|:[0-9A-Za-z])(?:[ \u00a0\u202f]?(?P<half>[AaPp](?:[Mm]\b|\. ?[Mm]\.)))?"
)
_MONTHS = ["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"]
_MONTH = r"(?P<month>Jan|Feb|Mar|Apr|May|Jun|Jul|Aug|Sep|Oct|Nov|Dec)[a-z]*"
_BEGIN = r"(?<![0-9A-Za-z:.])"
DAY = 86_400 * NS_PER_S


@quickly_made
@dataclass(frozen=True, slots=True)
class Stamp:
    """A time in a line. `time`: ns since the epoch (`dated`), since midnight or since the tool's start. `tick`: ns, the
    finest that it tells. `begin`, `end`: where it stands. `local`: a date and time that says no zone. `yearly`: one
    that says no year either, taken as of 1970; `leap_day`: it is the 29th of February, which is the 1st of March there.
    """

    time: int
    tick: int
    begin: int
    end: int
    dated: bool = False
    daily: bool = False
    assumed: bool = False
    """Whether nobody said what its number counts."""
    local: bool = False
    yearly: bool = False
    leap_day: bool = False


@dataclass(frozen=True, slots=True)
class Clock:
    """A way to write a time. `value`: match, order of a date → ns; ValueError when it is none after all. `first`: only
    where nothing but brackets stands before it.
    """

    name: str
    pattern: re.Pattern[str]
    value: Callable[[re.Match[str], Order | None], int]
    dated: bool = False
    daily: bool = False
    first: bool = False
    unit: int = 0
    """ns that its number counts, where nothing that stands beside it says so."""


def _dated(match: re.Match[str], order: Order | None) -> int:
    found = match.groupdict()
    zone = found.get("zone") or ""
    return midnight(found["date"], order) + _of_day(match) - _east(zone)


def _east(zone: str) -> int:
    """ns that a time of a zone is ahead of UTC."""
    zone = zone.strip()
    if zone[:1] not in ("+", "-"):
        return 0
    return (int(zone[1:3]) * 60 + int(zone[-2:])) * 60 * NS_PER_S * (1 if zone[0] == "+" else -1)


def _named_month(match: re.Match[str], _order: Order | None) -> int:
    found = match.groupdict()
    year, name = int(found.get("year") or 1970), found["month"].lower()
    month, day = _MONTHS.index(name[:3]) + 1 if name[0].isalpha() else int(name), int(found["day"])
    midnight = _midnight(year, *((3, 1) if _is_leap_day(found) else (month, day)))
    return midnight + _of_day(match) - _east(found.get("zone") or "")


def _is_leap_day(found: Mapping[str, str | None]) -> bool:
    """Whether a date without a year is one that only some have."""
    is_february = (found.get("month") or "").lower()[:3] in ("feb", "2", "02")
    return not found.get("year") and is_february and found["day"] == "29"


def _of_day(match: re.Match[str], _order: Order | None = None) -> int:
    """ns since midnight."""
    hours, minutes, *rest = _parts_joined(match["clock"]).split(":")
    hour = int(hours)
    found = match.groupdict()
    half = (found.get("half") or found.get("ahead") or "").lower()
    if half:
        hour = hour % 12 + (12 if half[0] in "p下" or half == "오후" else 0)
    return (hour * 60 + int(minutes)) * 60 * NS_PER_S + seconds(".".join(rest))


def _parts_joined(clock: str) -> str:
    """A time of day with a point before the parts of its second: `1:02:03,456,789` has them in two groups."""
    whole, _, parts = clock.replace(",", ".").partition(".")
    return f"{whole}.{parts.replace('.', '')}" if parts else whole


def _days(match: re.Match[str], _order: Order | None = None) -> int:
    return int(match["days"]) * DAY + _of_day(match)


def _scaled(unit: int) -> Callable[[re.Match[str], Order | None], int]:
    return lambda match, _order: int(Decimal(match["number"]) * unit)


def _minutes(match: re.Match[str], _order: Order | None) -> int:
    return int(match["m"]) * 60 * NS_PER_S + seconds(match["s"])


def _dashed(match: re.Match[str], _order: Order | None) -> int:
    hours, minutes, rest = re.split("[-.]", match["dashed"], maxsplit=2)
    return (int(hours) * 60 + int(minutes)) * 60 * NS_PER_S + seconds(rest)


def _packed(match: re.Match[str], _order: Order | None) -> int:
    digits, _, parts = re.sub(r"[T_ -]", "", match["packed"]).replace(",", ".").partition(".")
    year, month, day, hour, minute = (int(digits[:4]), *(int(digits[at : at + 2]) for at in (4, 6, 8, 10)))
    of_day = (hour * 60 + minute) * 60 * NS_PER_S + seconds(f"{digits[12:14]}.{digits[14:] or parts or 0}")
    return _midnight(year, month, day) + of_day


def _epoch(match: re.Match[str], _order: Order | None) -> int:
    """s, ms, µs or ns, as many digits say; eight octets of a message with its check are none."""
    number = match["since"].replace(",", ".")
    if len(number) == 16 and number.isdigit() and ends_with_crc16(bytes.fromhex(number)):
        raise ValueError("octets")
    return int(Decimal(number) * _epoch_unit(number))


def _epoch_unit(number: str) -> int:
    """ns that a number since the epoch counts."""
    tens = len(number.partition(".")[0]) - len(str(EPOCH[0]))
    return int(NS_PER_S // 10**tens)


def _named(match: re.Match[str], _order: Order | None) -> int:
    return int(Decimal(match["number"]) * _unit(match))


def _tai(match: re.Match[str], _order: Order | None) -> int:
    """A label of daemontools: seconds of TAI from 2**62 on, 10 ahead of the system's, and ns."""
    return (int(match["tai"], 16) - (1 << 62) - 10) * NS_PER_S + int(match["nano"], 16)


def _unit(match: re.Match[str]) -> int:
    """ns that the number of a named time counts: as its name says, or its size; parts of a second where it has any."""
    said = match["unit"] or match["unit_behind"]
    if said:
        return UNITS[said.lower()]
    number = Decimal(match["number"])
    for unit in (NS_PER_S, MS, MS // 1000, 1):
        if EPOCH[0] * NS_PER_S <= number * unit <= EPOCH[1] * NS_PER_S:
            return unit
    return NS_PER_S if "." in match["number"] else MS


def _clock(pattern: str) -> re.Pattern[str]:
    return re.compile(_BEGIN + pattern)


CLOCKS: tuple[Clock, ...] = (
    Clock("date and time", _clock(rf"(?P<date>\d{{1,4}}[-./]\d{{1,2}}[-./]\d{{1,4}})(?:[ Tt_:@-]|, ?| +){_TIME}"
                                  r"(?P<zone>[Zz]| ?[+-]\d\d:?\d\d(?![\d.])|  [+-]\d\d:\d\d(?![\d.:]))?"), _dated,
          dated=True),
    Clock("day, month by name, year and time", _clock(rf"(?P<day>\d{{1,2}})[-/ ]{_MONTH}[-/ ]"
                                                               rf"(?P<year>\d{{4}})[ ,T:]+{_TIME}"
                                                               r"(?P<zone>Z| ?[+-]\d\d:?\d\d(?![\d.]))?"),
          _named_month, dated=True),
    Clock("month by name, day, time and year", _clock(rf"{_MONTH} +(?P<day>\d{{1,2}}),? {_TIME}"
                                                            r"(?: (?P<year>\d{4}))?"),
          _named_month, dated=True),
    Clock("day in Chinese and time", _clock(r"(?P<year>\d{4})[年년] ?(?P<month>\d{1,2})[月월] ?"
                                            r"(?P<day>\d{1,2})[日일] *" + _TIME), _named_month, dated=True),
    Clock("month, day and time", _clock(r"(?P<month>0[1-9]|1[0-2])[-/](?P<day>0[1-9]|[12]\d|3[01])[ T]" + _TIME),
          _named_month, dated=True, first=True),
    Clock("time and date", _clock(rf"{_TIME},? (?P<date>\d{{1,4}}/\d{{1,2}}/\d{{1,4}})(?![0-9A-Za-z/.:-])"), _dated,
          dated=True),
    Clock("days and time of day", _clock(rf"(?P<days>\d{{1,4}}):(?=\d\d:){_TIME}"), _days, first=True),
    Clock("time of day", _clock(_TIME), _of_day, daily=True),
    Clock("time of day behind a label", re.compile(
              r"(?<=[G-Zg-z]:)(?P<clock>\d{1,2}:\d{2}:\d{2}[.,]\d{3,6})(?!\d)"), _of_day, daily=True),
    Clock("date and time without signs", _clock(
              r"(?P<packed>(?:19|20)\d\d(?:0[1-9]|1[0-2])(?:0[1-9]|[12]\d|3[01])[T_ -]?"
              r"(?:[01]\d|2[0-3])[0-5]\d[0-5]\d(?:[.,]\d{1,9}|\d{3})?)(?P<zone>Z?)(?![0-9A-Za-z])"), _packed,
          dated=True),
    Clock("TAI64N", _clock(r"@(?P<tai>4[0-9a-f]{15})(?P<nano>[0-3][0-9a-f]{7})(?![0-9a-f])"), _tai, dated=True,
          first=True),
    Clock("since the epoch, alone", re.compile(
              r"^[\[(<]?(?P<since>1[5-8]\d{8}(?:[.,]\d{1,9}|\d{3}|\d{6}|\d{9}))[\])>:]?$"), _epoch, dated=True),
    Clock("ms since the epoch", _clock(r"(?P<number>1\d{12})(?=[\s:;,\])|])"), _scaled(MS), dated=True, first=True),
    Clock("ns since the epoch, behind", re.compile(r"(?<=\s)(?P<number>1\d{18})$"), _scaled(1), dated=True, unit=1),
    Clock("minutes and seconds", _clock(r"(?P<clock>(?P<m>\d{1,3}):(?P<s>\d{2}\.\d{1,6}))(?![\d:])"),
          _minutes, first=True),
    Clock("time of day with dashes",
          _clock(r"(?P<dashed>[0-2]?\d(?:-[0-5]\d-|\.[0-5]\d\.)[0-5]\d[.,]\d{1,6})(?![0-9A-Za-z.])"), _dashed,
          daily=True, first=True),
    Clock("ms", _clock(r"[+]?(?P<number>-?\d{1,12}(?:\.\d{1,6})?) ?ms\b"), _scaled(MS), first=True),
    Clock("µs", _clock(r"[+]?(?P<number>-?\d{1,15}(?:\.\d{1,6})?) ?[uµμ]s\b"), _scaled(MS // 1000), first=True),
    Clock("seconds", _clock(r"[+]?(?P<number>-?\d{1,10}\.\d{1,9})(?P<said> ?s(?:ec)?\b)?(?=[\s:;,\])|])"),
          _scaled(NS_PER_S), first=True),
    Clock("µs of trace events", re.compile(r"(?<=\"ph\": \"B\", \"ts\": )(?P<number>\d{1,15}\.\d{1,6})"),
          _scaled(MS // 1000), unit=MS // 1000),
    Clock("a named number", re.compile(
              r"(?<![0-9A-Za-z])(?:ts|t|time|timestamp|zeit|uptime|elapsed|millis)(?:[_ ]?(?P<unit>ms|us|ns|s))?\"?"
              r"\s*[:=]\s*\"?(?P<number>-?\d{1,19}(?:\.\d{1,9})?)(?:\s?(?P<unit_behind>ms|us|µs|ns|s))?(?![0-9A-Za-z:-]|\.\d)",
              re.IGNORECASE), _named),
    Clock("µs of usbmon", re.compile(
              r"(?:(?<=^[0-9a-f]{16} )|(?<=^[0-9a-f]{8} ))(?P<number>\d{1,12})(?= [SCE] [BCIZ][io]:)"),
          _scaled(MS // 1000), unit=MS // 1000),
    Clock("ms before a bar", _clock(r"(?P<number>(?!00)\d{3,10})\|"), _scaled(MS), first=True),
)  # fmt: skip
"""The most telling first."""

_HEAD = 160
"""Characters at the begin of a line in which a time is looked for."""
_TAIL = 80
_ONLY_BRACKETS = re.compile(
    r"(?:\s*\d{1,7}\s+|\[pid +\d+\]|[A-Z][a-z]{2}\(\d+\):|[a-z]\w*-\d{1,3}:)?[\s\[({<#*|+]*(?:\[?[A-Z]\]?[ ]?)?"
)


def stamp_of(line: str, times: Times = AS_WRITTEN) -> Stamp | None:
    """The time in a line, None when there is none."""
    head = line[:_HEAD].replace("\t", " ")
    if times.unit and (bare := BARE.match(head)) is not None:
        text = bare["number"].replace(",", ".")
        tick = max(1, times.unit // 10 ** len(text.partition(".")[2]))
        time = int(Decimal(text) * times.unit)
        return Stamp(time, tick, *bare.span("number"), times.since_1970) if abs(time) < MOST else None
    for clock in CLOCKS:
        match = clock.pattern.search(head)
        if (
            match is None
            or (times.clocks_only and not (clock.dated or clock.daily))
            or (clock.first and not _ONLY_BRACKETS.fullmatch(head[: match.start()]))
        ):
            continue
        try:
            time = clock.value(match, times.order)
        except ValueError:
            continue
        if abs(time) >= MOST:
            continue
        dated = clock.dated or ("number" in match.groupdict() and time >= EPOCH[0] * NS_PER_S)
        groups = match.groupdict()
        assumed = not dated and (
            groups.get("said", "") is None or (groups.get("unit", "") or groups.get("unit_behind", "")) is None
        )
        local, yearly = dated and "clock" in groups and not groups.get("zone"), dated and groups.get("year", "") is None
        return Stamp(
            time,
            _tick(match, clock.unit),
            match.start(),
            match.end(),
            dated,
            clock.daily,
            assumed,
            local,
            yearly,
            yearly and _is_leap_day(groups),
        )
    return _behind(line, times) if len(line) > _HEAD and not times.unit else None


def _behind(line: str, times: Times) -> Stamp | None:
    """A date and time at the end of a long line."""
    begin = max(_HEAD, len(line) - _TAIL)
    found = stamp_of(line[begin:], times)
    if found is None or not found.dated:
        return None
    return replace(found, begin=found.begin + begin, end=found.end + begin)


def _tick(match: re.Match[str], counted: int = 0) -> int:
    """ns: the place of the last digit. `counted`: ns of the number."""
    found = match.groupdict()
    if counted:
        return max(1, counted // int(10 ** len(match["number"].partition(".")[2])))
    if "nano" in found:
        return 1
    if "since" in found:
        number = match["since"].replace(",", ".")
        return max(1, _epoch_unit(number) // int(10 ** len(number.partition(".")[2])))
    text = (
        found.get("clock") or found.get("dashed") or _packed_decimals(found.get("packed")) or found.get("number") or ""
    )
    unit = NS_PER_S
    if "unit_behind" in found:
        unit = _unit(match)
    elif found.get("number") is not None:
        tail = match[0].lstrip("+")[len(text) :].strip()
        unit = (
            MS
            if tail.startswith(("ms", "|")) or len(text) == 13
            else MS // 1000
            if tail[:1] in "uµμ" and tail
            else unit
        )
    elif text.count(":") == 3:
        return MS
    _, _, decimals = _parts_joined(text).partition(".")
    tick: int = unit // 10 ** len(decimals)
    return max(1, tick)


def _packed_decimals(packed: str | None) -> str:
    """A time without signs with a point before the parts of its second."""
    digits = re.sub(r"[T_ -]", "", packed or "")
    return f"{digits[:14]}.{digits[14:]}" if digits[14:].isdigit() else digits


def midnight(date: str, order: Order | None = None) -> int:
    """ns since the epoch, as UTC; 13.02.2006 is day first, 2/13/2006 is month first (day first where it must be),
    2006-02-13 year first, unless `order` says otherwise. 0 for no such day.
    """
    first, second, third = (int(part) for part in re.split(r"[-./]", date))
    if first > 31:
        first, second, third, order = third, second, first, Order.DAY_FIRST
    elif order is None:
        order = Order.DAY_FIRST if "." in date or first > 12 or "-" in date else Order.MONTH_FIRST
    return (day_of((first, second, third), order) or 0) * DAY


def _midnight(year: int, month: int, day: int) -> int:
    try:
        return int(datetime(year, month, day, tzinfo=UTC).timestamp()) * NS_PER_S
    except (ValueError, OverflowError):
        return 0
