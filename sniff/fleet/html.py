"""The answer as one page of HTML that stands alone: no network, no script; pictures are SVG made here."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

from dissectors.findings import counted
from dissectors.words import bare_milliseconds
from sniff.analysis.sanitizing import sanitized
from sniff.fleet.answer import Answer, Bus, Day
from sniff.fleet.bus_day import NO_DATE
from sniff.fleet.drift import Drift
from sniff.fleet.text import WELL, change_words, silence_words, sure_words, trouble_words

_STYLE = """
body{font:15px/1.45 system-ui,sans-serif;color:#1c2733;max-width:72rem;margin:2rem auto;padding:0 1rem}
table{border-collapse:collapse;width:100%}th,td{text-align:left;padding:.25rem .6rem;border-bottom:1px solid #d8dee4}
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}h2{margin-top:2.2rem;font-size:1.1rem}
.bad{color:#b3261e;font-weight:600}.fair{color:#8a5200;font-weight:600}.well{color:#2d6a3f}ul{margin:.4rem 0}
.grey{color:#5b6773}svg{display:block}
"""
_FAIR = 60


def page(found: Answer, title: str = "Fieldbus archive") -> str:
    """The page. All text from captures is escaped."""
    return "".join(_parts(found, title))


def _parts(found: Answer, title: str) -> Iterator[str]:
    yield f"<!doctype html><html lang=en><meta charset=utf-8><title>{_safe(title)}</title><style>{_STYLE}</style>"
    days = sorted({day.day for bus in found.buses for day in bus.days if day.day != NO_DATE})
    ill = sum(bus.is_ill for bus in found.buses)
    span = f"{days[0]} to {days[-1]}" if days else "no day"
    buses = counted(len(found.buses), "bus", "buses")
    yield f"<h1>{_safe(title)}</h1><p>{buses}, {span}: {ill} with something wrong.</p>"
    yield "<table><tr><th>Bus<th class=n>Health<th>Day by day<th class=n>Load<th class=n>Damaged"
    yield "<th class=n>No answer<th class=n>Response p95, ms<th>Findings</tr>"
    for number, bus in enumerate(found.buses):
        yield from _line(number, bus)
    yield "</table>"
    for number, bus in enumerate(found.buses):
        if _is_told(bus):
            yield from _bus(number, bus)
    if found.gone:
        yield "<h2>Gone since the run before</h2><ul>"
        yield "".join(f"<li>{_safe(one)}" for one in found.gone) + "</ul>"
    if found.unreadable:
        yield "<h2>Not read</h2><ul>"
        yield "".join(f"<li>{_safe(path)}: {_safe(why)}" for path, why in found.unreadable.items()) + "</ul>"


def _is_told(bus: Bus) -> bool:
    """Whether there is more to say of a bus than its line does."""
    return bool(bus.is_ill or bus.changes or bus.notes or bus.missing)


def _line(number: int, bus: Bus) -> Iterator[str]:
    day = bus.worst
    response = day.response.quantile(0.95)
    late = f"{response / 1e6:.1f}" if response is not None else "–"
    codes = ", ".join(dict.fromkeys(one.finding.code for one in bus.troubles))
    if not codes:
        codes = f"none: {'; '.join(day.health.reasons)}" if day.health.score < WELL else "–"
    load = "–" if day.load is None else f"{day.load:.0%}"
    name = _safe(bus.name)
    linked = f'<a href="#bus{number}">{name}</a>' if _is_told(bus) else name
    yield (
        f"<tr><td>{linked} <span class=grey>{_safe(bus.protocol)}</span>"
        f'<td class="n {_class(day.health.score)}">{day.health.score}<td>{_picture(bus)}'
        f"<td class=n>{load}<td class=n>{day.damaged:.2%}<td class=n>{day.unanswered:.2%}"
        f"<td class=n>{late}<td>{_safe(codes)}</tr>"
    )


def _bus(number: int, bus: Bus) -> Iterator[str]:
    yield f'<h2 id="bus{number}">{_safe(bus.name)}</h2>'
    if bus.health.reasons:
        yield f"<p>Worst on {bus.worst.day}: {_safe('; '.join(bus.worst.health.reasons))}</p>"
    yield "<ul>"
    for trouble in bus.troubles:
        yield f"<li><b>{_safe(trouble_words(trouble, bus))}</b><br>{_safe(trouble.finding.means)}<br>"
        yield f"<span class=grey>Next: {_safe(trouble.finding.next)}</span>"
    yield "".join(f"<li>{_safe(change_words(change, bus.noun))}" for change in bus.changes)
    silence = silence_words(bus)
    if silence is not None:
        yield f"<li>{_safe(silence[:1].upper() + silence[1:])}"
    if bus.missing:
        yield f"<li>No capture on {_safe(', '.join(bus.missing[:31]))}"
    yield "".join(f"<li>{_safe(note)}" for note in bus.notes) + "</ul>"
    if bus.drifts:
        yield "<table><tr><th>Median response time<th>Day by day<th class=n>Before, ms<th class=n>After, ms"
        yield "<th class=n>ms in 30 days<th>How sure</tr>"
        yield "".join(_drift(one, bus.noun) for one in bus.drifts) + "</table>"


def _drift(one: Drift, noun: str) -> str:
    times = [median for _, median in one.medians[-60:]]
    most = max(times) or 1
    bars = "".join(
        f'<rect x="{8 * place}" y="{24 - height}" width="6" height="{2 + height}" fill="#4a6785"/>'
        for place, height in enumerate(22 * time // most for time in times)
    )
    said = ", ".join(f"{day}: {time / 1e6:.1f} ms" for day, time in one.medians[-60:])
    return (
        f"<tr><td>{_safe(noun)} {one.station}"
        f'<td><svg role=img width="{8 * len(times)}" height="26"><title>{_safe(said)}</title>{bars}</svg>'
        f"<td class=n>{bare_milliseconds(one.before)}<td class=n>{bare_milliseconds(one.after)}"
        f"<td class=n>{'+' if one.slope > 0 else ''}{bare_milliseconds(round(30 * one.slope))}"
        f"<td>{_safe(sure_words(one))}</tr>"
    )


def _picture(bus: Bus) -> str:
    """Health as a bar a day; what it says is said in its title too."""
    days = bus.days[-60:]
    bars = "".join(_bar(place, day) for place, day in enumerate(days))
    said = ", ".join(f"{day.day}: {day.health.score}" for day in days)
    return f'<svg role=img width="{8 * len(days)}" height="26"><title>{said}</title>{bars}</svg>'


def _bar(place: int, day: Day) -> str:
    height = 2 + day.health.score * 22 // 100
    colour = {"well": "#3b7d4f", "fair": "#c77700", "bad": "#b3261e"}[_class(day.health.score)]
    return f'<rect x="{8 * place}" y="{26 - height}" width="6" height="{height}" fill="{colour}"/>'


def _class(score: int) -> str:
    return "well" if score >= WELL else "fair" if score >= _FAIR else "bad"


def _safe(text: str) -> str:
    return escape(sanitized(text))
