"""`sniff.read`: every row of a data frame is that of `show --json` and `points --csv`; import stays quick."""

from __future__ import annotations

import csv
import importlib.util
import io
import json
import subprocess
import sys
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import sniff
from dissectors import registry
from dissectors.line import LineSettings
from sniff import data_frames
from sniff.bus.capture_writer import create
from sniff.bus.columns import FRAMES, TRANSACTIONS, Column, ColumnForm
from sniff.bus.offline import outputs
from sniff.bus.sample_row import COLUMNS
from sniff.cli import main
from sniff.data_frames import IncompleteCapture, NoDataFrames
from sniff.devices import UnknownProfile
from sniff.engine.capture import CaptureError
from sniff.engine.engine import Output
from sniff.formats import read
from tests.seeds import some
from tests.site_of_two import site_of_two

CAPTURES = Path(__file__).parents[2] / "captures"
NAMES = sorted(
    str(path.relative_to(CAPTURES)).removesuffix(".cap.txt")
    for path in [*CAPTURES.glob("*.cap.txt"), *sorted(CAPTURES.glob("findings/*.cap.txt"))[::5]]
)
SAME = ("no", "proto", "src", "dst", "role", "kind", "ok", "error", "found", "noise_before", "tx", "verdict")

needs_polars = pytest.mark.skipif(importlib.util.find_spec("polars") is None, reason="needs polars, the extra frames")
needs_pandas = pytest.mark.skipif(importlib.util.find_spec("pandas") is None, reason="needs pandas, which is no extra")
Shown = Callable[..., list[dict[str, Any]]]


@pytest.fixture
def shown(capsys: pytest.CaptureFixture[str]) -> Shown:
    """What `show --json` prints."""

    def show(path: Path, *words: str) -> list[dict[str, Any]]:
        assert main(["show", str(path), "--json", *words]) == 0
        return [json.loads(line) for line in capsys.readouterr().out.splitlines()]

    return show


def _rows_are_those_shown(rows: list[dict[str, Any]], expected: list[dict[str, Any]], started: int) -> None:
    assert len(rows) == len(expected)
    for row, wanted in zip(rows, expected, strict=True):
        assert {name: row[name] for name in SAME} == {name: wanted[name] for name in SAME}
        assert row["latency_ms"] == pytest.approx(wanted["latency_ms"], abs=1e-6)
        assert max(0, row["start_ns"] - started) == wanted["start_ns"]
        assert max(0, row["end_ns"] - started) == wanted["end_ns"]
        assert row["octets"].hex() == wanted["hex"]
        assert row["len"] == len(wanted["hex"]) // 2


@needs_polars
@pytest.mark.parametrize("name", some(NAMES, 2))
def test_every_row_is_that_of_show(name: str, shown: Shown) -> None:
    path = CAPTURES / f"{name}.cap.txt"
    capture = sniff.read(path)
    frame = capture.frames(octets=True)
    _rows_are_those_shown(frame.to_dicts(), shown(path), capture.started)
    if not name.startswith("findings/"):  # of each protocol some
        assert frame.drop("octets").equals(capture.frames(), null_equal=True)


@needs_pandas
@pytest.mark.parametrize("name", ["rtu-usual-faults", "mstp-usual-faults", "findings/adapter-unplugged"])
def test_pandas_where_only_pandas_is(name: str, shown: Shown, monkeypatch: pytest.MonkeyPatch) -> None:
    _without(monkeypatch, "polars")
    import pandas as pd  # type: ignore[import-untyped,unused-ignore]

    path = CAPTURES / f"{name}.cap.txt"
    capture = sniff.read(path)
    frame = capture.frames(octets=True)
    rows = [
        {key: None if pd.api.types.is_scalar(cell) and pd.isna(cell) else cell for key, cell in row.items()}
        for row in frame.to_dict("records")
    ]
    _rows_are_those_shown(rows, shown(path), capture.started)
    assert list(capture.transactions()) == list(TRANSACTIONS)
    assert str(frame["t"].dtype) == "datetime64[ns, UTC]"
    assert str(frame["kind"].dtype) == "category"
    values = sniff.read(path, devices="*=teco-e510").values()
    assert set(values) == {*COLUMNS, "time_ns"}
    assert len(values) > 0


