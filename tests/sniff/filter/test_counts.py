"""Filters over our captures: how many rows each shows, and that Wireshark shows as many wherever it has the field."""

from __future__ import annotations

import re
import shutil
import subprocess
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

from sniff.bus.offline import settled_columns
from sniff.cli import main
from sniff.engine.column_join import SettledRows
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Session
from sniff.filter import Scope, compile_filter
from sniff.filter.choosing import chosen
from sniff.formats import read

CAPTURES = Path(__file__).parents[3] / "captures"


class Line(NamedTuple):
    """A filter, how many rows it shows, and "=" or why Wireshark shows another number."""

    capture: str
    filter: str
    count: int
    wireshark: str


def lines() -> list[Line]:
    text = (Path(__file__).parent / "counts.txt").read_text("utf-8")
    parts = [line.split(" | ") for line in text.splitlines() if line and not line.startswith("#")]
    return [Line(name, filter, int(count), why) for name, filter, count, why in parts]


LINES = lines()
NAMES = sorted({line.capture for line in LINES})


@cache
def rows_of(name: str) -> tuple[Session, list[SettledRows]]:
    capture = read(CAPTURES / f"{name}.cap.txt")
    return capture.session, list(settled_columns(capture, capture.session))


@pytest.mark.parametrize("name", NAMES)
def test_each_filter_shows_so_many_rows(name: str) -> None:
    session, columns = rows_of(name)
    dissector, scope = dissector_for(session), Scope(session.started)
    for line in LINES:
        if line.capture == name:
            wanted = compile_filter(line.filter, dissector, scope)
            assert sum(len(chosen(some, wanted)) for some in columns) == line.count, line.filter


def test_there_are_many_and_each_other_number_has_a_reason() -> None:
    assert len(LINES) >= 150
    assert all(line.wireshark == "=" or len(line.wireshark) > 20 for line in LINES)


@pytest.mark.skipif(shutil.which("tshark") is None, reason="needs tshark (Debian package tshark)")
@pytest.mark.parametrize("name", sorted({line.capture for line in LINES if line.wireshark == "="}))
def test_wireshark_shows_as_many(name: str, tmp_path: Path) -> None:
    packets = tmp_path / "packets.pcapng"
    assert main(["convert", str(CAPTURES / f"{name}.cap.txt"), str(packets)]) == 0
    asked = [line for line in LINES if line.capture == name and line.wireshark == "="]
    taps = ",".join(line.filter for line in asked)
    told = subprocess.run(
        ["tshark", "-r", str(packets), "-q", "-z", f"io,stat,0,{taps}"], capture_output=True, text=True, check=True
    )
    (counts,) = (line for line in told.stdout.splitlines() if "<>" in line and re.search(r"\d", line))
    frames = [int(cell) for cell in counts.strip("| \n").split("|")[1:]][::2]
    assert {line.filter: line.count for line in asked} == dict(
        zip([line.filter for line in asked], frames, strict=True)
    )
