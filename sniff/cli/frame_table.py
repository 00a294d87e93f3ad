"""Frames as a table in a file, CSV or Parquet: what `show --csv` and `show --parquet` give, by `convert`."""

from __future__ import annotations

import argparse
import csv
import io
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from dissectors.findings import counted
from dissectors.profiles import Devices
from sniff.analysis.plain import plain
from sniff.bus.offline import settled, settled_in_bulk
from sniff.cli import UNREADABLE, USAGE, Failure, rows, writing
from sniff.cli.progress import Watched
from sniff.cli.tables import safe_cell
from sniff.engine.capture import Capture, CaptureError
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Session
from sniff.formats import parquet
from sniff.formats.files import NewFile


def write(args: argparse.Namespace, capture: Capture, session: Session, devices: Devices) -> None:
    """Write the frames of a capture to `args.output` and say how many rows. Ends with exit code 2 or 3."""
    if args.link_type is not None:
        raise Failure(f"{args.output}: a table of frames has no --link-type", USAGE)
    if getattr(args, "filter", ""):
        raise Failure(f"{args.output}: a table of all frames; `sniff485 show --csv -Y …` gives some of them", USAGE)
    target = Path(args.output)
    writing.refuse_to_overwrite(target, [args.source], args.force)
    is_parquet = target.name.lower().endswith(".parquet")
    if is_parquet and not parquet.available():
        raise Failure(f"{target}: needs polars: pip install 'sniff485[parquet]'", USAGE)
    count = 0
    try:
        with parquet.ParquetWriter(target, rows.COLUMNS) if is_parquet else CsvFile(target, rows.JSON_KEYS) as table:
            for cells in _cells(args, capture, session, devices, is_parquet):
                table.add(cells)
                count += 1
    except CaptureError as error:
        raise Failure(str(error), UNREADABLE) from None
    print(f"{plain(target)}: {counted(count, 'row')}, frames and what was between them", file=sys.stderr)


def _cells(
    args: argparse.Namespace, capture: Capture, session: Session, devices: Devices, typed: bool
) -> Iterator[Sequence[Any]]:
    """A row a frame. `typed`: as values of a table; else as text."""
    dissector, watched = dissector_for(session), Watched(capture)
    known = devices or None
    if args.reference:
        found = settled(watched.items(), session, known)
    else:
        found = settled_in_bulk(watched, session, known)
    for item in found:
        if typed:
            yield rows.typed(item, dissector, session)
        else:
            yield [text_cell(value) for value in rows.to_json(item, dissector, session).values()]


def text_cell(value: object) -> str:
    """A value as a cell of CSV; text that a spreadsheet would run is kept from it."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(int(value))
    return str(safe_cell(value)) if isinstance(value, str) else str(value)


class CsvFile:
    """A table as comma-separated values; the file has its name only when it is whole. Raises CaptureError.

    A context manager: after a capture that turned out to be damaged, what came before is written; after any other
    exception nothing.
    """

    def __init__(self, path: Path, names: Iterable[str]) -> None:
        self._file = NewFile(path)
        self._text = io.StringIO()
        self._writer = csv.writer(self._text, lineterminator="\n")
        self.add(list(names))

    def add(self, row: Sequence[Any]) -> None:
        """Add a row."""
        self._writer.writerow(row)
        if self._text.tell() > 1 << 16:
            self._flush()

    def __enter__(self) -> CsvFile:
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
