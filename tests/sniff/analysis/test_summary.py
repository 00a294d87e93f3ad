"""What is counted of the parts of a capture adds up to what is counted of the whole."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dissectors.tracker import Transaction, Verdict
from sniff.analysis.nodes import NodeTable
from sniff.analysis.summary import Summary
from sniff.bus.offline import outputs
from sniff.engine.engine import Output
from sniff.engine.session import LineEvent, Session
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


@cache
def counted_whole(name: str) -> Summary:
    return counted(*heard(name))


@pytest.mark.parametrize("name", ["modbus-rtu", "n2", "mstp"])
@settings(max_examples=25, deadline=None)
@given(cuts=st.lists(st.floats(0, 1), min_size=1, max_size=3))
def test_parts_add_up_to_the_whole(name: str, cuts: list[float]) -> None:
    session, items = heard(name)
    places = [0, *sorted(int(cut * len(items)) for cut in cuts), len(items)]
    parts = [counted(session, items[a:b]) for a, b in pairwise(places)]
    whole = parts[0]
    for part in parts[1:]:
        whole = whole.merge(part)
    expected = counted_whole(name)
    assert whole == expected
    assert expected.frames > 50
    assert expected.load.total.busy == sum(second.busy for second in expected.load.seconds.values())


@pytest.mark.parametrize(("kind", "tokens"), [("token", 2), ("poll-for-master", 0)])
def test_a_token_is_no_request(kind: str, tokens: int) -> None:
    """Nor is a poll for masters, and who is only polled for is nobody."""
    unused = Transaction(1, 27, kind, 1, None, Verdict.NO_RESPONSE, 0, 1)
    request = replace(unused, id=2, kind="read-property")
    table = NodeTable()
    for transaction in (unused, unused, request, replace(request, verdict=Verdict.ANSWERED)):
        table.add_transaction(transaction)
    (node,) = table.merge(NodeTable())
    assert (node.asked, node.unanswered, node.passed, node.unused) == (2, 1, 2, tokens)
    assert NodeTable(dict(table.nodes)).present() == [node]
    only_given = NodeTable()
    only_given.add_transaction(unused)
    assert [node.address for node in only_given.present()] == ([27] if tokens else [])
