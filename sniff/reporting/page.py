"""Numbers and pictures on one page of HTML that needs nothing else: no script, no font, no network."""

from __future__ import annotations

import math
from collections.abc import Sequence
from importlib import resources
from typing import Any

from dissectors.line import MS
from dissectors.tracker import Verdict
from dissectors.words import bare_milliseconds, percent, span
from sniff.analysis.sanitizing import sanitized
from sniff.analysis.wording import station_word
from sniff.reporting.numbers import CaptureNumbers
from sniff.reporting.pictures import pictures

TEMPLATE = "page.html.jinja"
DAMAGES = {
    "check": "wrong check",
    "header": "wrong header check",
    "short": "cut short",
    "long": "too long",
    "form": "malformed",
    "restarted": "broken off by a new frame",
    "timeout": "broken off by silence",
}
NARROW = "\u202f"
"""The space within our own numbers."""

TROUBLE_MOST = 12
"""Kinds of trouble that get a column of their own."""


def page(reports: Sequence[CaptureNumbers]) -> str:
    """The page of one capture or several. Raises ImportError without jinja2 or matplotlib."""
    from jinja2 import Environment, StrictUndefined
    from markupsafe import Markup

    def harmless(value: object) -> object:
        """What a capture says may be made for the terminal that the page is printed to."""
        if not isinstance(value, str) or isinstance(value, Markup):
            return value
        return NARROW.join(sanitized(part) for part in value.split(NARROW))

    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, finalize=harmless
    )
    environment.filters |= {"ms": _ms, "number": _number, "percent": percent, "seconds": _seconds, "span": span,
                            "verdict": _verdict, "damage": _damage}  # fmt: skip
    template = environment.from_string(resources.files(__package__).joinpath(TEMPLATE).read_text("utf-8"))
    sections = [
        {
            "report": report,
            "matrix": _matrix(report),
            "station": station_word(report.measurement.protocol),
            # The only markup that is not escaped here: matplotlib made it out of numbers and our own words.
            "pictures": {name: Markup(svg) for name, svg in pictures(report, f"c{number}").items()},
        }
        for number, report in enumerate(reports, 1)
    ]
    return template.render(sections=sections)


def _matrix(report: CaptureNumbers) -> dict[str, Any]:
    """Stations × kinds of trouble, the most frequent kinds first, the rest in one column; only stations with any."""
    totals: dict[str, int] = {}
    for station in report.stations:
        for kind, count in station.trouble.items():
            totals[kind] = totals.get(kind, 0) + count
    kinds = sorted(totals, key=lambda kind: (-totals[kind], kind))
    shown, rest = kinds[:TROUBLE_MOST], kinds[TROUBLE_MOST:]
    most = max((count for station in report.stations for count in station.trouble.values()), default=0)
    rows = []
    for station in report.stations:
        if not station.trouble:
            continue
        counts = [station.trouble.get(kind, 0) for kind in shown]
        if rest:
            counts.append(sum(station.trouble.get(kind, 0) for kind in rest))
        rows.append((station, [(count, min(4, math.ceil(4 * count / most)) if count else 0) for count in counts]))
    return {
        "kinds": [*shown] + (["others"] if rest else []),
        "rows": rows,
        "clean": [station.address for station in report.stations if not station.trouble],
    }


def _verdict(value: str) -> str:
    """How an exchange ended, as people read it."""
    return Verdict(value).words


def _damage(value: str) -> str:
    """What is wrong with damaged frames, as people read it."""
    return DAMAGES.get(value, value)


def _ms(value: float | None) -> str:
    """ms with the precision that is worth reading; a dash for None."""
    return "–" if value is None else bare_milliseconds(round(value * MS))


def _number(value: object) -> str:
    """A cell: None as a dash, floats with two decimals, large ones without; integers with thin spaces."""
    if value is None:
        return "–"
    if isinstance(value, float):
        return f"{value:.2f}" if abs(value) < 100 else f"{value:.0f}"
    return f"{value:,}".replace(",", NARROW) if isinstance(value, int) else str(value)


def _seconds(value: float | None) -> str:
    """Seconds since the start."""
    return "" if value is None else f"{value:.3f} s"
