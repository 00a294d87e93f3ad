"""The pictures of a report, as SVG to stand in the page. Drawn without a display; nothing is told by colour alone."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any

from sniff.analysis.wording import station_word
from sniff.reporting.numbers import CLASSES, CaptureNumbers, RingNumbers, StationNumbers, TimePart, ValueTrend

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, PAPER, GREY = "#1c2733", "#ffffff", "#8a96a3"
BLUE, RED, AMBER, PURPLE, GREEN = "#2f6db3", "#b3261e", "#c77700", "#6b4fa0", "#3b7d4f"
WIDTH = 9.6  # inches
STATIONS_SHOWN = 24

TROUBLE: tuple[tuple[str, str, str, str], ...] = (
    ("failed", "no answer, late or damaged answer", RED, ""),
    ("damaged", "damaged frames", AMBER, "///"),
    ("exceptions", "exceptions", PURPLE, "..."),
    ("line_errors", "octets with line errors", GREEN, "xxx"),
    ("noise", "octets of noise", GREY, "\\\\\\"),
)
"""Field of a TimePart, its name for people, colour and hatching."""


def pictures(numbers: CaptureNumbers, prefix: str) -> dict[str, str]:
    """SVG by name: "timeline", "responses", "ring", "values", each only where there is something to draw.

    `prefix`: makes the ids in them unique on the page. Raises ImportError without matplotlib.
    """
    drawn: dict[str, str] = {}
    if len(numbers.timeline) > 1:
        drawn["timeline"] = _svg(_timeline(numbers.timeline, numbers.part), f"{prefix}-timeline")
    answering = [station for station in numbers.stations if station.response.count]
    if answering:
        word = station_word(numbers.measurement.protocol)
        drawn["responses"] = _svg(_responses(answering, numbers.measurement.latency_ms, word), f"{prefix}-responses")
    if numbers.ring is not None and len(numbers.ring.order) > 1:
        drawn["ring"] = _svg(_ring(numbers.ring), f"{prefix}-ring")
    if numbers.values:
        word = station_word(numbers.measurement.protocol)
        drawn["values"] = _svg(_values(numbers.values, word), f"{prefix}-values")
    return drawn


def _figure(height: float, width: float = WIDTH) -> Figure:
    from matplotlib import rcParams
    from matplotlib.figure import Figure

    rcParams["svg.fonttype"] = "none"  # text stays text: it can be searched, and the page's font is used
    rcParams["svg.hashsalt"] = "sniff485"
    rcParams["font.family"] = "sans-serif"
    rcParams["font.size"] = 9
    rcParams["hatch.linewidth"] = 0.6
    return Figure(figsize=(width, height), layout="constrained", facecolor="none")


def _plain(axes: Axes) -> None:
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(GREY)
    axes.tick_params(colors=INK, labelsize=8)
    axes.set_facecolor("none")


def _timeline(parts: Sequence[TimePart], width: float) -> Figure:
    """Bus load above, trouble below, over one time axis."""
    figure = _figure(3.6)
    shown = [row for row in TROUBLE if any(getattr(part, row[0]) for part in parts)]
    count = 2 if shown else 1
    all_axes = figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
    unit, name = _time_unit(parts[-1].at)
    at = [part.at / unit for part in parts]
    load = all_axes[0]
    loads = [part.load or 0.0 for part in parts]
    load.stairs([100 * value for value in loads], [*at, (parts[-1].at + width) / unit], fill=True, color=BLUE)
    load.set_ylabel("bus load, %")
    load.set_ylim(0, max(10.0, min(100.0, 120 * max(loads))))
    _shade(load, [part.load is None for part in parts], [*at, (parts[-1].at + width) / unit])
    _plain(load)
    if shown:
        trouble = all_axes[1]
        base = [0.0] * len(parts)
        for field, words, colour, hatch in shown:
            values = [getattr(part, field) for part in parts]
            trouble.bar(
                at, values, width / unit, base, align="edge", color=colour, hatch=hatch, edgecolor=PAPER, linewidth=0,
                label=f"{words} ({sum(values)})",
            )  # fmt: skip
            base = [below + value for below, value in zip(base, values, strict=True)]
        trouble.set_ylim(0, max(base) * 1.1)
        trouble.yaxis.get_major_locator().set_params(integer=True)
        trouble.set_ylabel(f"trouble in {_width_words(width)}")
        trouble.legend(fontsize=8, frameon=False, ncols=2, loc="lower left", bbox_to_anchor=(0, 1))
        _plain(trouble)
    all_axes[-1].set_xlabel(f"{name} since the start of the capture")
    all_axes[-1].set_xlim(at[0], (parts[-1].at + width) / unit)
    return figure


def _shade(axes: Axes, unheard: Sequence[bool], edges: Sequence[float]) -> None:
    """Where nobody heard the bus; `edges`: of the parts."""
    label = "nobody heard the bus"
    for missed, run in groupby(range(len(unheard)), lambda at: unheard[at]):
        places = list(run)
        if missed:
            begin, end = edges[places[0]], edges[places[-1] + 1]
            axes.axvspan(begin, end, facecolor="none", edgecolor=GREY, hatch="//", linewidth=0, label=label)
            label = "_"  # no second line in the legend
    if any(unheard):
        axes.legend(fontsize=8, frameon=False, loc="lower left", bbox_to_anchor=(0, 1))


def _values(trends: Sequence[ValueTrend], word: str) -> Figure:
    """One small plot a value, all over the same time."""
    columns = min(3, len(trends))
    rows = -(-len(trends) // columns)
    figure = _figure(0.4 + 1.5 * rows)
    all_axes = figure.subplots(rows, columns, sharex=True, squeeze=False).flatten()
    unit, name = _time_unit(max(trend.at[-1] for trend in trends))
    for axes, trend in zip(all_axes, trends, strict=False):
        axes.plot([at / unit for at in trend.at], trend.values, color=BLUE, linewidth=0.9)
        title = f"{word} {trend.station} {trend.name}" + (f", {trend.unit}" if trend.unit else "")
        told = f"{_drawable(title)}\n{trend.how}" if trend.how else _drawable(title)
        axes.set_title(told, fontsize=8, color=INK, loc="left")
        axes.ticklabel_format(axis="y", useOffset=False)
        _plain(axes)
    for axes in all_axes[len(trends) :]:
        axes.set_visible(False)
    for axes in all_axes[max(0, len(trends) - columns) : len(trends)]:
        axes.set_xlabel(name, fontsize=8)
        axes.tick_params(labelbottom=True)
    return figure


def _drawable(text: str) -> str:
    """Text from a capture as a title: short, printable, and no formula."""
    return "".join(c if c.isprintable() else "?" for c in text[:48]).replace("$", "\\$")


def _time_unit(longest: float) -> tuple[float, str]:
    return (3600.0, "hours") if longest > 7200 else (60.0, "minutes") if longest > 300 else (1.0, "seconds")


def _width_words(width: float) -> str:
    return f"{width:g} s" if width < 120 else f"{width / 60:.3g} min"


def _responses(stations: Sequence[StationNumbers], latency: float, word: str) -> Figure:
    """A distribution a station on one logarithmic axis, with marks at the median, 95% and the longest."""
    shown = sorted(stations, key=lambda station: -station.response.count)[:STATIONS_SHOWN]
    shown.sort(key=lambda station: station.address)
    figure = _figure(1.1 + 0.42 * len(shown))
    axes = figure.subplots()
    low = min(station.response.classes[0][0] / _STEP for station in shown)
    high = max(station.response.classes[-1][0] for station in shown)
    centre = math.sqrt(low * high)
    low, high = min(low, centre / 3), max(high, centre * 3)  # a little less than a decade at least
    low = max(low, high / 1000)
    for place, station in enumerate(shown):
        response = station.response
        below = sum(count for edge, count in response.classes if edge <= low)  # what the axis does not reach
        classes = [(edge, count) for edge, count in response.classes if edge > low] or [(low * _STEP, 0)]
        classes[0] = (classes[0][0], classes[0][1] + below)
        tallest = max(count for _, count in classes)
        edges = [classes[0][0] / _STEP, *(edge for edge, _ in classes)]
        heights = [-0.8 * count / tallest for _, count in classes]
        axes.stairs([place + height for height in heights], edges, baseline=place, fill=True, color=BLUE, alpha=0.6)
        for value, marker, size in ((response.p50, "|", 9), (response.p95, "d", 4), (response.most, "x", 5)):
            if value is not None:
                axes.plot(
                    [max(value, low)], [place + 0.1], marker=marker, markersize=size, color=INK, clip_on=False, zorder=3
                )
    labels = [f"{word} {station.address} ({station.response.count})" for station in shown]
    axes.set_yticks(range(len(shown)), labels=labels)
    axes.set_ylim(len(shown) - 0.6, -1)
    axes.set_xscale("log")
    axes.set_xlim(low, high)
    if latency > low:
        axes.axvspan(
            low, min(latency, high), facecolor="#eef1f4", edgecolor="#c3cbd3", linewidth=0, hatch="//", zorder=0
        )
        axes.text(low * 1.03, -0.97, "within the adapter's latency", fontsize=8, color=INK, va="top")
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.xaxis.set_minor_formatter(lambda value, _: f"{value:g}" if high / low < 100 and _leads(value) else "")
    axes.tick_params(axis="x", which="minor", labelsize=7)
    axes.set_xlabel("ms from the request to the answer ( | median, ◆ 95%, × longest)")
    _plain(axes)
    axes.grid(axis="x", which="major", color=GREY, alpha=0.3)
    return figure


_STEP = CLASSES[1] / CLASSES[0]


def _leads(value: float) -> bool:
    """Whether a tick is at 2 or 5 of its decade."""
    return round(value / 10 ** math.floor(math.log10(value))) in (2, 5)


def _ring(ring: RingNumbers) -> Figure:
    """Masters in a circle, clockwise as the token goes, with arrows."""
    count = len(ring.order)
    side = 2.6 if count <= 12 else 4.2
    figure = _figure(side, side)
    axes = figure.subplots()
    axes.set_axis_off()
    axes.set_aspect("equal")
    axes.set_xlim(-1.35, 1.35)
    axes.set_ylim(-1.35, 1.35)
    points = [
        (math.sin(2 * math.pi * number / count), math.cos(2 * math.pi * number / count)) for number in range(count)
    ]
    radius = min(0.24, 2.2 / count)
    bend = 0.35 if count == 2 else 0.12
    for number, mac in enumerate(ring.order):
        axes.annotate(
            "", points[(number + 1) % count], points[number],
            arrowprops={
                "arrowstyle": "-|>", "color": GREY, "shrinkA": 80 * radius, "shrinkB": 80 * radius,
                "connectionstyle": f"arc3,rad=-{bend}",
            },
        )  # fmt: skip
        axes.text(
            *points[number], str(mac), ha="center", va="center", fontsize=11 if count <= 12 else 7, color=INK,
            bbox={"boxstyle": "circle,pad=0.35", "facecolor": PAPER, "edgecolor": BLUE, "linewidth": 1.5},
        )  # fmt: skip
    return figure


_NOTHING_SAID: dict[str, Any] = {"Creator": None, "Date": None, "Format": None, "Type": None}


def _svg(figure: Figure, prefix: str) -> str:
    """The figure as an `svg` element alone: no prologue, ids that no other picture has, as wide as the page allows."""
    file = io.StringIO()
    figure.savefig(file, format="svg", metadata=_NOTHING_SAID)
    text = file.getvalue()
    text = text[text.index("<svg") :].strip()
    text = re.sub(r'\bid="', f'id="{prefix}-', text)
    text = re.sub(r'href="#', f'href="#{prefix}-', text)
    text = text.replace("url(#", f"url(#{prefix}-")
    return re.sub(r'<svg [^>]*?height="([\d.]+)pt"[^>]*?viewBox="([^"]+)"[^>]*>', _head, text, count=1)


def _head(match: re.Match[str]) -> str:
    width = match[2].split()[2]
    return (
        f'<svg xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="{match[2]}" role="img" '
        f'style="max-width:{width}pt" width="100%" version="1.1">'
    )
