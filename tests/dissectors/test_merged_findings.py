"""Findings of several captures add up: in any grouping, without losing a count or a time."""

from __future__ import annotations

from dataclasses import replace
from itertools import chain

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dissectors.findings import Finding, Severity, merged


@st.composite
def findings(draw: st.DrawFn) -> tuple[Finding, ...]:
    """Those of one capture: each rule says one thing about a subject."""
    keys = draw(st.sets(st.tuples(st.sampled_from(("MB001", "MB002", "LN101")), st.sampled_from(("bus", "station 4")))))
    made = []
    for code, subject in sorted(keys):
        first = draw(st.integers(0, 100))
        made.append(
            Finding(
                code,
                draw(st.sampled_from(Severity)),
                subject,
                first,
                first + draw(st.integers(0, 100)),
                draw(st.integers(1, 50)),
                (draw(st.integers(1, 9)),),
                draw(st.text(max_size=3)),
                "means",
                "next",
            )
        )
    return tuple(made)


@given(parts=st.lists(findings(), max_size=6), cut=st.integers(0, 6))
def test_parts_of_parts_add_up(parts: list[tuple[Finding, ...]], cut: int) -> None:
    whole = merged(parts)
    again = merged([merged(parts[:cut]), merged(parts[cut:])])
    key = {(one.code, one.subject): (one.severity, one.count, one.first, one.last) for one in whole}
    assert {(one.code, one.subject): (one.severity, one.count, one.first, one.last) for one in again} == key
    every = list(chain.from_iterable(parts))
    assert sum(one.count for one in whole) == sum(one.count for one in every)
    for (code, subject), (severity, _, first, last) in key.items():
        same = [one for one in every if (one.code, one.subject) == (code, subject)]
        assert severity is max(one.severity for one in same)
        assert (first, last) == (min(one.first for one in same), max(one.last for one in same))
    assert [one.severity for one in whole] == sorted((one.severity for one in whole), reverse=True)


def test_words_and_evidence_are_of_one_capture() -> None:
    mild = Finding("MB001", Severity.NOTE, "station 4", 0, 9, 40, (1, 2), "40 of 50", "means", "next")
    grave = Finding("MB001", Severity.ERROR, "station 4", 20, 29, 4, (7,), "4 of 4", "dead", "look")
    for both in (mild.merge(grave), grave.merge(mild)):
        assert both == Finding("MB001", Severity.ERROR, "station 4", 0, 29, 44, (7,), "4 of 4", "dead", "look")


def test_what_is_found_of_the_bus_concerns_the_stations_of_all_parts() -> None:
    one = Finding("LN305", Severity.ERROR, "bus", 0, 9, 2, (), "2 and 3 lost", "", "", stations=(3, 2))
    other = replace(one, stations=(4, 3), severity=Severity.WARNING)
    assert one.merge(other).stations == other.merge(one).stations == (2, 3, 4)
    assert one.merge(one).stations == (3, 2)
    assert one.merge(replace(other, stations=())).stations == ()


def test_two_things_do_not_merge() -> None:
    one = Finding("MB001", Severity.NOTE, "station 4", 0, 9, 4, (), "", "", "")
    with pytest.raises(ValueError, match="two things"):
        one.merge(Finding("MB001", Severity.NOTE, "station 5", 0, 9, 4, (), "", "", ""))
