"""What was found in a line before is not looked for again. Pure.

A log is gone over several times before it is known how it tells its octets, and most of its lines are polls that differ
in their times alone: without them they are the same text again and again.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, wraps
from typing import Concatenate, ParamSpec, TypeVar

REMEMBERED, LONGEST_REMEMBERED = 4096, 512
"""Texts of which a function remembers what it found, and how many characters they have at most."""

_More = ParamSpec("_More")
_Found = TypeVar("_Found")


def remembered(function: Callable[Concatenate[str, _More], _Found]) -> Callable[Concatenate[str, _More], _Found]:
    """A function of a text that gives for short ones what it gave before; all that it is given can be hashed, and what
    it gives is never changed."""
    short = lru_cache(REMEMBERED)(function)

    @wraps(function)
    def found(text: str, /, *more: _More.args, **named: _More.kwargs) -> _Found:
        if len(text) <= LONGEST_REMEMBERED:
            return short(text, *more, **named)  # type: ignore[arg-type]
        return function(text, *more, **named)

    return found
