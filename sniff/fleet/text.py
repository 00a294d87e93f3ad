"""The answer as a page of text: the worst buses first, each with what is wrong and since when."""

from __future__ import annotations

from collections.abc import Iterator

from dissectors.words import milliseconds
from sniff.analysis.plain import plain
from sniff.fleet.answer import Answer, Bus, Change, Day, Fresh, StationChange, Trouble
from sniff.fleet.bus_day import NO_DATE

SHOWN = 12
"""Buses that are told in full; the others are counted."""

TROUBLES = 4
"""Findings of each."""

BARS = "▁▂▃▄▅▆▇█"


def page(found: Answer, shown: int = SHOWN) -> Iterator[str]:
    """Lines, without control characters."""
    days = sorted({day.day for bus in found.buses for day in bus.days if day.day != NO_DATE})
    sites = {bus.site for bus in found.buses}
    ill = [bus for bus in found.buses if bus.troubles or bus.is_silent]
    span = f"{days[0]} … {days[-1]}" if days else "no day"
    yield (
        f"{_count(len(found.buses), 'bus', 'buses')} of {_count(len(sites), 'site')}, {span}: "
        f"{len(ill)} with something wrong, {len(found.buses) - len(ill)} well"
    )
    if found.buses:
        yield ""
        heading = f"{'health':>6}  {'worst day':10}  {'load':>5}  {'damaged':>7}  {'no answer':>9}  {'p95 ms':>7}"
        yield f"{heading}  days, bus"
    for bus in found.buses[:shown]:
        yield from _bus(bus)
    if len(found.buses) > shown:
        rest = found.buses[shown:]
        yield f"… and {len(rest)} more, the worst of them at {rest[0].health.score}"
    if found.gone:
        yield ""
        yield f"gone since the run before: {_some([plain(each) for each in found.gone])}"
    for path, why in list(found.unreadable.items())[:shown]:
        yield f"not read: {plain(path)}: {plain(why)}"
    if len(found.unreadable) > shown:
        yield f"… and {len(found.unreadable) - shown} more that could not be read"


def _bus(bus: Bus) -> Iterator[str]:
    worst = bus.worst
    yield f"{worst.health.score:6}  {worst.day:10}  {numbers(worst)}  {curve(bus)} {plain(bus.name)}"
    for trouble in bus.troubles[:TROUBLES]:
        yield f"        {plain(trouble_words(trouble, bus))}"
    if len(bus.troubles) > TROUBLES:
        yield f"        … and {len(bus.troubles) - TROUBLES} more findings"
    for change in bus.changes[:TROUBLES]:
        yield f"        {change_words(change, bus.noun)}"
    if bus.is_silent:
        yield "        nothing was heard on any day: is the tap connected, the bus switched on?"
    if bus.missing:
        yield f"        no capture on {_some(list(bus.missing))}"
    for note in bus.notes[:2]:
        yield f"        {plain(note)}"


def numbers(day: Day) -> str:
    """A day's figures in columns."""
    response = day.response.quantile(0.95)
    late = f"{response / 1e6:7.1f}" if response is not None else "      –"
    return f"{day.load:5.0%}  {day.damaged:7.2%}  {day.unanswered:9.2%}  {late}"


def curve(bus: Bus) -> str:
    """Health day by day as bars, the newest 31 days."""
    return "".join(BARS[min(len(BARS) - 1, day.health.score * len(BARS) // 101)] for day in bus.days[-31:])


def trouble_words(trouble: Trouble, bus: Bus) -> str:
    """A finding with its days: "MB001 station 3: no answer …; since 2026-03-02, 4 days, 812 times"."""
    one, days = trouble.finding, trouble.days
    since = f"since {days[0]}" if days[-1] == bus.days[-1].day else f"{days[0]} … {days[-1]}"
    fresh = f" ({trouble.fresh.value})" if trouble.fresh is Fresh.NEW else ""
    return f"{one.code}{fresh} {one.subject}: {one.seen}; {since}, {_count(len(days), 'day')}, {one.count}×"


def change_words(change: StationChange, noun: str) -> str:
    """What happened to a station."""
    who = f"{noun} {change.station}"
    if change.change is Change.CAME:
        return f"{who} came on {change.day}"
    if change.change is Change.WENT:
        return f"{who} was heard last on {change.day}"
    assert change.before is not None
    assert change.after is not None
    how = f"{milliseconds(change.before)} → {milliseconds(change.after)}"
    return f"{who} answers {change.change.value} since about {change.day}: median {how}"


def _count(number: int, one: str, more: str = "") -> str:
    return f"{number} {one if number == 1 else more or one + 's'}"


def _some(words: list[str], most: int = 5) -> str:
    return ", ".join(words[:most]) + (f" and {len(words) - most} more" if len(words) > most else "")
