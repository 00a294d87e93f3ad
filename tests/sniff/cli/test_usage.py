"""What is wrong with a command line is one line that says where to read more."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import pytest

from sniff.cli import arguments
from tests.sniff.cli.conftest import Ran

CLEAN = Path(__file__).parents[3] / "captures" / "rtu-clean.cap.txt"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("show",), "sniff485 show: the following arguments are required: FILE; `sniff485 show --help` says more"),
        (("show", CLEAN, "--bogus"), "sniff485: show: does not know --bogus; `sniff485 show --help` says "),
        (("show", CLEAN, "--bo\x1bgus"), "sniff485: show: does not know --bo\\x1bgus; "),
        (("check", "--format", "\x1b[2J", CLEAN), "sniff485 check: argument --format: invalid choice: '\\x1b[2J' "),
        (("stats", CLEAN, "nodes", "--every", "5s"), "sniff485: --every is the length of a row of load, "),
        (("stats", CLEAN, "--duration", "5s"), "sniff485: --duration is for a port; "),
        (("check", CLEAN, "--duration", "5s"), "sniff485: --duration is for a port; "),
        (("points", CLEAN, "--duration", "5s"), "sniff485: --duration is for a port; "),
        (("stats", CLEAN, "load", "--every", "500ms"), "sniff485: --every 0.5 s: load is counted by whole seconds; "),
        (("stats", CLEAN, "load", "--every", "5x"), "sniff485 stats: argument --every: duration '5x': expected "),
        (("cut", CLEAN, "--frames", "0-3", "-o", "x.mcap"), "sniff485: frames '0-3': they are counted from 1"),
        (("replay", CLEAN, "--to", "tcp", "-Y", "dst == 200"), f"sniff485: {CLEAN}: no octets of frames that match; "),
        (("check", CLEAN, "--json", "--odd", "3", CLEAN), "sniff485: check: does not know --odd; "),
    ],
)
def test_it_is_one_line(words: tuple[object, ...], said: str, sniff485: Callable[..., Ran]) -> None:
    ran = sniff485(*words)
    assert (ran.code, ran.out) == (2, "")
    assert ran.err.startswith(said)
    assert len(ran.err.splitlines()) == 1


@pytest.mark.parametrize(
    "words",
    [("check", CLEAN, "--json", CLEAN), ("check", "--json", "--", CLEAN, CLEAN), ("check", CLEAN, CLEAN, "--json")],
)
def test_files_may_stand_on_both_sides_of_an_option(words: tuple[object, ...], sniff485: Callable[..., Ran]) -> None:
    ran = sniff485(*words)
    assert ran.err == ""
    assert ran.out == sniff485("check", "--json", CLEAN, CLEAN).out


@pytest.mark.parametrize(
    "words", [("load", "--every", "2s", CLEAN), ("--every", "2s", CLEAN, "load"), (CLEAN, "load", "--every", "2000ms")]
)
def test_a_table_may_stand_before_and_after_its_files(words: tuple[object, ...], sniff485: Callable[..., Ran]) -> None:
    assert sniff485("stats", *words).out == sniff485("stats", CLEAN, "--table", "load", "--every", "2s").out


@pytest.mark.parametrize("option", ["-w", "--write", "-o", "--output"])
def test_a_recording_is_named_as_any_other_file_that_is_written(
    option: str, sniff485: Callable[..., Ran], tmp_path: Path
) -> None:
    ran = sniff485("record", "/dev/null", "-s", "9600,8N1", "-p", "n2", option, tmp_path / "x.txt")
    assert ".mcap" in ran.err
    assert ran.code == 2


@pytest.mark.parametrize(
    ("name", "table", "protocols"),
    [
        ("rtu-clean", "ring", {"mstp", "profibus"}),
        ("rtu-clean", "stations", {"profibus"}),
        ("mstp-clean", "stations", {"profibus"}),
    ],
)
def test_a_table_that_is_not_for_a_protocol_names_those_it_is_for(
    name: str, table: str, protocols: set[str], sniff485: Callable[..., Ran]
) -> None:
    ran = sniff485("stats", CLEAN.with_name(f"{name}.cap.txt"), table)
    assert (ran.code, ran.out) == (2, "")
    told = ran.err.partition("this table is for ")[2].partition(";")[0]
    assert set(told.strip().split(", ")) == protocols


@pytest.mark.parametrize(("text", "seconds"), [("90", 90), ("5m", 300), ("5min", 300), ("1.5 min", 90), ("500ms", 0.5)])
def test_durations_are_written_as_this_program_writes_them(text: str, seconds: float) -> None:
    assert arguments.duration(text) == seconds


@pytest.mark.parametrize("text", ["", "min", "5n", "5 mins", "5msmin", "nan", "inf", "-5"])
def test_other_durations_are_refused(text: str) -> None:
    with pytest.raises(argparse.ArgumentTypeError):
        arguments.duration(text)
