"""Polls of addresses that do not lie between a station and its successor (MS206)."""

from __future__ import annotations

from collections.abc import Iterable

from tests.dissectors.bacnet.ring_script import Step, found, poll, rounds, script, token


def _polling(source: int, after: Iterable[Step], *polled: int) -> list[Step]:
    """Rounds of 5 and 40; with each fifth of its tokens `source` polls one of the addresses."""
    steps: list[Step] = []
    other = 45 - source
    for to in polled:
        steps += [
            *rounds(4, other, source),
            (2, token(other, source)),
            (2, poll(source, to)),
            (25, token(source, other)),
        ]
    return [*steps, *after]


def _said(steps: list[Step]) -> list[tuple[str, str]]:
    return [(one.subject, one.seen.split(",")[0]) for one in script(steps).findings if one.code == "MS206"]


def test_who_looks_below_its_own_address() -> None:
    """Its Max_Master is 12: between 40 and 5 it polls nobody."""
    assert _said(_polling(40, rounds(5, 5, 40), 9, 10, 11, 12)) == [("MAC 40", "polls 9 … 12")]


def test_who_looks_behind_its_successor() -> None:
    assert _said(_polling(5, rounds(5, 40, 5), 41, 42, 43, 50)) == [("MAC 5", "polls 41 … 43")]


def test_who_looks_where_it_must() -> None:
    assert not _said(_polling(40, rounds(5, 5, 40), 41, 42, 127, 0, 1, 4))
    assert not _said(_polling(5, rounds(5, 40, 5), 6, 7, 8, 39))


def test_who_has_lost_somebody_looks_everywhere() -> None:
    lost: list[Step] = [*rounds(3, 5, 20, 40), (2, token(5, 20)), (25, token(5, 20))]
    lost += [(25.0, poll(5, to)) for to in (21, 22, 23, 41, 42, 40)]
    lost += [(3, found(40, 5)), (2, token(5, 40)), (2, token(40, 5))]
    assert not _said([*lost, *rounds(5, 5, 40)])


def test_one_or_two_polls_say_nothing() -> None:
    assert not _said(_polling(40, rounds(5, 5, 40), 9, 10))
