"""Tables as Parquet files, for notebooks and data bases. Needs polars: `pip install 'sniff485[parquet]'`.

polars because it is under the MIT licence; the other libraries that write Parquet are under Apache-2.0 alone, which
does not go into one process with scapy.
"""

from __future__ import annotations

import importlib.util
import io
from collections.abc import Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sniff.engine.capture import CaptureError
from sniff.formats.files import NewFile

if TYPE_CHECKING:
    import polars as pl

I64 = 1 << 63
BATCH = 65_536
"""Rows gathered before they become columns: what is held as Python objects at most."""


class Kind(Enum):
    """What a column holds. `TIME`: ns since the epoch, written as an instant of UTC with nanoseconds."""

    TIME = "time"
    TEXT = "text"
    NUMBER = "number"
    INTEGER = "integer"
    TRUTH = "truth"


def available() -> bool:
    """Whether the library is there."""
    return importlib.util.find_spec("polars") is not None


class ParquetWriter:
    """A table that grows; the file has its name only when it is whole, at `close`. Raises CaptureError.

    A context manager: after a capture that turned out to be damaged, what came before is written; after any other
    exception nothing.
    """

    def __init__(self, path: Path, columns: Mapping[str, Kind]) -> None:
        self._file = NewFile(path)
        self._columns = columns
        self._rows: list[Sequence[Any]] = []
        self._parts: list[pl.DataFrame] = []

    def add(self, row: Sequence[Any]) -> None:
        """Add a row, its cells in the order of the columns; None is a hole, and so is an integer beyond 64 bits."""
        self._rows.append([None if isinstance(cell, int) and not -I64 <= cell < I64 else cell for cell in row])
        if len(self._rows) >= BATCH:
            self._gather()

    def close(self) -> None:
        """Write the file. Raises CaptureError."""
        import polars as pl

        self._gather()
        made = io.BytesIO()  # polars does not say what the system says of a file
        pl.concat(self._parts).write_parquet(made)
        self._file.write(made.getbuffer())
        self._file.close()

    def __enter__(self) -> ParquetWriter:
        return self

    def __exit__(self, kind: type[BaseException] | None, *exc: object) -> None:
        if kind is None or issubclass(kind, CaptureError):
            self.close()
        else:
            self._file.discard()

    def _gather(self) -> None:
        import polars as pl

        types = {
            Kind.TIME: pl.Datetime("ns", "UTC"),
            Kind.TEXT: pl.String(),
            Kind.NUMBER: pl.Float64(),
            Kind.INTEGER: pl.Int64(),
            Kind.TRUTH: pl.Boolean(),
        }
        schema = {name: types[kind] for name, kind in self._columns.items()}
        self._parts.append(pl.DataFrame(self._rows, schema=schema, orient="row"))
        self._rows = []
