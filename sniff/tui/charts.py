"""Small charts made of characters. Pure."""

from __future__ import annotations

from collections.abc import Sequence

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
