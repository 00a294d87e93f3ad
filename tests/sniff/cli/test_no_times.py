"""Of a log that does not say when anything came nothing is said of time, in any form."""

from __future__ import annotations

import csv
import importlib.util
import io
import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest

import sniff
from dissectors.frame import Chunk
from sniff.engine.session import LineEvent, LineEventKind
from sniff.formats import read
from sniff.recording.writer import Recorder
from tests.sniff.cli.conftest import Ran

CLEAN = Path(__file__).parents[3] / "captures"
LOG = "01 03 00 00 00 02 C4 0B\n01 03 04 00 01 00 02 2A 32\n" * 8
Run = Callable[..., Ran]


@pytest.fixture(params=["log", "mcap", "bin"])
def log(request: pytest.FixtureRequest, tmp_path: Path, sniff485: Run) -> Path:
    """As it was written, converted, and as octets and nothing else."""
    written = tmp_path / "bare.log"
    written.write_text(LOG)
    (tmp_path / "bare.bin").write_bytes(bytes.fromhex(LOG))
    if request.param == "mcap":
        assert sniff485("convert", written, tmp_path / "bare.mcap").code == 0
    return tmp_path / f"bare.{request.param}"


@pytest.mark.parametrize("more", [(), ("--reference",), ("-V",)])
def test_lines_have_no_seconds(more: tuple[str, ...], log: Path, sniff485: Run) -> None:
    out = sniff485("show", log, *more).out
    assert out.splitlines()[0].split()[:3] == ["1", "–", "1"]
    assert not re.search(r"\d\.\d{6} s|1970", out)


def test_frames_as_json_and_csv_have_no_instants(log: Path, sniff485: Run) -> None:
    for more in ((), ("--reference",)):
        rows = [json.loads(line) for line in sniff485("show", "--json", log, *more).out.splitlines()]
        assert len(rows) == 16
        assert {(row["t"], row["start_ns"], row["end_ns"], row["latency_ms"]) for row in rows} == {(None,) * 4}
        table = list(csv.DictReader(io.StringIO(sniff485("show", "--csv", log, *more).out)))
        assert {(row["t"], row["start_ns"], row["end_ns"]) for row in table} == {("",) * 3}


def test_fields_of_time_are_empty(log: Path, sniff485: Run) -> None:
    names = ("t", "start_ns", "frame.time", "frame.time_relative", "frame.time_delta")
    out = sniff485("show", log, "-T", "fields", "-e", "no", *(word for name in names for word in ("-e", name))).out
    assert [line.split("\t") for line in out.splitlines()] == [[str(no), "", "", "", "", ""] for no in range(1, 17)]


TIMED = (
    *("frame.time < '2020-01-01'", 't > "10:02"', "frame.time_delta < 5ms", "frame.time_relative", "start_ns >= 0"),
    *("latency_ms > 5ms", "!(latency_ms > 5ms)", "tx.latency_high_ms > 1", "frame.time_delta + 1s > 2s"),
)


@pytest.mark.parametrize("wanted", TIMED)
def test_filters_of_time_are_refused(wanted: str, log: Path, sniff485: Run) -> None:
    for command in (("show",), ("show", "--reference"), ("info",), ("check",), ("points",)):
        ran = sniff485(*command, log, "-Y", wanted.replace("'", '"'))
        assert (ran.code, ran.out) == (2, "")
        assert "does not say when anything came" in ran.err


def test_a_filter_that_asks_for_more_than_times_holds(log: Path, sniff485: Run) -> None:
    for wanted in ("latency_ms > 5ms || dst == 1", 'dst == 1 && !(frame.time > "10:02")'):
        assert len(sniff485("show", log, "-Y", wanted).out.splitlines()) == 8


def test_a_filter_of_time_for_several_captures(log: Path, sniff485: Run) -> None:
    ran = sniff485("show", "--json", log, CLEAN / "rtu-clean.cap.txt", "-Y", "latency_ms >= 0ms")
    assert ran.code == 0
    assert "latency_ms: this capture does not say when anything came" in ran.err
    assert {json.loads(line)["source"] for line in ran.out.splitlines()} == {str(CLEAN / "rtu-clean.cap.txt")}


def test_neither_stretches_nor_merging_go_by_time(log: Path, tmp_path: Path, sniff485: Run) -> None:
    made = tmp_path / "made.mcap"
    for times in (("--from", "+0.1"), ("--to", "+0.1"), ("--frames", "1-2", "--margin", "1s")):
        ran = sniff485("cut", log, "-o", made, *times)
        assert ran.code == 2
        assert "does not say when anything came" in ran.err
    assert sniff485("cut", log, "-o", made, "--frames", "1-2").code == 0
    ran = sniff485("merge", log, made, "-o", tmp_path / "merged.mcap")
    assert ran.code == 3
    assert "does not say when anything came; captures are merged by time" in ran.err


