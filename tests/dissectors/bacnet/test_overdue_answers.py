"""Who answers when its asker has given up, and whom that hits: the late one is named, and nobody else."""

from __future__ import annotations

import pytest

from tests.dissectors.bacnet.ring_script import Step, data, found, poll, rounds, script, spoil, token

READ, VALUE = "0104000301 0c0c020004d2194d".replace(" ", ""), "01003001 0c0c020004d2194d3e75030041313f".replace(" ", "")


def asked(by: int = 1) -> Step:
    return (2, data(by, 5, READ, expects=True))


def late_into(frame: bytes) -> list[Step]:
    """5 answers into a frame that 1 sends when it has given up; the token is passed again."""
    return [asked(), (270, spoil(frame, 5)), (30, frame)]


def late() -> list[Step]:
    """5 answers when 2 has the token, into nothing."""
    return [asked(), (270, token(1, 2)), (15, data(5, 1, VALUE)), (2, token(2, 5)), (2, token(5, 1))]


@pytest.mark.parametrize("heard", [0, 1])
def test_damage_behind_requests_to_one_station_is_its_doing(heard: int):
    steps = rounds(20, 1, 2, 5)
    for _ in range(6):
        steps += [*late_into(token(1, 2)), (2, token(2, 5)), (2, token(5, 1)), *rounds(150, 1, 2, 5, use=9)]
    assert script(steps + heard * late() + rounds(20, 1, 2, 5)).graves() == {("MS308", "MAC 5")}


def test_damage_anywhere_is_not_put_down_to_a_late_answer():
    steps = [*rounds(20, 1, 2, 5), *late(), *rounds(20, 1, 2, 5)]
    for _ in range(6):
        steps += [(2, spoil(token(1, 2), 5)), (30, token(1, 2)), (2, token(2, 5)), (2, token(5, 1))]
        steps += rounds(20, 1, 2, 5)
    assert "MS308" not in {code for code, _ in script(steps).graves()}


def test_who_hears_a_late_answer_and_lets_go_of_its_token_has_not_lost_it():
    steps = rounds(20, 1, 2, 5)
    for _ in range(3):
        steps += [asked(), (270, token(1, 2)), (2, poll(2, 3)), (10, data(5, 1, VALUE))]
        steps += [(510, poll(1, 2)), (2, found(2, 1)), (2, token(1, 2)), (2, token(2, 5)), (2, token(5, 1))]
        steps += rounds(150, 1, 2, 5, use=9)
    assert script(steps).graves() == {("MS308", "MAC 5")}


def test_a_search_that_was_hidden_by_a_late_answer_shuts_nobody_out():
    """1 passes to 5 from now on: it looked for its successor while nothing could be read."""
    steps = [*rounds(20, 1, 2, 5), asked(), (270, spoil(token(1, 2), 5)), (0, bytes(range(60, 200)))]
    steps += [(30, token(1, 5)), (2, token(5, 1)), *rounds(60, 1, 5)]
    assert "MS110" not in {code for code, _ in script(steps).graves()}


def test_who_is_never_heard_speaks_into_nothing():
    """2 is damaged after tokens that nobody took: that 60 is asked in vain before them says nothing."""
    steps = rounds(20, 1, 2, 5)
    for _ in range(7):
        steps += [(2, data(1, 60, READ, expects=True)), (270, spoil(token(1, 2), 5)), (30, token(1, 2))]
        steps += [(2, token(2, 5)), (2, token(5, 1)), *rounds(150, 1, 2, 5, use=9)]
    assert "MS308" not in {code for code, _ in script(steps).graves()}