@needs_polars
def test_types() -> None:
    import polars as pl

    frame = sniff.read(CAPTURES / "rtu-usual-faults.cap.txt").frames()
    assert frame.columns == list(FRAMES)
    assert frame["t"].dtype == pl.Datetime("ns", "UTC")
    assert frame["t"].cast(pl.Int64).to_list() == frame["start_ns"].to_list()
    for name in ("proto", "role", "kind", "error", "found", "damage", "verdict"):
        assert frame[name].dtype == pl.Categorical, name
    for name in ("start_ns", "end_ns", "src", "dst", "tx"):
        assert frame[name].dtype == pl.Int64, name
    assert frame["ok"].dtype == pl.Boolean


@needs_polars
@pytest.mark.parametrize("name", ["rtu-usual-faults", "mstp-usual-faults", "ascii-usual-faults", "n2-usual-faults"])
def test_every_transaction_is_that_of_the_engine(name: str) -> None:
    capture = read(CAPTURES / f"{name}.cap.txt")
    closed = [
        one
        for output in outputs(capture.items(), capture.session)
        if isinstance(output, Output)
        for one in output.transactions
    ]
    rows = sniff.read(CAPTURES / f"{name}.cap.txt").transactions().to_dicts()
    assert len(rows) == len(closed) > 0
    for row, one in zip(rows, closed, strict=True):
        assert (row["tx"], row["station"], row["kind"], row["verdict"]) == (
            one.id,
            one.station,
            one.kind,
            one.verdict.value,
        )
        assert (row["request"], row["response"], row["attempt"], row["of"], row["error"]) == (
            one.request,
            one.response,
            one.attempt,
            one.of,
            one.error,
        )
        assert (row["start_ns"], row["end_ns"]) == (one.start, one.end)
        latency = one.latency
        told = (None, None, None) if latency is None else (latency.nominal, latency.low, latency.high)
        found = row["latency_ms"], row["latency_low_ms"], row["latency_high_ms"]
        assert found == tuple(None if ns is None else ns / 1e6 for ns in told)


@needs_polars
def test_values_are_those_of_points(capsys: pytest.CaptureFixture[str]) -> None:
    path = CAPTURES / "rtu-clean.cap.txt"
    assert main(["points", str(path), "-d", "*=teco-e510", "--csv"]) == 0
    expected = list(csv.DictReader(io.StringIO(capsys.readouterr().out)))
    rows = sniff.read(path, devices=["*=teco-e510"]).values().to_dicts()
    assert len(rows) == len(expected) > 1
    for row, wanted in zip(rows, expected, strict=True):
        assert [row["device"], row["point"], row["unit"]] == [wanted["device"], wanted["point"], wanted["unit"]]
        assert str(row["frame"]) == wanted["frame"]
        assert row["text"] == wanted["value"] or row["value"] == float(wanted["value"])
        assert row["time_ns"] > sniff.read(path).started


@needs_polars
def test_settings_as_on_the_command_line(shown: Shown) -> None:
    path = CAPTURES / "rtu-clean.cap.txt"
    capture = sniff.read(path, protocol="modbus-rtu", line="4800,8N1")
    _rows_are_those_shown(
        capture.frames(octets=True).to_dicts(), shown(path, "-p", "modbus-rtu", "-s", "4800,8N1"), capture.started
    )


@needs_polars
def test_what_a_search_heard(tmp_path: Path, shown: Shown) -> None:
    path, source = tmp_path / "unknown.mcap", read(CAPTURES / "mstp-clean.cap.txt")
    unknown = replace(source.session, line=LineSettings.parse("9600,8N1"), unknown=("line", "protocol"))
    with create(path, unknown) as writer:
        for item in source.items():
            writer.write(item)
    capture = sniff.read(path)
    frame = capture.frames(octets=True)
    assert "searching" in frame["kind"]
    _rows_are_those_shown(frame.to_dicts(), shown(path), capture.started)


