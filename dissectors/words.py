"""Durations, numbers and shares in words, the same everywhere: in lists, and where they are compared with a limit."""

from __future__ import annotations

from dissectors.line import MS, NS_PER_S

_MINUTES_FROM, _HOURS_FROM = 300 * NS_PER_S, 300 * 60 * NS_PER_S
_EXACT = 1 << 53


def milliseconds(value: int) -> str:
    """A duration in ns as milliseconds with the precision that is worth reading: "8.2 ms", "0.31 ms", "1250 ms"."""
    return f"{bare_milliseconds(value)} ms"


def bare_milliseconds(value: int) -> str:
    """The same without its unit, for columns whose title says it."""
    ms = value / MS
    return f"{ms:.0f}" if abs(ms) >= 100 else f"{ms:.1f}" if abs(ms) >= 1 else f"{ms:.2f}"


def fine_milliseconds(value: int) -> str:
    """A duration in ns as milliseconds in three digits, to stand beside a limit: "1.75 ms", "12.0 ms", "1250 ms"."""
    return f"{_three_digits(value / MS)} ms"


def duration(value: int) -> str:
    """A duration in ns in three digits and the unit that fits: "1.75 ms", "12.0 s", "15.0 min", "11.5 h"."""
    if value < NS_PER_S:
        return fine_milliseconds(value)
    seconds = value / NS_PER_S
    if value >= _HOURS_FROM:
        return f"{_three_digits(seconds / 3600)} h"
    return f"{_three_digits(seconds)} s" if value < _MINUTES_FROM else f"{_three_digits(seconds / 60)} min"


def elapsed(value: int, places: int = 1) -> str:
    """A time since a begin, ns, by which a moment is found: "123.4 s", from five minutes on "9 h 10 min 5 s"."""
    if value < _MINUTES_FROM:
        return f"{value / NS_PER_S:.{places}f} s"
    minutes, seconds = divmod(round(value / NS_PER_S), 60)
    hours, minutes = divmod(minutes, 60)
    parts = ((hours, "h"), (minutes, "min"), (seconds, "s"))
    return " ".join(f"{count} {unit}" for count, unit in parts if count)


def exact_duration(value: float, unit: int) -> str:
    """A duration in ns as a bare number of units of so many ns, with all its digits: "8.2"."""
    if not isinstance(value, int):
        return f"{value / unit:.9f}".rstrip("0").rstrip(".")
    whole, part = divmod(abs(value), unit)  # of days in ms a float has not all digits
    return f"{'-' if value < 0 else ''}{whole}.{part:0{len(str(unit)) - 1}}".rstrip("0").rstrip(".")


def span(seconds: float) -> str:
    """How long something was watched, for people: "12.5 s", "15 min 0 s", "9 h 12 min"."""
    if seconds < 120:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(int(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {rest} s"


def brief(value: float, most: int) -> str:
    """A number in `most` digits; of whole and of larger ones all before the point, never as a power of ten."""
    is_whole = float(value).is_integer() and abs(value) < _EXACT
    return f"{value:.0f}" if is_whole or abs(value) >= 10 ** (most - 1) else f"{value:.{most}g}"


def percent(share: float, places: int = 1) -> str:
    """A share, 0 … 1, in percent; some is not told as none ("under 0.1%"), nor nearly all as all ("over 99.9%")."""
    text, step = f"{share:.{places}%}", 10.0 ** -(places + 2)
    if share > 0 and text == f"{0:.{places}%}":
        return f"under {step:.{places}%}"
    return f"over {1 - step:.{places}%}" if share < 1 and text == f"{1:.{places}%}" else text


def _three_digits(number: float) -> str:
    return f"{number:.0f}" if number >= 99.95 else f"{number:.1f}" if number >= 9.995 else f"{number:.2f}"
