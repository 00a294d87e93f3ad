"""Who sent a damaged telegram: the turn says it, and nobody is named who was never heard well."""

from __future__ import annotations

import pytest

from dissectors.frame import Chunk, Frame
from dissectors.line import LineSettings, Timing
from dissectors.profibus import PROFIBUS
from dissectors.profibus.telegram import telegram, token
from dissectors.tracker import Verdict
from sniff.analysis.nodes import NodeTable
from sniff.engine.engine import Engine, Row

LINE = LineSettings.parse("187500,8E1")
PAUSE = 200_000  # ns, less than a master waits before it takes the token

EXCHANGE, INPUTS = telegram(5, 2, 0x5D, b"\x01\x02"), telegram(2, 5, 0x08, b"\x03\x04")
OTHER, SHORT = telegram(12, 3, 0x5D, b"\x07"), b"\xe5"
ROUND = [EXCHANGE, INPUTS, token(3, 2), OTHER, SHORT, token(2, 3)]
POLL = telegram(9, 2, 0x49)


def spoilt(octets: bytes, *changes: tuple[int, int]) -> bytes:
    """Octets with some bits at some places wrong."""
    wrong = bytearray(octets)
    for at, bits in changes:
        wrong[at] ^= bits
    return bytes(wrong)


def heard(*telegrams: bytes) -> tuple[list[Row], dict[int, Verdict], NodeTable]:
    """Rows and verdicts by request of two good rounds and what follows, and the stations that they show."""
    engine, nodes, now = Engine(PROFIBUS, Timing(LINE)), NodeTable(), 10**12
    rows: list[Row] = []
    verdicts: dict[int, Verdict] = {}
    outputs = []
    for octets in (*ROUND, *ROUND, *telegrams, *ROUND):
        now += PAUSE + len(octets) * LINE.char
        outputs.append(engine.feed(Chunk(now, octets)))
    for output in (*outputs, engine.close()):
        rows += output.rows
        verdicts |= {one.request: one.verdict for one in output.transactions if one.request is not None}
        for row in output.rows:
            nodes.add_row(row)
        for one in output.transactions:
            nodes.add_transaction(one)
    return rows, verdicts, nodes


def damaged(rows: list[Row]) -> list[tuple[int | None, int | None]]:
    """Source and destination of the damaged telegrams, as they are placed."""
    bad = [row for row in rows if isinstance(row.event, Frame) and not row.event.ok]
    return [(row.placement.source, row.placement.destination) for row in bad if row.placement is not None]


@pytest.mark.parametrize(
    ("telegrams", "said"),
    [
        ([spoilt(EXCHANGE, (5, 0x40)), INPUTS, *ROUND[2:]], (2, 5)),  # the source
        ([spoilt(EXCHANGE, (4, 0x40)), INPUTS, *ROUND[2:]], (2, None)),  # the destination
        ([EXCHANGE, spoilt(INPUTS, (5, 0x02)), *ROUND[2:]], (5, 2)),
        ([EXCHANGE, spoilt(INPUTS, (3, 0x02), (8, 0x80)), *ROUND[2:]], (5, 2)),  # in the head, and in the data
        ([EXCHANGE, INPUTS[:-3], *ROUND[2:]], (5, 2)),
        ([EXCHANGE, INPUTS, spoilt(token(3, 2), (2, 0x20)), *ROUND[3:]], (2, 3)),
        ([EXCHANGE, INPUTS, spoilt(token(3, 2), (0, 0x08)), *ROUND[3:]], (2, 3)),
        ([EXCHANGE, INPUTS, token(3, 2)[:2], *ROUND[3:]], (2, 3)),
        ([EXCHANGE, INPUTS, token(3, 2)[1:], *ROUND[3:]], (2, 3)),
        ([POLL, spoilt(EXCHANGE, (7, 0x10)), INPUTS, *ROUND[2:]], (2, 5)),  # nobody need answer a poll
    ],
)
def test_the_turn_names_who_sent_it(telegrams: list[bytes], said: tuple[int | None, int | None]) -> None:
    rows, _, nodes = heard(*telegrams)
    assert damaged(rows) == [said]
    assert {node.address for node in nodes.present()} <= {2, 3, 5, 12}


def test_behind_a_token_that_was_lost_nobody_is_named_but_by_his_own_word() -> None:
    rows, _, _ = heard(EXCHANGE, INPUTS, b"\x00\xff\x31\x07", spoilt(OTHER, (5, 0x40)), SHORT, token(2, 3))
    assert damaged(rows)[-1][0] is None
    rows, _, _ = heard(EXCHANGE, INPUTS, b"\x00\xff\x31\x07", spoilt(OTHER, (7, 0x40)), SHORT, token(2, 3))
    assert damaged(rows)[-1][0] == 3


def test_a_station_that_only_damaged_telegrams_name_is_none() -> None:
    rows, _, nodes = heard(spoilt(EXCHANGE, (4, 0x40)), spoilt(INPUTS, (5, 0x10)), spoilt(POLL, (1, 0x04)), token(3, 2))
    assert [node.address for node in nodes.present()] == [2, 3, 5, 12]
    assert nodes.absent() == []
    assert all(source in (None, 2, 3, 5, 12) for source, _ in damaged(rows))


def test_an_answer_tells_whom_a_damaged_request_was_for() -> None:
    _, verdicts, nodes = heard(spoilt(EXCHANGE, (4, 0x08)), INPUTS, *ROUND[2:])
    assert Verdict.UNSOLICITED not in verdicts.values()
    assert [node.address for node in nodes.present()] == [2, 3, 5, 12]
