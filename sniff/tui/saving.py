"""Saving the rows that are shown as a capture of any format, by its suffix."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from dissectors.frame import Chunk
from sniff.bus.capture_writer import create
from sniff.bus.rows import Store
from sniff.engine.session import Item
from sniff.formats import FRAMES, ITEMS, table
from sniff.tui.guest import is_guest


def why_not(path: str) -> str:
    """What keeps a capture of that name from being written; "" for nothing."""
    if is_guest():
        return "who looks from another machine saves nothing here"
    suffixes = (*table.writers(ITEMS), *table.writers(FRAMES))
    if not path.strip().lower().endswith(suffixes):
        return f"expected a name that ends in {', '.join(suffixes)}"
    return f"{path.strip()} is there already" if Path(path.strip()).exists() else ""


def save(store: Store, numbers: Iterable[int], path: str) -> int:
    """Write those rows, a read each; how many they are. Raises CaptureError, OSError."""
    count = 0
    with create(path, store.session) as writer:
        for item in _items(store, numbers):
            writer.write(item)
            count += 1
    return count


def _items(store: Store, numbers: Iterable[int]) -> Iterator[Item]:
    for no in numbers:
        row = store.by_no(no)
        if row is not None:
            yield Chunk(row.event.end, row.event.octets, row.event.marks)
