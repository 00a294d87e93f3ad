"""The rhythm of a bus: what columns follow."""

from __future__ import annotations

import numpy as np
import pytest

from dissectors import registry
from dissectors.fingerprints import LONGEST
from dissectors.frame import Check, FoundBy, Frame
from dissectors.line import NS_PER_S
from sniff.analysis.rounds import MOST_ROUNDS, Rounds
from sniff.engine.engine import Output, Row
from sniff.engine.table import Table


def test_columns_go_on_where_all_frames_that_are_followed_are_too_long_for_them() -> None:
    rounds = Rounds()
    for number in range(MOST_ROUNDS):
        rounds.see(number.to_bytes(2, "big") * LONGEST, number)
    octets = bytes.fromhex("01 03 00 00 00 01 84 0A")
    frame = Frame("modbus-rtu", octets, 0, 1, Check.GOOD, FoundBy.GAP)
    header = registry.get("modbus-rtu").peek(frame)
    table = Table.of_outputs("modbus-rtu", 1, [Output(rows=(Row(1, frame, header, None),))])
    rounds.take(table, np.array([0]))
    assert not rounds.is_own(1_000_000_000)


@pytest.mark.parametrize("columns", [False, True])
@pytest.mark.parametrize("hole", [False, True])
def test_a_hole_does_not_end_a_rhythm(columns: bool, hole: bool) -> None:
    rounds, octets = Rounds(), bytes.fromhex("01 03 00 00 00 01 84 0A")
    starts = [*range(0, 100, 5), *range(700, 800, 5)]
    for part in (starts[:20], starts[20:]):
        if hole and part[0] == 700:
            rounds.miss(400 * NS_PER_S)
        frames = [
            Frame("modbus-rtu", octets, start * NS_PER_S, start * NS_PER_S + 1, Check.GOOD, FoundBy.GAP)
            for start in part
        ]
        header = registry.get("modbus-rtu").peek(frames[0])
        rows = tuple(Row(no, frame, header, None) for no, frame in enumerate(frames, 1))
        if columns:
            rounds.take(Table.of_outputs("modbus-rtu", 1, [Output(rows=rows)]), np.arange(len(rows)))
        else:
            for frame in frames:
                rounds.see(frame.octets, frame.start)
    assert rounds.is_own(5 * NS_PER_S) is hole
