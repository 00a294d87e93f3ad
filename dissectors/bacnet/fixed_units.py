"""Units that the standard itself fixes for numbers of properties and services (ANSI/ASHRAE 135, clauses 12 … 17).

What an object measures has the unit that its Units property says; these have none beside them.
"""

from __future__ import annotations

_MS, _CENTISECONDS, _DECISECONDS, _SECONDS, _MINUTES = "ms", "× 10 ms", "× 100 ms", "s", "min"

OF_PROPERTIES: dict[int, str] = {
    **dict.fromkeys((10, 11, 368, 374, 393, 394), _MS),
    **dict.fromkeys((118, 134, 195), _CENTISECONDS),  # update interval, log interval and its offset
    **dict.fromkeys((227, 229, 230, 232), _DECISECONDS),  # of doors
    **dict.fromkeys((33, 66, 67, 113, 128, 147, 153, 180, 182), _SECONDS),
    **dict.fromkeys((339, 340, 341, 349, 356, 377, 403, 404, 419, 443, 444), _SECONDS),
    **dict.fromkeys((119, 204, 213, 219), _MINUTES),
    375: "%/s",
    420: "bit/s",
}
"""By property: APDU timeouts, delays, intervals, lifetimes, rates."""

OF_PARAMETERS: dict[str, str] = {
    "fade-time": _MS,
    "initial-timeout": _MS,
    "lifetime": _SECONDS,
    "max-notification-delay": _SECONDS,
    "post-delay": _SECONDS,
    "ramp-rate": "%/s",
    "remaining-time-to-live": _SECONDS,
    "time-delay": _SECONDS,
    "time-duration": _MINUTES,
    "time-remaining": _SECONDS,
    "time-to-live": _SECONDS,
}
"""By the name of a part of a service or of a value."""

ENDLESS = frozenset({"lifetime", "time-remaining"})
"""Of these 0 means that there is no end."""


def unit_held(which: int, index: int | None, value: object) -> str:
    """The unit of what a property, or an element of it, holds; empty where it has none, and for what is no number."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return OF_PROPERTIES.get(which, "") if is_number and index != 0 else ""  # element 0 is how many there are
