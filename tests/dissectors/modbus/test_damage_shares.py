"""Who is to blame for damage: of many senders one is always struck most, by what falls anywhere."""

from __future__ import annotations

from random import Random

import pytest

from dissectors.modbus.damage_shares import to_blame


def blamed(*hits: int, of: int, octets: int = 1_000_000, silent: int = 0) -> set[int]:
    """Of `of` senders of so many octets each, the first ones struck so often; beside them some that are not there."""
    struck = {f"station {at}": hits[at] if at < len(hits) else 0 for at in range(of + silent)}
    sent = {name: octets if at < of else 1 for at, name in enumerate(struck)}
    return {int(name.split()[1]) for name in to_blame(struck, sent)}


@pytest.mark.parametrize(
    ("hits", "of", "who"),
    [
        ((), 10, set()),
        ((2,), 10, set()),  # any of ten might have been struck twice
        ((2,), 21, {0}),
        ((3,), 5, {0}),
        ((3,), 4, set()),
        ((5,), 2, set()),
        ((6,), 2, {0}),
        ((4, 1), 10, {0}),
        ((3, 1), 10, set()),
        ((20, 5), 10, {0, 1}),
        ((20, 2), 10, {0}),
        ((20, 20), 2, set()),
    ],
)
def test_who_is_struck_more_often_than_by_chance(hits: tuple[int, ...], of: int, who: set[int]) -> None:
    assert blamed(*hits, of=of) == who
    assert blamed(*hits, of=of, silent=200) == who  # those that sent nothing could not be struck


@pytest.mark.parametrize(("strikes", "of"), [(2, 10), (3, 10), (8, 10), (3, 30), (20, 30), (5, 3)])
def test_noise_seldom_seems_one_senders(strikes: int, of: int) -> None:
    dice, wrong = Random(485), 0
    for _ in range(400):
        struck = [0] * of
        for _ in range(strikes):
            struck[dice.randrange(of)] += 1
        wrong += bool(blamed(*struck, of=of))
    assert wrong <= 400 * 0.05
