"""Small charts made of characters. Pure."""

from __future__ import annotations

import math
from collections.abc import Sequence

from dissectors.histogram import Histogram
from dissectors.line import MS

BARS = " ▁▂▃▄▅▆▇█"
_PARTS = " ▏▎▍▌▋▊▉█"


def sparkline(values: Sequence[float], top: float) -> str:
    """One character a value, 0 … top; anything above 0 shows at least the lowest bar."""
    if top <= 0:
        return BARS[0] * len(values)
    steps = len(BARS) - 1
    return "".join(
        BARS[0 if value <= 0 else min(steps, max(1, round(min(1.0, value / top) * steps)))] for value in values
    )


def bar(share: float, width: int) -> str:
    """A horizontal bar, share 0 … 1 of `width` cells, to an eighth of a cell; above 0 it is never empty."""
    eighths = round(min(1.0, max(0.0, share)) * width * 8)
    if share > 0:
        eighths = max(1, eighths)
    whole, part = divmod(eighths, 8)
    return ("█" * whole + (_PARTS[part] if part else "")).ljust(width)


EDGES = tuple(edge * MS // 10 for edge in (1, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000))
"""0.1 ms … 1 s."""


def spread(times: Histogram, room: int) -> list[str]:
    """How times are spread, a line a range from the first to the last that occurred: the range, a bar of at most
    `room` cells, how many, and their share."""
    counts = times.spread(EDGES)
    seen = [position for position, count in enumerate(counts) if count]
    return [
        f"{_range(at):>13} {bar(counts[at] / max(counts), room)} {counts[at]:>8} {counts[at] / times.count:>6.1%}"
        for at in (range(seen[0], seen[-1] + 1) if seen else ())
    ]


def _range(position: int) -> str:
    if position == 0:
        return f"< {_edge(EDGES[0])} ms"
    if position == len(EDGES):
        return f"≥ {_edge(EDGES[-1])} ms"
    return f"{_edge(EDGES[position - 1])} … {_edge(EDGES[position])} ms"


def _edge(value: int) -> str:
    return f"{value / MS:g}"


def tall_bars(values: Sequence[float | None], top: float, height: int) -> list[str]:
    """A chart `height` lines high, the upper line first: one character a value, 0 … top; above 0 is never empty."""
    lines = []
    eighths = [0 if not value or top <= 0 else max(1, round(min(1.0, value / top) * height * 8)) for value in values]
    for below in range(height - 1, -1, -1):
        lines.append("".join(BARS[min(8, max(0, one - below * 8))] for one in eighths))
    return lines


def round_up(value: float) -> float:
    """The next of 1, 2, 3, 5, 7.5, 10, 20 … that is not less: where an axis ends."""
    if value <= 0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(value))
    return next(step * power for step in (1, 2, 3, 5, 7.5, 10, 20) if step * power >= value * 0.999_999)
