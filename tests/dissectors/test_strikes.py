"""How often each sender was struck: what is repeated into one disturbance is once."""

from __future__ import annotations

import pytest

from dissectors.strikes import Strikes


@pytest.mark.parametrize(
    ("heard", "first", "second"),
    [
        ("a", 1, 0),
        ("aaaa", 1, 0),  # a request and three repeats
        ("aaaaa", 2, 0),
        ("aaaaaaaa", 2, 0),
        ("aaaaaaaaa", 3, 0),
        ("a.a", 2, 0),  # somebody was heard well in between
        ("abab", 2, 2),
        ("aabb", 1, 1),
        ("aaaab.aaaa", 2, 1),
    ],
)
def test_strikes(heard: str, first: int, second: int) -> None:
    strikes = Strikes()
    for sender in heard:
        if sender == ".":
            strikes.whole()
        else:
            strikes.struck(sender)
    assert (strikes.of("a", 99), strikes.of("b", 99), strikes.of("c", 99)) == (first, second, 0)
    assert strikes.of("a", 1) == 1  # of more than were damaged none is told
