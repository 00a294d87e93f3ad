"""However late a computer reads, and however much at once, the rules say the same row by row as by columns."""

from __future__ import annotations

from random import Random

import pytest

from dissectors.findings import Finding
from sniff.analysis.judging import Judging
from sniff.bus.offline import outputs
from sniff.devices import noted_devices
from sniff.engine.follow_settings import dissector_for
from sniff.engine.observer import observe
from sniff.engine.session import Item, Session
from sniff.formats import with_first_reads
from tests.faults.cases import CASES, FURTHER_CASES
from tests.faults.hearing import held_back
from tests.faults.judged import findings_of

NAMES = (
    "N2 two masters",
    "N2 one drive not heard here",
    "N2 answers into the next station",
    "RTU requests damaged here alone",
    "MS/TP second token",
    "PROFIBUS token sent again",
)

RING = 10
"""Seconds of a token ring, in which hundreds of frames are in each."""


def _by_rows(session: Session, items: list[Item]) -> tuple[Finding, ...]:
    judging = Judging(session, dissector_for(session), noted_devices(session))
    observe(outputs(items, session), judging)
    return judging.findings()


@pytest.mark.parametrize("name", NAMES)
def test_both_ways_say_the_same_of_what_is_read_at_once(name: str) -> None:
    (case,) = (case for case in (*CASES, *FURTHER_CASES) if case.name == name)
    session, heard = case.hear(
        case.make(seed=2), min(case.seconds, RING if case.name.startswith(("MS/TP", "PROFIBUS")) else 30), case.tap
    )
    items = list(held_back(iter(list(heard)), Random("x2")))
    session = with_first_reads(session, items)
    assert _by_rows(session, items) == findings_of(session, items)
