"""Frames that the tap did not hear are its loss: nobody on the bus is accused; two tokens are still found."""

from __future__ import annotations

from random import Random

import pytest

from dissectors.bacnet.application import read_property
from dissectors.bacnet.envelope import frame, npdu_frame
from dissectors.bacnet.ring_events import RingEventKind
from dissectors.findings import Severity
from tests.dissectors.bacnet.ring_script import Read, Step, data, found, poll, rounds, script, token

ASK = read_property(1, "analog-input,4", "present-value")
ANSWER = bytes.fromhex("010030010c0c000000041955" + "3e44420000003f")


def ask(client: int, server: int) -> bytes:
    return npdu_frame(server, client, ASK, expects_reply=True)


def answer(server: int, client: int) -> bytes:
    return npdu_frame(client, server, ANSWER, expects_reply=False)


def bus(turns: int) -> list[Step]:
    """2, 5, 9 and 20 pass the token; 2 reads 9 each third time, 9 polls now and then."""
    steps: list[Step] = []
    for turn in range(turns):
        if turn % 3 == 0:
            steps += [(2, ask(2, 9)), (20, answer(9, 2))]
        steps += [(2, token(2, 5)), (2, token(5, 9))]
        if turn % 25 == 0:
            steps += [(2, poll(9, 10 + turn % 10))]
        steps += [(25 if turn % 25 == 0 else 2, token(9, 20)), (2, token(20, 2))]
    return steps


def without(steps: list[Step], lost: set[int]) -> list[Step]:
    """The same without some frames; the others keep their times."""
    kept: list[Step] = []
    silence = 0.0
    for no, (gap, octets) in enumerate(steps):
        silence += gap
        if no in lost:
            silence += len(octets) / 3.84
        else:
            kept.append((silence, octets))
            silence = 0.0
    return kept


def of(steps: list[Step], *macs: int) -> set[int]:
    return {no for no, (_, octets) in enumerate(steps) if octets[4] in macs}


def unheard(read: Read) -> dict[int | None, int]:
    return {mac: one.count for (what, mac), one in read.ring.happened.items() if what is RingEventKind.UNHEARD}


@pytest.mark.parametrize("mac", [5, 9, 20])
@pytest.mark.parametrize("latency", [0, 17.5])
def test_tokens_that_were_not_heard_accuse_nobody(mac: int, latency: float):
    steps = bus(60)
    lost = {no for no, (_, octets) in enumerate(steps) if octets[2] == 0 and octets[4] == mac and no % 5 == 0}
    read = script(without(steps, lost), latency)
    assert unheard(read) == {mac: len(lost)}
    assert {(one.code, one.subject) for one in read.findings} == {("MS406", "bus")}


@pytest.mark.parametrize("rate", [0.004, 0.03, 0.15])
def test_frames_lost_anywhere_accuse_nobody(rate: float):
    steps, dice = bus(300), Random(int(rate * 1000))
    lost = {no for no in range(len(steps)) if dice.random() < rate}
    read = script(without(steps, lost))
    assert {code for code, _ in read.graves()} <= {"MS406"}
    assert read.of("MS406").severity is (Severity.NOTE if rate < 0.01 else Severity.WARNING)


@pytest.mark.parametrize("macs", [(2,), (5,), (9,), (20,), (2, 9), (2, 20), (5, 20)])
def test_a_station_that_is_never_heard_accuses_nobody(macs: tuple[int, ...]):
    steps = bus(60)
    read = script(without(steps, of(steps, *macs)))
    subject = f"MAC {macs[0]}" if len(macs) == 1 else "bus"
    assert read.graves() == {("MS406", subject)}
    assert any("is heard, though others" in one.seen for one in read.findings)


def test_the_search_of_a_station_that_is_never_heard_loses_no_token():
    """9 joins and polls up to 0 for its successor: nearly a second in which nothing is heard."""
    joins: list[Step] = [(2, token(2, 5)), (2, poll(5, 9)), (2, found(9, 5)), (2, token(5, 9))]
    joins += [(25, poll(9, 10 + no)) for no in range(30)]
    steps = [*rounds(5, 2, 5), *joins, (25, poll(9, 2)), (2, found(2, 9)), (2, token(9, 2)), *rounds(30, 2, 5, 9)]
    assert script(without(steps, of(steps, 9))).graves() == {("MS406", "MAC 9")}


