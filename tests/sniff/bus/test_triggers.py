"""Triggers fire on frames that match and on what rules find, not too often."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest

from sniff.analysis.judging import Judging
from sniff.bus.triggers import Triggers
from sniff.engine.bulk import tables
from sniff.engine.follow_settings import dissector_for
from sniff.engine.table import Table
from sniff.formats import read

CAPTURE = Path(__file__).parents[3] / "captures" / "rtu-usual-faults.cap.txt"


def test_a_filter_fires_on_its_frames_once_a_second() -> None:
    capture = read(CAPTURE)
    dissector = dissector_for(capture.session)
    triggers = Triggers(["verdict == exception"], dissector)
    every = Triggers(["dst == 1"], dissector)
    fired, often = [], []
    for table in tables(capture.blocks(), capture.session):
        if isinstance(table, Table):
            fired += triggers.see(table)
            often += every.see(table)
    assert fired
    assert all("verdict == exception: frame " in one.text for one in fired)
    times = [one.time for one in often]
    assert all(b - a >= 1_000_000_000 for a, b in pairwise(times))
    assert len(times) > 3


def test_a_rule_fires_when_it_finds_something_and_when_it_grows() -> None:
    capture = read(CAPTURE)
    dissector = dissector_for(capture.session)
    judging = Judging(capture.session, dissector)
    for table in tables(capture.blocks(), capture.session):
        if isinstance(table, Table):
            judging.add_table(table)
    found = judging.findings()
    triggers = Triggers(["MB001,MB008"], dissector)
    fired = list(triggers.judge(found))
    assert {one.text[:5] for one in fired} <= {"MB001", "MB008"}
    assert fired
    assert not list(triggers.judge(found))
    later = [replace(one, count=one.count + 1, last=one.last + 20_000_000_000) for one in found]
    assert len(list(triggers.judge(later))) == len(fired)


@pytest.mark.parametrize(
    ("words", "said"),
    [("MB999", "no such rule"), ("dst == ", "expected"), ("nosuchfield == 3", "nosuchfield")],
)
def test_what_cannot_be_understood_is_said(words: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        Triggers([words], dissector_for(read(CAPTURE).session))
