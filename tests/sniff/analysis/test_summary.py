"""What is counted of the parts of a capture adds up to what is counted of the whole."""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sniff.analysis.summary import Summary
from sniff.engine import Output
from sniff.reading import outputs
from sniff.session import LineEvent, Session
from sniff.simulation.scenarios import scenario, simulate
from sniff.simulation.tap import EXACT


@cache
def heard(name: str) -> tuple[Session, tuple[Output | LineEvent, ...]]:
    session, items = simulate(scenario(name, seed=5), 20, EXACT)
    return session, tuple(outputs(items, session))


def counted(session: Session, items: tuple[Output | LineEvent, ...]) -> Summary:
    summary = Summary(session.line)
    for item in items:
        if isinstance(item, Output):
            summary.add(item)
        else:
            summary.add_line_event(item)
    return summary


@pytest.mark.parametrize("name", ["modbus-rtu", "n2", "mstp"])
@given(cuts=st.lists(st.floats(0, 1), min_size=1, max_size=3))
def test_parts_add_up_to_the_whole(name: str, cuts: list[float]) -> None:
    session, items = heard(name)
    places = [0, *sorted(int(cut * len(items)) for cut in cuts), len(items)]
    parts = [counted(session, items[a:b]) for a, b in pairwise(places)]
    whole = parts[0]
    for part in parts[1:]:
        whole = whole.merge(part)
    expected = counted(session, items)
    assert whole == expected
    assert expected.frames > 50
    assert expected.load.total.busy == sum(second.busy for second in expected.load.seconds.values())
