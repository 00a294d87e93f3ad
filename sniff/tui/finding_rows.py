"""Looking for text or octets in the rows that are shown, from the cursor on. Touches the store's rows only."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable

from sniff.filter.completion import written
from sniff.tui.index import Index
from sniff.tui.view_state import Viewing

SECONDS = 1.0
"""How long one search may take; pressing again goes on from where it ended."""


def search_filter(text: str) -> str:
    """The filter that accepts what is looked for: "03:10" and "0310" are octets, or text; all else is text."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    digits = text.replace(":", "").replace(" ", "")
    is_hex = len(digits) % 2 == 0 and len(digits) > 1 and all(one in "0123456789abcdefABCDEF" for one in digits)
    return f'text contains "{escaped}"' + (f" || hex contains {digits}" if is_hex else "")


def find(
    viewing: Viewing, shown: Index, text: str, position: int, step: int, rows_of: Callable[[int], Iterable[int]]
) -> tuple[int | None, bool]:
    """The next number shown of whose rows (`rows_of`) one holds it, from a place in `shown`, which is left out; None:
    there is none.

    And whether it was found: a search that takes long ends early, at the row that it came to.
    """
    wanted = viewing.compiled(search_filter(text))
    until = time.perf_counter() + SECONDS
    position += step
    while 0 <= position < len(shown):
        no = shown[position]
        rows = [row for one in rows_of(no) if (row := viewing.store.by_no(one)) is not None]
        if any(wanted(row, viewing.store.transaction(row)) for row in rows):
            return no, True
        if time.perf_counter() > until:
            return no, False
        position += step
    return None, False


def filter_of_octets(octets: bytes, begin: int, end: int) -> str:
    """Rows that have the same octets at the same place."""
    return f"frame.octets[{begin}:{end - begin}] == {octets[begin:end].hex(':')}"


def filter_of_row(kind: str, station: int | None) -> str:
    """Rows of the same kind, from or to the same station."""
    return f"kind == {written(kind)}" + ("" if station is None else f" && addr == {station}")
