"""Polls one after another with one token: a search is one, after a loss or by one that knows nobody yet (MS201)."""

from __future__ import annotations

from tests.dissectors.bacnet.make_ring_captures import polls_on
from tests.dissectors.bacnet.ring_script import Read, Step, found, poll, rounds, script, token


def _polls(source: int, first: int, last: int) -> list[Step]:
    return [(24, poll(source, to)) for to in range(first, last)]


def _said(read: Read) -> list[str]:
    return [one.seen for one in read.findings if one.code == "MS201" and "with one token" in one.seen]


def test_who_polls_on_though_its_successor_is_there() -> None:
    read = script(polls_on())
    assert read.graves() == {("MS201", "MAC 8")}
    (said,) = _said(read)
    for words in ("twice it polled", "up to 69", "stood still for up to 1.15 s"):
        assert words in said


def test_who_has_lost_its_successor_searches() -> None:
    steps: list[Step] = []
    for _ in range(3):
        steps += [*rounds(6, 8, 25, 80), (2, token(8, 25)), (24, token(8, 25)), *_polls(8, 26, 80), (24, poll(8, 80))]
        steps += [(3, found(80, 8)), (2, token(8, 80)), (2, token(80, 8)), (2, poll(8, 25)), (3, found(25, 8))]
        steps += [(2, token(8, 25)), (2, token(25, 80)), (2, token(80, 8))]
    assert not _said(script([*steps, *rounds(6, 8, 25, 80)]))


def test_who_begins_anew_searches() -> None:
    """It was reset, and knows nobody: it polls until somebody answers."""
    steps: list[Step] = []
    for _ in range(3):
        steps += [*rounds(6, 8, 80), *_polls(8, 9, 81), (3, found(80, 8)), (2, token(8, 80)), (2, token(80, 8))]
    assert not _said(script([*steps, *rounds(6, 8, 80)]))


def test_a_lone_master_searches() -> None:
    assert not _said(script([*rounds(6, 8, 25), *[step for _ in range(3) for step in _polls(8, 9, 128)]]))
