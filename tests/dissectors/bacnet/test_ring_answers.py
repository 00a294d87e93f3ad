"""Answers to what asks by its frame type alone, and to what was not understood here: who has the token behind them."""

from __future__ import annotations

import pytest

from dissectors.bacnet.envelope import frame
from dissectors.bacnet.ring_events import RingEventKind
from dissectors.findings import Severity
from tests.dissectors.bacnet.make_ring_captures import (
    VALUE,
    last_two_octets_missing,
    questions_not_understood,
    segments_that_ask,
)
from tests.dissectors.bacnet.ring_script import Step, data, rounds, script, spoil, token

READ = "01040003010c0c020004d2194d"


def test_a_segment_may_be_acknowledged_at_once():
    """Segments of an answer ask for it by their frame type; who acknowledges has no second token."""
    read = script(segments_that_ask())
    assert not [one for one in read.findings if one.severity >= Severity.NOTE]
    assert read.ring.nodes[12].requests_received == 0
    assert not any(what is RingEventKind.UNHEARD for what, _ in read.ring.happened)


@pytest.mark.parametrize("postponed", [True, False])
def test_a_segment_that_is_not_acknowledged_at_once_is_nobodys_fault(postponed: bool):
    steps: list[Step] = []
    for _ in range(8):
        steps += [
            *rounds(3, 12, 31),
            (2, token(12, 31)),
            (2, data(31, 12, "01043c0100010c0c02000005194c3e", expects=True)),
        ]
        steps += [(4, frame(7, 31, 12))] if postponed else []
        steps += [(2 if postponed else 260, token(31, 12)), (2, data(12, 31, "010040010001"))]
    read = script([*steps, *rounds(3, 12, 31)])
    assert not read.findings
    assert read.ring.nodes[12].postponed == 0


def test_an_unconfirmed_frame_that_asks_leaves_the_token_where_it_is():
    steps = [
        *rounds(6, 1, 3),
        (2, data(1, 3, "01041008", expects=True)),
        (8, data(3, 1)),
        (2, token(1, 3)),
        (2, token(3, 1)),
    ]
    read = script(steps * 3)
    assert not read.graves()
    assert not any(what is RingEventKind.NO_REPLY for what, _ in read.ring.happened)


def test_who_answers_what_was_not_understood_here_has_no_token():
    """The one that asked goes on; neither it nor the one that answered has a second token, or a late one."""
    read = script(questions_not_understood())
    assert {one.code for one in read.findings if one.severity >= Severity.WARNING} <= {"MS402"}
    happened = {what for what, _ in read.ring.happened}
    assert not happened & {RingEventKind.TWO_TOKENS, RingEventKind.GIVEN_UP, RingEventKind.LATE_USE}


def test_a_proprietary_answer_to_what_was_not_understood_here():
    asked, answer = frame(130, 3, 1, b"\0\5ask"), frame(131, 1, 3, b"\0\5yes")
    steps = [
        *rounds(6, 1, 3, 8),
        (2, spoil(asked, 6)),
        (8, answer),
        (2, token(1, 3)),
        (2, token(3, 8)),
        (2, token(8, 1)),
    ]
    assert script(steps * 4).graves() <= {("MS402", "MAC 1")}


def test_a_second_token_is_still_seen_behind_damage():
    steps: list[Step] = []
    for _ in range(4):
        steps += [*rounds(4, 1, 3, 8), (2, spoil(token(1, 3), 5)), (2, token(3, 8)), (2, token(8, 1))]
        steps += [*rounds(2, 1, 3, 8), (2, token(1, 3)), (1, token(8, 1)), (2, token(3, 8)), (2, token(8, 1))]
    assert "MS104" in {one.code for one in script(steps).findings}


def test_a_damaged_frame_is_the_use_of_the_token():
    """The time to what comes behind it is not what the station took."""
    steps: list[Step] = []
    for _ in range(30):
        steps += [(2, token(3, 1)), (2, data(1, 3, READ, expects=True)[:-1]), (22, data(3, 1, VALUE)), (2, token(1, 3))]
    read = script([*rounds(10, 1, 3), *steps])
    assert read.graves() == {("MS405", "MAC 1")}
    assert read.ring.nodes[1].use.most < 3_000_000


@pytest.mark.parametrize("lost", [1, 2])
def test_the_last_octet_or_two_of_answers_to_polls(lost: int):
    steps = [
        (gap, octets if len(octets) > 6 else octets + b"\0" * (2 - lost)) for gap, octets in last_two_octets_missing()
    ]
    read = script(steps)
    assert read.graves() == {("MS405", "MAC 31")}
    assert "5 of its 5 frames" in read.of("MS405").seen


def test_frames_cut_anywhere_are_not_an_early_driver():
    steps: list[Step] = []
    for lost in (2, 5, 9, 3, 12, 4, 7):
        steps += [*rounds(4, 12, 31), (2, data(12, 31, READ, expects=True)), (18, data(31, 12, VALUE)[:-lost])]
    assert {code for code, _ in script(steps + rounds(4, 12, 31)).graves()} == {"MS402"}
