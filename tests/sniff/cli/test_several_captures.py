"""Of several captures, or a file with several buses, each row says of which it is."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from sniff.formats import read
from tests.site_of_two import site_of_two
from tests.sniff.cli.conftest import Ran

CAPTURES = Path(__file__).parents[3] / "captures"
CLEAN, FAULTS = CAPTURES / "rtu-clean.cap.txt", CAPTURES / "rtu-usual-faults.cap.txt"

Run = Callable[..., Ran]


@pytest.fixture
def site(tmp_path: Path) -> Path:
    return site_of_two(tmp_path, CLEAN, FAULTS)


def names(site: Path) -> list[str]:
    return [f"{site} [{one.session.bus}]" for one in read(site).buses]  # type: ignore[attr-defined]


def by_source(lines: str) -> dict[str, list[dict[str, Any]]]:
    told: dict[str, list[dict[str, Any]]] = {}
    for one in map(json.loads, lines.splitlines()):
        told.setdefault(one.pop("source"), []).append(one)
    return told


@pytest.mark.parametrize("more", [(), ("--reference",), ("-d", "1=teco-e510")])
def test_frames_as_json_and_csv(more: tuple[str, ...], site: Path, sniff485: Run) -> None:
    alone = [sniff485("show", "--json", f"--bus={one.session.bus}", site, *more).out for one in read(site).buses]  # type: ignore[attr-defined]
    expected = dict(zip(names(site), [list(map(json.loads, out.splitlines())) for out in alone], strict=True))
    assert by_source(sniff485("show", "--json", site, *more).out) == expected
    rows = list(csv.DictReader(io.StringIO(sniff485("show", "--csv", site, *more).out)))
    assert [(row["source"], int(row["no"])) for row in rows] == [
        (key, row["no"]) for key in expected for row in expected[key]
    ]


def test_frames_for_people_stand_under_names(site: Path, sniff485: Run) -> None:
    lines = sniff485("show", site, "-c", "1000").out.splitlines()
    first, second = names(site)
    assert lines[0] == first
    assert lines[lines.index(second) - 1] == ""
    assert sniff485("show", CLEAN).out.splitlines()[0].lstrip().startswith("1 ")


@pytest.mark.parametrize("more", [(), ("--reference",), ("-e", "frame.time_delta")])
def test_chosen_fields_say_of_which_they_are(more: tuple[str, ...], site: Path, sniff485: Run) -> None:
    expected = [
        [str(row["no"]), name] for name, rows in by_source(sniff485("show", "--json", site).out).items() for row in rows
    ]
    chosen = ("show", site, "-T", "fields")
    ran = sniff485(*chosen, "-e", "no", "-e", "source", *more)
    assert [line.split("\t")[:2] for line in ran.out.splitlines()] == expected
    assert "-e source" not in ran.err
    ran = sniff485(*chosen, "-e", "source", "-e", "no", "-e", "source", "-e", "kind", *more)
    assert [line.split("\t")[:3] for line in ran.out.splitlines()] == [[name, no, name] for no, name in expected]
    assert [line.split("\t")[0] for line in sniff485(*chosen, "-e", "source", *more).out.splitlines()] == [
        name for _, name in expected
    ]
    ran = sniff485(*chosen, "-e", "no", *more)
    assert [line.split("\t")[0] for line in ran.out.splitlines()] == [no for no, _ in expected]
    assert "-e source says of which each is" in ran.err


def test_a_single_capture_has_a_source(sniff485: Run) -> None:
    out = sniff485("show", CLEAN, "-T", "fields", "-e", "source", "-e", "no", "-c", "2").out
    assert out == f"{CLEAN}\t1\n{CLEAN}\t2\n"


def test_values(site: Path, sniff485: Run) -> None:
    told = by_source(sniff485("points", "--json", site).out)
    assert list(told) == names(site)
    lines = sniff485("points", "--latest", "--csv", site).out.splitlines()
    assert [line.split(",")[0] for line in lines].count("source") == 1
    said = sniff485("points", site).out.splitlines()
    assert [line for line in said if line in names(site)] == names(site)


def test_an_empty_name_chooses_the_only_bus(site: Path, sniff485: Run) -> None:
    assert sniff485("show", "--bus=", CLEAN).out == sniff485("show", CLEAN).out
    ran = sniff485("show", "--bus=", site)
    assert (ran.code, ran.out) == (3, "")
    assert "2 buses in it" in ran.err


def test_a_test_is_of_one_bus_and_two_captures_are_compared_by_bus(site: Path, sniff485: Run) -> None:
    ran = sniff485("snapshot", site)
    assert ran.code == 3
    assert (
        "(roof, cellar), and a test is of one; take it out: sniff485 convert site.mcap NAME.mcap --bus NAME" in ran.err
    )
    assert sniff485("diff", site, site).code == 2
    assert sniff485("diff", site, site, "--bus", "roof").code == 0