@pytest.mark.parametrize(("pause", "graves"), [(12, {("MS406", "MAC 40")}), (260, {("MS301", "2 → 40")})])
def test_who_goes_on_at_once_has_its_answer(pause: float, graves: set[tuple[str, str]]):
    """One that gets none waits for 255 ms."""
    steps = rounds(3, 2, 5)
    for _ in range(5):
        steps += [(2, ask(2, 40)), (pause, token(2, 5)), (2, token(5, 2))]
    assert script(steps).graves() == graves


def test_a_token_that_comes_back_unheard_is_not_given_up():
    """2 polls a few ms after its token: it would have repeated that before. 5 has used it."""
    steps = rounds(10, 2, 5)
    for _ in range(4):
        steps += [(2, token(2, 5)), (6, poll(2, 3)), (25, token(2, 5)), (2, token(5, 2)), *rounds(4, 2, 5)]
    read = script(steps)
    assert read.graves() == {("MS406", "bus")}
    assert unheard(read) == {5: 4}


def test_two_that_talk_in_turns_have_two_tokens():
    """There was time for 5 to pass its token to 9 unheard; but then it goes on talking, as 9 does."""
    steps = rounds(10, 2, 5, 9)
    for _ in range(3):
        steps += [(2, token(2, 5)), (2, data(5, 255)), (5, data(9, 255)), (2, data(5, 255)), (2, token(5, 9))]
        steps += [(2, token(9, 2)), *rounds(3, 2, 5, 9)]
    read = script(steps)
    assert read.graves() == {("MS104", "bus")}
    assert read.of("MS104").seen.startswith("MAC 9 sent 3 times")
    assert unheard(read) == {}


@pytest.mark.parametrize("use", [2, 14])
def test_the_only_other_station_is_never_heard(use: float):
    """2 seems to repeat its token without end, and looks for nobody else: 5 takes it and gives it back."""
    steps = rounds(60, 2, 5, use=use)
    assert script(without(steps, of(steps, 5))).graves() <= {("MS406", "MAC 5")}


def test_proprietary_frames_that_are_answered_are_no_second_token():
    steps: list[Step] = []
    for _ in range(6):
        steps += [*rounds(2, 2, 5, 9), (2, frame(130, 5, 2, b"\x00\x05abc")), (6, frame(131, 2, 5, b"\x00\x05defg"))]
    assert script(steps).findings == ()


@pytest.mark.parametrize("latency", [0, 16])
def test_who_does_not_wait_for_answers_that_are_heard_behind_its_wait(latency: float):
    steps = rounds(3, 2, 5)
    for _ in range(3):
        steps += [(2, ask(2, 9)), (60, token(2, 5)), (9, answer(9, 2)), (9, token(5, 2))]
    assert script(steps, latency).graves() == {("MS307", "MAC 2")}


@pytest.mark.parametrize(("takes", "graves"), [(100, {("MS307", "MAC 2")}), (20, {("MS406", "bus")})])
def test_who_goes_on_sooner_than_anybody_is_answered_does_not_wait(takes: float, graves: set[tuple[str, str]]):
    steps = rounds(3, 2, 5)
    for _ in range(5):
        steps += [(2, ask(2, 9)), (60, token(2, 5)), (2, ask(5, 9)), (takes, answer(9, 5)), (2, token(5, 2))]
    assert script(steps).graves() == graves


def test_a_late_answer_to_another_says_nothing_of_the_question_that_it_runs_into():
    steps = rounds(3, 2, 5)
    for _ in range(3):
        steps += [(2, ask(2, 9)), (60, token(2, 5)), (2, ask(5, 7)), (9, answer(9, 2)), (9, token(5, 2))]
    assert script(steps).graves() == {("MS307", "MAC 2")}
