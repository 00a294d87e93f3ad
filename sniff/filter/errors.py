"""Errors of a filter: what is wrong, and where."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable


class FilterError(ValueError):
    """A filter that cannot be read: the message says what was expected, `column` (0 …) where."""

    def __init__(self, message: str, column: int) -> None:
        super().__init__(f"{message} at column {column + 1}")
        self.column = column


class OfOthers(FilterError):
    """A filter that frames of this protocol can never fit, since it asks for what only others have."""


class OfTimes(OfOthers):
    """The same of a capture that does not say when anything came, since it asks for that."""


def nearest(word: str, known: Iterable[str], most: int = 8) -> str:
    """ "did you mean 'late'?", or which there are."""
    names = list(dict.fromkeys(known))
    close = closest(word, names)
    if close is not None:
        return f"did you mean {shown(close)}?"
    more = ", …" if len(names) > most else ""
    return f"expected one of {', '.join(map(_written, names[:most]))}{more}"


def closest(word: str, known: Iterable[str]) -> str | None:
    """The one that is written most alike, None where none is."""
    lowered = {name.lower(): name for name in known}
    return next((lowered[one] for one in difflib.get_close_matches(word.lower(), lowered, 1, 0.6)), None)


def shown(name: str) -> str:
    """A name in quotes, in those of the language where it needs them."""
    return repr(name) if _WORD.fullmatch(name) else f'"{name}"'


def _written(name: str) -> str:
    return name if _WORD.fullmatch(name) else f'"{name}"'


_WORD = re.compile(r"[A-Za-z0-9_](?:[A-Za-z0-9_:]|-(?=[A-Za-z0-9_])|\.(?!\.))*")
"""What may stand without quotes."""
