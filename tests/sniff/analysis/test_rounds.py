"""The rhythm of a bus: what columns follow."""

from __future__ import annotations

import numpy as np

from dissectors import registry
from dissectors.fingerprints import LONGEST
from dissectors.frame import Check, FoundBy, Frame
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
