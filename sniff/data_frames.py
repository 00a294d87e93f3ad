"""A capture as data frames, for notebooks: `sniff.read("night.mcap").frames()`.

They are polars frames (`pip install 'sniff485[frames]'`), pandas frames where only pandas is there. A text column with
few different texts is categorical; an optional number that is not there is null.
"""

from __future__ import annotations

import importlib.util
import warnings
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from dissectors.line import LineSettings
from dissectors.profiles import Devices
from sniff import devices as profiles
from sniff.analysis.point_reader import PointReader
from sniff.analysis.told_protocol import detected
from sniff.bus.columns import Column, ColumnForm, Columns, TableColumns
from sniff.bus.sample_row import COLUMNS, sample_row
from sniff.bus.second_proof import SecondProof, proving
from sniff.bus.second_protocol import with_foreign
from sniff.engine.bulk import tables_of
from sniff.engine.capture import Capture, CaptureError
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Session, with_settings
from sniff.engine.table import Table
from sniff.formats import read as open_capture
from sniff.formats.parquet import I64, Kind
from sniff.formats.several_buses import buses_in, chosen

OF_TIME = frozenset(("t", "time", "start_ns", "end_ns", "time_ns"))
"""Columns that hold when something was."""


class NoDataFrames(ImportError):
    """Neither polars nor pandas is there; the message says how to get one."""


class IncompleteCapture(UserWarning):
    """A capture that ends too early or is damaged: the frames are what came before."""


def read(
    path: str | Path,
    protocol: str | None = None,
    line: str | None = None,
    devices: str | Iterable[str] = (),
    bus: str | None = None,
) -> DataCapture:
    """Open a capture. `protocol`, `line`, `devices`: as -p, -s and -d say it; "9600,8N1", "3=NAME". `bus`: which one of
    a file with several.

    Raises CaptureError for a file that cannot be read, or holds several buses where none is named, ValueError
    (registry.UnknownProtocol, devices.UnknownProfile) for words that mean nothing.
    """
    whole = open_capture(path)
    with chosen(bus):
        capture, *others = buses_in(whole, path)
    if others:
        names = ", ".join(repr(one.session.bus) for one in (capture, *others))
        raise CaptureError(f"{path}: {len(others) + 1} buses in it; choose with bus=NAME, one of {names}")
    session = with_settings(detected(capture.session), protocol, LineSettings.parse(line) if line is not None else None)
    dissector_for(session)
    words = (devices,) if isinstance(devices, str) else tuple(devices)
    said = profiles.devices(dict(map(profiles.assignment, words)))
    return DataCapture(str(path), capture, session, said.over(profiles.noted_devices(session)))


def buses(path: str | Path) -> tuple[str, ...]:
    """The names of the buses in a capture, one as a rule. Raises CaptureError."""
    return tuple(one.session.bus for one in buses_in(open_capture(path), path))


class DataCapture:
    """A capture of which data frames are made; it is read anew for each, but frames and transactions share a reading.

    `session`: what it says of itself, with the settings that were given. `started`: ns since the epoch.
    """

    def __init__(self, path: str, capture: Capture, session: Session, devices: Devices) -> None:
        self.path = path
        self.session = session
        self.devices = devices
        self._capture = capture
        self._columns: TableColumns | None = None

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.path}: {self.session.protocol} {self.session.line}>"

    @property
    def started(self) -> int:
        """ns since the epoch; what `show --json` counts its times from."""
        return self.session.started

    def frames(self, octets: bool = False) -> Any:
        """A row for every frame and every stretch of noise, under the names of `show --json`; frames of a second
        protocol on the bus as such.

        `t` is an instant of UTC, `start_ns` and `end_ns` are ns since the epoch, `latency_ms` is the response time of
        the transaction that the frame belongs to. `octets`: with those on the wire, which makes an object of each row.
        """
        if not octets:
            return _maker()(self._known(self._read().frames()), {})
        columns = self._read_anew(octets=True)
        return _maker()(self._known(columns.frames()), {"octets": columns.octets()})

    def transactions(self) -> Any:
        """A row for every transaction, in the order of closing. Response times in ms, with the least and the most that
        the adapter allows; `request` and `response` are numbers (`no`) of frames, `of` a transaction (`tx`)."""
        return _maker()(self._known(self._read().transactions()), {})

    def values(self) -> Any:
        """A row for every value that was read or written, as `points --parquet` has it; `time_ns` since the epoch."""
        from sniff.analysis.table_points import samples_of

        make = _maker()
        reader = PointReader(dissector_for(self.session), self.devices)
        rows = [sample_row(sample) for table in self._tables() for sample in samples_of(reader, table).in_order()]
        held = list(zip(*rows, strict=True)) or [()] * len(COLUMNS)
        columns: dict[str, Column] = {}
        for (name, kind), cells in zip(COLUMNS.items(), held, strict=True):
            columns[name] = _column(kind, cells)
            if kind is Kind.TIME:
                columns[f"{name}_ns"] = _column(Kind.INTEGER, cells)
        return make(self._known(columns), {})

    def _known(self, columns: Columns) -> Columns:
        """The columns, those of times empty where the capture does not say when anything came."""
        if self.session.has_times:
            return columns
        return {
            name: replace(column, missing=np.ones(len(column.values), bool)) if name in OF_TIME else column
            for name, column in columns.items()
        }

    def _read(self) -> TableColumns:
        if self._columns is None:
            self._columns = self._read_anew()
        return self._columns

    def _read_anew(self, octets: bool = False) -> TableColumns:
        columns, proof = TableColumns(octets), SecondProof(self.session)
        for table, foreign in with_foreign(self._tables(proof), self.session, proof):
            columns.add(table, foreign)
        return columns

    def _tables(self, proof: SecondProof | None = None) -> Iterator[Table]:
        """All that can be read; a warning where that is not all. `proof`: sees each before it is given."""
        try:
            for item in proving(tables_of(self._capture, self.session), proof):
                if isinstance(item, Table):
                    yield item
        except CaptureError as error:
            warnings.warn(str(error), IncompleteCapture, stacklevel=4)
            return
        complete = self._capture.completeness()
        if not complete.whole:
            warnings.warn(f"{self.path}: {complete.text}", IncompleteCapture, stacklevel=4)


