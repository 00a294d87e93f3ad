"""The answer as a page of text: the worst buses first, each with what is wrong and since when."""

from __future__ import annotations

from collections.abc import Iterator

from dissectors.findings import counted
from dissectors.words import milliseconds
from sniff.analysis.sanitizing import sanitized
from sniff.fleet.answer import Answer, Bus, Change, Day, Fresh, StationChange, Trouble
from sniff.fleet.bus_day import NO_DATE
from sniff.fleet.drift import Drift, DriftSureness

SHOWN = 12
"""Buses that are told in full; the others are counted."""

TROUBLES = 4
"""Findings of each."""

WELL = 90
"""Health below which the reasons are given where no finding does."""

CHANCE = 0.5
"""Where days in any order rise or fall as steadily so often, there is no drift to be sure of."""

DAYS = 10
"""Of the curve, so that a line fits 80 columns with a name of some length; the pages have more."""

BARS = "▁▂▃▄▅▆▇█"


def page(found: Answer, shown: int = SHOWN, width: int | None = None, height: int | None = None) -> Iterator[str]:
    """Lines, without control characters. `shown`: most buses. `width`: of a screen, in columns: longer lines end with
    "…" (what they end with is in the other forms of the answer); `height`: in lines: fewer buses, but at least one."""
    head = list(_head(found))
    foot = list(_foot(found, shown))
    room = None if height is None else max(1, height - len(head) - len(foot) - 1)
    told, used = 0, 0
    blocks: list[list[str]] = []
    for bus in found.buses[:shown]:
        block = list(_bus(bus, _days(found)))
        used += len(block)
        if room is not None and blocks and used > room:
            break
        blocks.append(block)
        told += 1
    rest = found.buses[told:]
    more = [f"… and {len(rest)} more, the worst of them at {rest[0].worst.health.score} (--all)"] if rest else []
    for line in (*head, *(line for block in blocks for line in block), *more, *foot):
        yield line if width is None else _clipped(line, width)


def _head(found: Answer) -> Iterator[str]:
    days = sorted({day.day for bus in found.buses for day in bus.days if day.day != NO_DATE})
    sites = {bus.site for bus in found.buses}
    ill = [bus for bus in found.buses if bus.is_ill]
    span = f"{days[0]} … {days[-1]}" if days else "no day"
    yield (
        f"{_count(len(found.buses), 'bus', 'buses')} of {_count(len(sites), 'site')}, {span}: "
        f"{len(ill)} with something wrong, {len(found.buses) - len(ill)} well"
    )
    if found.buses:
        yield ""
        yield f"health  worst day    load  damaged  no answer   p95 ms  {'days':{_days(found)}}  bus"


def _foot(found: Answer, shown: int) -> Iterator[str]:
    if found.gone:
        yield f"gone since the run before: {_some([sanitized(each) for each in found.gone])}"
    for path, why in list(found.unreadable.items())[:shown]:
        yield f"not read: {sanitized(path)}: {sanitized(why)}"
    if len(found.unreadable) > shown:
        yield f"… and {len(found.unreadable) - shown} more that could not be read"


def _days(found: Answer) -> int:
    return max(4, max((min(DAYS, len(bus.days)) for bus in found.buses), default=0))


def _clipped(line: str, width: int) -> str:
    return line if len(line) <= width else line[: width - 1] + "…"


def _bus(bus: Bus, days: int) -> Iterator[str]:
    worst = bus.worst
    yield f"{worst.health.score:6}  {worst.day:10}  {numbers(worst)}  {curve(bus, days):{days}}  {sanitized(bus.name)}"
    for trouble in bus.troubles[:TROUBLES]:
        yield f"        {sanitized(trouble_words(trouble, bus))}"
    if len(bus.troubles) > TROUBLES:
        yield f"        … and {counted(len(bus.troubles) - TROUBLES, 'more finding')}"
    if not bus.troubles and worst.health.score < WELL:
        yield f"        no finding; {sanitized('; '.join(worst.health.reasons))}"
    for change in bus.changes[:TROUBLES]:
        yield f"        {change_words(change, bus.noun)}"
    silence = silence_words(bus)
    if silence is not None:
        yield f"        {silence}"
    if bus.missing:
        yield f"        no capture on {_some(list(bus.missing))}"
    for note in bus.notes[:2]:
        yield f"        {sanitized(note)}"


def numbers(day: Day) -> str:
    """A day's figures in columns."""
    response = day.response.quantile(0.95)
    late = f"{response / 1e6:7.1f}" if response is not None else "      –"
    load = f"{day.load:5.0%}" if day.load is not None else "    –"
    return f"{load}  {day.damaged:7.2%}  {day.unanswered:9.2%}  {late}"


def curve(bus: Bus, days: int = DAYS) -> str:
    """Health day by day as bars, the newest so many days."""
    return "".join(BARS[min(len(BARS) - 1, day.health.score * len(BARS) // 101)] for day in bus.days[-days:])


def trouble_words(trouble: Trouble, bus: Bus) -> str:
    """A finding with its days: "MB001 station 3, since 03-02, 4 days, 812×: no answer to any of …"."""
    one, days = trouble.finding, trouble.days
    newest = bus.days[-1].day
    begin, end = (days[0][5:], days[-1][5:]) if days[0][:4] == newest[:4] and newest != NO_DATE else (days[0], days[-1])
    when = f"since {begin}" if days[-1] == newest else begin if begin == end else f"{begin} … {end}"
    fresh = " (new)" if trouble.fresh is Fresh.NEW else ""
    many = f", {len(days)} days" if len(days) > 1 else ""
    often = "" if one.is_once else f", {one.count}×"
    alike = f" (and {trouble.alike} more like it)" if trouble.alike else ""
    return f"{one.code} {one.subject}{fresh}, {when}{many}{often}: {one.seen}{alike}"


def change_words(change: StationChange, noun: str) -> str:
    """What happened to a station."""
    who = f"{noun} {change.station}"
    if change.drift is None:
        return f"{who} {'came on' if change.change is Change.CAME else 'was heard last on'} {change.day}"
    one = change.drift
    how = f"{milliseconds(one.before)} → {milliseconds(one.after)}"
    return f"{who} answers {change.change.value} since about {change.day}: median {how} ({sure_words(one)})"


def sure_words(drift: Drift) -> str:
    """How sure a drift is: "sure: 1 in 1000 by chance"."""
    if drift.chance > CHANCE:
        return "no drift"
    if drift.sure is DriftSureness.UNSURE and len(drift.medians) < 5:
        return f"{len(drift.medians)} days: too few to be sure"
    return f"{drift.sure.value}: 1 in {1 / max(drift.chance, 1e-6):.0f} by chance"


def silence_words(bus: Bus) -> str | None:
    """That somebody recorded and heard nothing, or does not record any more."""
    if bus.is_silent:
        return "nothing was heard on any day: is the tap connected, the bus switched on?"
    if bus.silent:
        return f"nothing was heard on {_some(list(bus.silent))}: was the tap connected, the bus switched on?"
    return f"no capture since {bus.stopped}, while other buses go on: does anybody record it?" if bus.stopped else None


def _count(number: int, one: str, more: str = "") -> str:
    return f"{number} {one if number == 1 else more or one + 's'}"


def _some(words: list[str], most: int = 5) -> str:
    return ", ".join(words[:most]) + (f" and {len(words) - most} more" if len(words) > most else "")
