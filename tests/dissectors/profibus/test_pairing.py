"""What requests, repeats and polls become."""

from __future__ import annotations

from dissectors.frame import Chunk
from dissectors.line import LineSettings, Timing
from dissectors.profibus import PROFIBUS
from dissectors.profibus.telegram import SC, telegram
from dissectors.tracker import Transaction, Verdict
from sniff.analysis.nodes import NodeTable
from sniff.engine.engine import Engine

LINE = LineSettings.parse("187500,8E1")
MS = 1_000_000


def exchanges(*telegrams: bytes) -> tuple[list[Transaction], NodeTable]:
    """The transactions of telegrams 1 ms apart, and the stations that they show."""
    engine = Engine(PROFIBUS, Timing(LINE))
    nodes, closed, now = NodeTable(), [], 10**12
    for octets in telegrams:
        now += MS + len(octets) * LINE.char
        output = engine.feed(Chunk(now, octets))
        closed += output.transactions
        for row in output.rows:
            nodes.add_row(row)
    output = engine.close()
    closed += output.transactions
    for row in output.rows:
        nodes.add_row(row)
    for one in closed:
        nodes.add_transaction(one)
    return closed, nodes


def exchange(fcb: int, data: bytes = b"\1") -> bytes:
    return telegram(5, 1, 0x5D | fcb << 5, data)


def answer(data: bytes = b"\2") -> bytes:
    return telegram(1, 5, 0x08, data)


def test_a_poll_for_stations_that_nobody_answers_is_no_request_and_shows_no_station() -> None:
    closed, nodes = exchanges(telegram(9, 1, 0x49), telegram(5, 1, 0x49), telegram(1, 5, 0x00))
    assert [one.verdict for one in closed] == [Verdict.DATA, Verdict.ANSWERED]
    assert [node.address for node in nodes.present()] == [1, 5]
    assert nodes.absent() == [9]


def test_the_same_count_bit_at_once_is_a_repeat() -> None:
    closed, _ = exchanges(exchange(0), answer(), exchange(0), answer())
    assert [(one.verdict, one.attempt) for one in closed] == [(Verdict.ANSWERED, 1), (Verdict.RETRY, 2)]


def test_asked_again_later_is_asked_anew() -> None:
    other = telegram(6, 1, 0x5D, b"\1")
    closed, _ = exchanges(exchange(0), other, telegram(1, 6, 0x08, b"\2"), exchange(0))
    assert [one.attempt for one in closed] == [1, 1, 1]


def test_a_second_answer_after_damage_need_not_be_one() -> None:
    first, spoilt = exchange(0), bytearray(exchange(1))
    spoilt[-2] ^= 0xFF
    twice, _ = exchanges(first, answer(), answer(b"\3"))
    assert [one.verdict for one in twice] == [Verdict.ANSWERED, Verdict.ANSWERED_TWICE]
    lost, _ = exchanges(first, answer(), bytes(spoilt), answer(b"\3"))
    assert Verdict.ANSWERED_TWICE not in [one.verdict for one in lost]


def test_a_short_acknowledgement_answers_what_was_asked() -> None:
    closed, _ = exchanges(exchange(0), bytes((SC,)))
    assert [(one.station, one.verdict) for one in closed] == [(5, Verdict.ANSWERED)]
