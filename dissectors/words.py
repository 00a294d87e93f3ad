"""Durations in words, the same everywhere."""

from __future__ import annotations

from dissectors.line import MS


def milliseconds(value: int) -> str:
    """A duration in ns as milliseconds with the precision that is worth reading: "8.2 ms", "0.31 ms", "1250 ms"."""
    return f"{bare_milliseconds(value)} ms"


def bare_milliseconds(value: int) -> str:
    """The same without its unit, for columns whose title says it."""
    ms = value / MS
    return f"{ms:.0f}" if abs(ms) >= 100 else f"{ms:.1f}" if abs(ms) >= 1 else f"{ms:.2f}"