def _column(kind: Kind, cells: Sequence[Any]) -> Column:
    """Cells as a column; an integer beyond 64 bits is not there."""
    kept = [None if isinstance(cell, int) and not -I64 <= cell < I64 else cell for cell in cells]
    missing = np.array([cell is None for cell in kept], bool)
    hole = missing if missing.any() else None
    if kind is Kind.TEXT:
        numbers: dict[str, int] = {}
        places = [0 if cell is None else numbers.setdefault(cell, len(numbers)) for cell in kept]
        return Column(ColumnForm.TEXT, np.array(places, np.int32), hole, tuple(numbers))
    form, of = {
        Kind.TIME: (ColumnForm.TIME, np.int64),
        Kind.INTEGER: (ColumnForm.INTEGER, np.int64),
        Kind.NUMBER: (ColumnForm.NUMBER, np.float64),
    }[kind]
    return Column(form, np.array([0 if cell is None else cell for cell in kept], of), hole)


def _maker() -> Any:
    """What makes data frames here. Raises NoDataFrames."""
    if importlib.util.find_spec("polars") is not None:
        return _polars
    if importlib.util.find_spec("pandas") is not None:
        return _pandas
    raise NoDataFrames("data frames need polars: pip install 'sniff485[frames]' (or pandas)")


def _polars(columns: Columns, octets: dict[str, Sequence[bytes]]) -> Any:
    import polars as pl

    def series(name: str, column: Column) -> pl.Series:
        made = pl.Series(name, column.values)
        if column.missing is not None:
            made = pl.select(pl.when(pl.Series(~column.missing)).then(made).alias(name)).to_series()
        if column.form is ColumnForm.TIME:
            return made.cast(pl.Datetime("ns", "UTC"))
        if column.form is ColumnForm.TEXT:
            texts = pl.Series(name, column.texts or [""], dtype=pl.Categorical)
            return texts.gather(made.cast(pl.UInt32))
        return made

    made = [series(name, column) for name, column in columns.items()]
    return pl.DataFrame([*made, *(pl.Series(name, held, dtype=pl.Binary) for name, held in octets.items())])


def _pandas(columns: Columns, octets: dict[str, Sequence[bytes]]) -> Any:
    pd: Any = importlib.import_module("pandas")

    def series(column: Column) -> Any:
        missing = column.missing if column.missing is not None else np.zeros(len(column.values), bool)
        if column.form is ColumnForm.TEXT:
            return pd.Categorical.from_codes(np.where(missing, -1, column.values), list(column.texts))
        if column.form is ColumnForm.TIME:
            told = np.where(missing, np.datetime64("NaT", "ns"), column.values.view("M8[ns]"))
            return pd.DatetimeIndex(told, tz="UTC")
        if column.missing is None:
            return column.values
        array = {
            ColumnForm.INTEGER: pd.arrays.IntegerArray,
            ColumnForm.NUMBER: pd.arrays.FloatingArray,
            ColumnForm.TRUTH: pd.arrays.BooleanArray,
        }
        return array[column.form](column.values, missing)

    return pd.DataFrame(
        {**{name: series(one) for name, one in columns.items()}, **{k: list(v) for k, v in octets.items()}}
    )
