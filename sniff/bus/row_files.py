"""Rows as a file that no capture is: a table (CSV, Parquet), JSON or lines of text, by its suffix."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from dissectors.manifest import Dissector
from sniff.bus import row_words
from sniff.engine.capture import CaptureError
from sniff.engine.session import Session
from sniff.engine.verdict_join import JudgedRow
from sniff.formats import parquet
from sniff.formats.files import NewFile

SUFFIXES = (".csv", ".json", ".jsonl", ".parquet", ".txt")
FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""How a cell begins that a spreadsheet runs."""


def save(path: Path, items: Iterable[tuple[JudgedRow, Dissector]], session: Session) -> int:
    """Write rows, what `show` gives of them, each with the dissector of its protocol; how many they are. Raises
    CaptureError."""
    suffix = path.suffix.lower()
    if suffix == ".parquet":
        with parquet.ParquetWriter(path, row_words.COLUMNS) as columns:
            return _add_all(columns, (row_words.typed(*item, session) for item in items))
    if suffix == ".csv":
        with CsvFile(path, row_words.JSON_KEYS) as table:
            given = (row_words.to_json(*item, session).values() for item in items)
            return _add_all(table, ([text_cell(value) for value in values] for values in given))
    write = row_words.json_line if suffix in (".json", ".jsonl") else row_words.text_line
    with TextFile(path) as text:
        return _add_all(text, ((write(*item, session),) for item in items))


def _add_all(table: parquet.ParquetWriter | TextFile, rows: Iterable[Sequence[Any]]) -> int:
    count = 0
    for cells in rows:
        table.add(cells)
        count += 1
    return count


def safe_text(text: str) -> str:
    """A text that no spreadsheet takes for a formula (it would run what begins with = + - @)."""
    return f"'{text}" if text.startswith(FORMULA) else text


def text_cell(value: object) -> str:
    """A value as a cell of CSV; text that a spreadsheet would run is kept from it."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(int(value))
    return safe_text(value) if isinstance(value, str) else str(value)


class TextFile:
    """Lines of text; the file has its name only when it is whole. Raises CaptureError.

    A context manager: after a capture that turned out to be damaged, what came before is written; after any other
    exception nothing.
    """

    def __init__(self, path: Path) -> None:
        self._file = NewFile(path)
        self._text = io.StringIO()

    def add(self, row: Sequence[Any]) -> None:
        """Add a line."""
        self._put(row)
        if self._text.tell() > 1 << 16:
            self._flush()

    def _put(self, row: Sequence[Any]) -> None:
        self._text.write("".join(row) + "\n")

    def __enter__(self) -> TextFile:
        return self

    def __exit__(self, kind: type[BaseException] | None, *exc: object) -> None:
        if kind is None or issubclass(kind, CaptureError):
            self._flush()
            self._file.close()
        else:
            self._file.discard()

    def _flush(self) -> None:
        self._file.write(self._text.getvalue().encode("utf-8", "backslashreplace"))
        self._text.seek(0)
        self._text.truncate()


class CsvFile(TextFile):
    """A table as comma-separated values."""

    def __init__(self, path: Path, names: Iterable[str]) -> None:
        super().__init__(path)
        self._writer = csv.writer(self._text, lineterminator="\n")
        self.add(list(names))

    def _put(self, row: Sequence[Any]) -> None:
        self._writer.writerow(row)
