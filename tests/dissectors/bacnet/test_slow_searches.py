"""Stations that go on late: with their searches, behind answers that others send late; and tokens that are lost."""

from __future__ import annotations

import pytest

from dissectors.bacnet.ring_events import RingEventKind
from tests.dissectors.bacnet.ring_script import Step, data, poll, rounds, script, token

READ = "01040003010c0c020004d2194d"
VALUE = "010030010c0c020004d2194d3e75030041313f"


@pytest.mark.parametrize("own_tokens", [True, False])
def test_a_lone_master_that_polls_slowly_loses_no_token(own_tokens: bool):
    """Its token to itself is no reason to call each silence of its search a lost one."""
    steps: list[Step] = []
    for _ in range(3):
        steps += [(700 + 13 * to, poll(1, to)) for to in (*range(2, 32), 0)]
        steps += [(2, token(1, 1))] if own_tokens else []
    read = script(steps)
    assert not any(what in (RingEventKind.LOST_TOKEN, RingEventKind.ALL_SILENT) for what, _ in read.ring.happened)
    assert ("MS203", "MAC 1") in read.graves()


def test_a_station_that_begins_anew_after_its_poll_has_lost_the_token():
    steps = [*rounds(20, 3, 9), (2, poll(3, 5)), (531, poll(3, 4)), (25, poll(3, 5)), (25, poll(3, 6))]
    assert ("MS101", "MAC 3") in script(steps).graves()


def test_another_one_that_begins_after_a_poll_makes_a_token():
    steps = [*rounds(20, 3, 9), (2, token(3, 9)), (2, poll(9, 12)), (531, poll(3, 4)), (25, poll(3, 5))]
    assert ("MS101", "MAC 9") in script(steps).graves()


def test_slow_polls_are_seen_through_an_adapter_that_bunches_reads():
    """What comes behind a slow poll stands in one read with the next: that is the adapter, whose latency is known."""
    steps: list[Step] = []
    for at in range(20):
        steps += [*rounds(10, 5, 9, use=16), (16, poll(5, 6 + at % 3)), (250, token(5, 9)), (0, token(9, 5))]
    assert ("MS203", "MAC 5") in script(steps, latency=17).graves()


def test_the_answer_of_another_one_is_not_the_own_delay():
    """9 answers when 1 has given up and 4 has the token; 4 waits for it, as it must."""
    steps: list[Step] = []
    for _ in range(12):
        steps += [*rounds(2, 1, 4, 9), (2, data(1, 9, READ, expects=True)), (256, token(1, 4))]
        steps += [(3, data(9, 1, VALUE)), (5, token(4, 9)), (2, token(9, 1))]
    read = script(steps)
    assert read.graves() == {("MS302", "1 → 9")}
    assert read.ring.nodes[4].use.most < 3_000_000
