"""Octets that are no good frame may have been a token, or a question: who sends after them has no second token."""

from __future__ import annotations

import pytest

from tests.dissectors.bacnet.ring_script import Step, data, rounds, script, spoil, token

ASK = "010400050e0c0c008000011955"
ANSWER = "010030050e0c00800001195500"
ACK = "010040050e0200"  # of a segment


def question(source: int, destination: int) -> bytes:
    return data(source, destination, ASK, expects=True)


def answer(source: int, destination: int) -> bytes:
    return data(source, destination, ANSWER)


def unread(octets: bytes) -> bytes:
    """The same without the begin by which a frame is known."""
    return spoil(spoil(octets, 0), 1)


def passed(use: float = 2) -> list[Step]:
    return [(use, token(9, 1)), (use, token(1, 5)), (use, token(5, 9)), (use, token(9, 1))]


BEHIND = {
    "the token and a question, and who had the token answers": [
        *[(2, token(1, 5)), (2, unread(token(5, 9))), (2, unread(question(9, 5))), (9, answer(5, 9))],
        *passed(),
    ],
    "the token, and the question's data": [
        *[(2, token(1, 5)), (2, unread(token(5, 9))), (2, spoil(question(9, 5), -4)), (9, answer(5, 9))],
        *passed(),
    ],
    "a token, and a segment that is acknowledged": [
        *[(2, token(1, 5)), (2, unread(token(5, 9))), (2, unread(question(9, 5)))],
        *[(9, spoil(data(5, 9, ANSWER, expects=True), -4)), (4, data(9, 5, ACK))],
        *passed(),
    ],
    "a question that is answered when its asker has given up": [
        *[(2, token(1, 5)), (2, unread(question(5, 1))), (270, token(5, 9)), (2, question(9, 5)), (4, answer(1, 5))],
        *[(9, answer(5, 9)), *passed()],
    ],
    "a question with wrong data that is answered when its asker has given up": [
        *[(2, token(1, 5)), (2, spoil(question(5, 1), -4)), (270, token(5, 9)), (4, answer(1, 5))],
        *passed(),
    ],
}


@pytest.mark.parametrize("steps", BEHIND.values(), ids=BEHIND)
def test_nobody_has_a_second_token_behind_damage(steps: list[Step]) -> None:
    calm = rounds(30, 1, 5, 9)
    read = script([*calm, *steps, *calm, *steps, *calm])
    assert "MS104" not in {one.code for one in read.findings}


def test_a_token_with_data_is_octets_that_look_like_one() -> None:
    calm = rounds(30, 1, 5, 9)
    odd = bytes.fromhex("55ff001209400177")  # its length is longer than any frame
    read = script([*calm, (2, odd), *calm, (2, odd), *calm])
    assert read.ring.nodes[9].tokens_sent == sum(octets == token(9, 1) for _, octets in (*calm, *calm, *calm))


def test_a_second_token_is_one_all_the_same() -> None:
    calm = rounds(30, 1, 5, 9)
    second: list[Step] = [(2, token(1, 5)), (2, unread(question(5, 9))), (9, answer(9, 5)), (2, token(5, 9))]
    second += [(2, question(9, 1)), (9, answer(1, 9)), (2, question(5, 1)), (9, answer(1, 5)), (2, token(9, 1))]
    read = script([*calm, *second, *calm, *second, *calm])
    assert read.of("MS104").count >= 2
