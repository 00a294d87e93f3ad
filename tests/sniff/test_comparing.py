"""Two captures side by side: a few of very many are told as such."""

from __future__ import annotations

from dissectors.line import LineSettings
from sniff.analysis.nodes import Node, NodeTable
from sniff.analysis.summary import Summary
from sniff.editing.comparing import Side, differences


def test_one_of_very_many_is_no_nothing() -> None:
    def side(damaged: int, sent: int) -> Side:
        nodes = NodeTable({3: Node(3, sent=sent, heard=1)} if sent else {})
        counts = Summary(LineSettings(), frames=10_000, damaged=damaged, nodes=nodes)
        return Side("", counts, (), 0)

    told = {(one.subject, one.what): (one.before, one.after) for one in differences(side(0, 0), side(1, 1))}
    assert told["bus", "damaged frames"] == ("0.0%", "under 0.1%")
    assert told["station 3", "presence"] == ("absent", "1 frame from it, 0 requests to it")
    told = {(one.subject, one.what): (one.before, one.after) for one in differences(side(10_000, 1), side(9_999, 1))}
    assert told == {}
