"""Saving the rows that are shown as a capture of any format, a table, JSON or text, by its suffix."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from dissectors.frame import Chunk
from sniff.bus.capture_writer import create
from sniff.bus.row_files import SUFFIXES
from sniff.bus.row_files import save as save_rows
from sniff.bus.rows import Store
from sniff.engine.session import Item
from sniff.engine.verdict_join import JudgedRow
from sniff.formats import FRAMES, ITEMS, table
from sniff.formats.parquet import available
from sniff.tui.guest import is_guest


def _captures() -> tuple[str, ...]:
    """Suffixes of captures."""
    return (*table.writers(ITEMS), *table.writers(FRAMES))


def why_not(path: str) -> str:
    """What keeps a capture of that name from being written; "" for nothing."""
    if is_guest():
        return "who looks from another machine saves nothing here"
    suffixes = (*_captures(), *SUFFIXES)
    if not path.strip().lower().endswith(suffixes):
        return f"expected a name that ends in {', '.join(suffixes)}"
    if path.strip().lower().endswith(".parquet") and not available():
        return "needs polars: pip install 'sniff485[parquet]'"
    return f"{path.strip()} is there already" if Path(path.strip()).exists() else ""


def save(store: Store, numbers: Iterable[int], path: str) -> int:
    """Write those rows, of a capture a read each; how many they are. Raises CaptureError, OSError."""
    if not path.lower().endswith(_captures()):
        return save_rows(Path(path), ((item, store.dissector) for item in _judged(store, numbers)), store.session)
    count = 0
    with create(path, store.session) as writer:
        for item in _items(store, numbers):
            writer.write(item)
            count += 1
    return count


def _judged(store: Store, numbers: Iterable[int]) -> Iterator[JudgedRow]:
    for no in numbers:
        row = store.by_no(no)
        if row is not None:
            yield JudgedRow(row, store.transaction(row), store.meaning(row))


def _items(store: Store, numbers: Iterable[int]) -> Iterator[Item]:
    for no in numbers:
        row = store.by_no(no)
        if row is not None:
            yield Chunk(row.event.end, row.event.octets, row.event.marks)