def test_words_that_mean_nothing() -> None:
    path = CAPTURES / "rtu-clean.cap.txt"
    with pytest.raises(registry.UnknownProtocol):
        sniff.read(path, protocol="morse")
    with pytest.raises(ValueError, match="line settings"):
        sniff.read(path, line="fast")
    with pytest.raises(ValueError, match="ADDRESS=PROFILE"):
        sniff.read(path, devices="teco-e510")
    with pytest.raises(UnknownProfile):
        sniff.read(path, devices="3=teapot")
    with pytest.raises(CaptureError):
        sniff.read(path.with_name("nothing.mcap"))


@needs_polars
def test_a_cut_recording_gives_what_came_before_and_says_so(tmp_path: Path, shown: Shown) -> None:
    whole, cut = tmp_path / "whole.mcap", tmp_path / "cut.mcap"
    assert main(["convert", str(CAPTURES / "rtu-usual-faults.cap.txt"), str(whole)]) == 0
    cut.write_bytes(whole.read_bytes()[:-400])
    capture = sniff.read(cut)
    with pytest.warns(IncompleteCapture):
        rows = capture.frames(octets=True).to_dicts()
    _rows_are_those_shown(rows, shown(cut), capture.started)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert len(sniff.read(whole).frames()) >= len(rows)


@needs_polars
def test_a_capture_without_anything() -> None:
    capture = sniff.read(CAPTURES / "findings" / "silent-bus.cap.txt")
    assert capture.frames().shape == (0, len(FRAMES))
    assert capture.transactions().shape == (0, len(TRANSACTIONS))
    assert len(capture.values()) == 0


def test_without_any_library_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    _without(monkeypatch, "polars", "pandas")
    capture = sniff.read(CAPTURES / "rtu-clean.cap.txt")
    for make in (capture.frames, capture.transactions, capture.values):
        with pytest.raises(NoDataFrames, match=r"sniff485\[frames\]"):
            make()


def test_the_package_alone_brings_no_library() -> None:
    code = "import sniff, sys; print([m for m in ('numpy', 'polars', 'pandas', 'sniff.formats') if m in sys.modules])"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "[]"


def _without(monkeypatch: pytest.MonkeyPatch, *names: str) -> None:
    find = importlib.util.find_spec
    monkeypatch.setattr("importlib.util.find_spec", lambda name, *rest: None if name in names else find(name, *rest))


@needs_polars
def test_a_bus_of_several_is_named(tmp_path: Path) -> None:
    clean, faults = CAPTURES / "rtu-clean.cap.txt", CAPTURES / "rtu-usual-faults.cap.txt"
    site = site_of_two(tmp_path, clean, faults)
    assert sniff.buses(site) == ("roof", "cellar")
    assert sniff.buses(clean) == ("bus",)
    for bus, path in zip(sniff.buses(site), (clean, faults), strict=True):
        assert sniff.read(site, bus=bus).frames(octets=True).equals(sniff.read(path).frames(octets=True))
    with pytest.raises(CaptureError, match="choose with bus=NAME, one of 'roof', 'cellar'"):
        sniff.read(site)
    with pytest.raises(CaptureError, match="no bus 'attic' in it"):
        sniff.read(site, bus="attic")


def test_pandas_has_no_instant_where_nobody_knows_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """With what of pandas is asked for, so that it need not be there."""
    told: dict[str, Any] = {}
    pandas = SimpleNamespace(
        DataFrame=told.update,
        DatetimeIndex=lambda values, tz: values,
        arrays=SimpleNamespace(IntegerArray=None, FloatingArray=None, BooleanArray=None),
    )
    monkeypatch.setitem(sys.modules, "pandas", pandas)
    column = Column(ColumnForm.TIME, np.array([5, 0], np.int64), np.array([False, True]))
    data_frames._pandas({"t": column}, {})
    assert np.isnat(told["t"]).tolist() == [False, True]