def test_loads_are_not_compared(log: Path, sniff485: Run) -> None:
    assert "load" not in sniff485("diff", log, CLEAN / "rtu-clean.cap.txt").out


def test_two_taps_are_not_compared(log: Path, sniff485: Run) -> None:
    ran = sniff485("taps", log, log)
    assert (ran.code, ran.out) == (2, "")
    assert "does not say when anything came" in ran.err


def test_findings_have_no_instants(log: Path, sniff485: Run) -> None:
    found = [json.loads(line) for line in sniff485("check", "--json", log).out.splitlines()]
    assert found
    assert {(one["first"], one["last"], one["first_ns"], one["last_ns"]) for one in found} == {(None,) * 4}
    assert re.search(r": modbus-rtu, .*, 16 frames", sniff485("check", log).out.splitlines()[0])


def test_nothing_is_said_of_gaps_that_nobody_measured(log: Path, sniff485: Run) -> None:
    assert "MB303" not in {json.loads(line)["code"] for line in sniff485("check", "--json", log).out.splitlines()}


def test_values_have_no_ages(log: Path, sniff485: Run) -> None:
    latest = [json.loads(line) for line in sniff485("points", "--latest", "--json", log).out.splitlines()]
    assert {one[name] for one in latest for name in ("age_s", "changed_s", "every_ms", "jitter_ms", "per_second")} == {
        None
    }
    assert {one["samples"] for one in latest} == {8}
    every = [json.loads(line) for line in sniff485("points", "--json", log).out.splitlines()]
    assert {one["time"] for one in every} == {None}
    polls = [json.loads(line) for line in sniff485("stats", "polls", "--json", log).out.splitlines()]
    assert {one[name] for one in polls for name in ("every_ms", "jitter_ms", "first", "last")} == {None}


def test_info_has_no_span_and_no_load(log: Path, sniff485: Run) -> None:
    said = sniff485("info", log).out
    assert "does not say when anything came" in said
    assert not re.search(r"load|p50|1970", said)
    told = json.loads(sniff485("info", "--json", log).out)
    assert {told[name] for name in ("first", "last", "seconds", "load", "response_ms")} == {None}


def test_the_page_has_no_span(log: Path, sniff485: Run) -> None:
    told = json.loads(sniff485("report", "--json", log).out)
    assert {told[name] for name in ("first", "last", "seconds", "load")} == {None}


def test_what_happened_to_the_line_has_no_instant(log: Path, tmp_path: Path, sniff485: Run) -> None:
    capture = read(log)
    recorder = Recorder(tmp_path / "dropped.mcap", capture.session)
    for item in capture.items():
        if isinstance(item, Chunk):
            recorder.chunk(item)
    recorder.line(LineEvent(item.time, LineEventKind.DROPPED, count=3))
    recorder.close()
    (happening,) = json.loads(sniff485("report", "--json", tmp_path / "dropped.mcap").out)["happenings"]
    assert (happening["at"], happening["count"]) == (None, 3)


def test_load_is_refused(log: Path, sniff485: Run) -> None:
    ran = sniff485("stats", "load", log)
    assert (ran.code, ran.out) == (2, "")
    assert "does not say when anything came" in ran.err


@pytest.mark.skipif(importlib.util.find_spec("polars") is None, reason="needs polars, the extra frames")
def test_data_frames_have_nulls(log: Path) -> None:
    capture = sniff.read(log)
    for frame in (capture.frames(), capture.transactions(), capture.values()):
        names = {"t", "time", "time_ns", "start_ns", "end_ns"} & {*frame.columns}
        assert names
        assert all(frame[name].null_count() == len(frame) > 0 for name in names)


@pytest.mark.parametrize("protocol", ["profibus", "mstp"])
def test_a_ring_has_no_rounds(protocol: str, tmp_path: Path, sniff485: Run) -> None:
    frames = [
        json.loads(line)["hex"]
        for line in sniff485("show", "--json", CLEAN / f"{protocol}-clean.cap.txt").out.splitlines()
    ]
    log = tmp_path / "ring.log"
    log.write_text("".join(f"{bytes.fromhex(octets).hex(' ')}\n" for octets in frames))
    told = [json.loads(line) for line in sniff485("stats", "ring", "--json", log, "-p", protocol).out.splitlines()]
    assert len(told) > 1
    assert {value for one in told for name, value in one.items() if name.endswith("_ms")} == {None}
    said = sniff485("stats", "ring", log, "-p", protocol).out
    assert "not known" in said
    assert not re.search(r" at \d|% of the time|\d s;", said)
