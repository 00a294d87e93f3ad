"""Late speakers: damage that stands while an answer is overdue is told of who is late, noise everywhere of nobody."""

from __future__ import annotations

import random
from collections import Counter

import pytest

from dissectors.findings import Tally
from dissectors.late_speakers import MASTER, Due, Heard, LateSpeaker, LateSpeakers, Window, is_behind, late_speakers

MS = 1_000_000
WAIT = 200 * MS


def _heard(rate_then: float, rate_elsewhere: float, *, answers: int = 5, octets: bytes = b"") -> list[LateSpeaker]:
    """A master that waits for station 9 in vain, then asks stations 1 to 4 five times each; how often it is damaged."""
    late, dice, now = LateSpeakers(), random.Random(7), 0
    whole = dict.fromkeys(("station 1", "station 2", "station 3", "station 4", MASTER), 0)
    for _ in range(60):
        late.unanswered(9, Due(b"\x09"), now, now + 8 * MS, WAIT)
        whole[MASTER] += 1
        now += WAIT
        for turn in range(20):
            station = 1 + turn % 4
            is_struck = dice.random() < (rate_then if not turn else rate_elsewhere)
            if is_struck:
                late.damaged_answer(station, f"station {station}", octets, now, 1, 2, is_longer=False)
            else:
                late.answered(station, f"station {station}", now)
                whole[f"station {station}"] += 1
            whole[MASTER] += 1
            now += 60 * MS
    return list(late_speakers(late, whole, {9: Heard(answers, 0, 60)}))


@pytest.mark.parametrize("then", [0.5, 1.0])
def test_damage_that_stands_only_while_an_answer_is_overdue_is_the_late_ones(then: float) -> None:
    (found,) = _heard(then, 0.0)
    assert (found.station, found.hit, found.is_sure) == (9, {"station 1"}, True)


@pytest.mark.parametrize("rate", [0.02, 0.2, 0.6])
def test_damage_that_stands_anywhere_is_nobodys_late_answer(rate: float) -> None:
    assert not _heard(rate, rate)


def test_who_never_answers_is_believed_to_speak_only_where_its_address_shows_it() -> None:
    late = LateSpeakers()
    for turn in range(20):  # whoever is struck is never heard elsewhere
        late.unanswered(9, Due(b"\x09"), turn * 300 * MS, turn * 300 * MS + MS, WAIT)
        late.damaged_answer(1, "station 1", b"\x01\x03", turn * 300 * MS + WAIT, 1, is_longer=False)
    whole = {MASTER: 40}
    assert not list(late_speakers(late, whole, {9: Heard(0, 0, 20)}))
    (maybe,) = late_speakers(late, whole, {9: Heard(3, 0, 20)})
    assert not maybe.is_sure
    for turn in range(20, 60):
        late.unanswered(9, Due(b"\x09"), turn * 300 * MS, turn * 300 * MS + MS, WAIT)
        late.damaged_answer(1, "station 1", b"\x09\x03", turn * 300 * MS + WAIT, 1, is_longer=False)
    (sure,) = late_speakers(late, whole, {9: Heard(0, 0, 60)})
    assert sure.is_sure


@pytest.mark.parametrize(("damaged", "elsewhere", "is_told"), [(9, 0, True), (2, 0, False), (9, 3, False)])
def test_requests_damaged_directly_behind_one_stations_silence(damaged: int, elsewhere: int, is_told: bool) -> None:
    late, now = LateSpeakers(), 0
    for turn in range(200):
        now += 100 * MS
        late.answered(1, "station 1", now)
        if turn % 10 == 0 and turn // 10 < damaged:
            late.unanswered(9, Due(b"\x09"), now, now + 8 * MS, WAIT)
            late.damaged_request(b"", now + WAIT, turn)
        elif turn < elsewhere * 10 and turn % 10 == 5:
            late.damaged_request(b"", now, turn)
    assert is_behind(late.windows[9].behind.count, late.damaged[MASTER], damaged, 200 + 2 * damaged) is is_told


def test_of_many_waits_the_newest_go_on() -> None:
    late = LateSpeakers()
    for at, station in enumerate((1, 2, 3, 4, 5, 6, 7, 8, 1, 9)):
        late.unanswered(station, Due(bytes([station]), bytes([station, 3])), at, at, None)
    shown = [station for station in range(1, 10) if late.shows(bytes([station, 3, 2]), 10)]
    assert shown == [1, 3, 4, 5, 6, 7, 8, 9]


@pytest.mark.parametrize(("waited_for", "is_told"), [(1, True), (6, True), (7, False), (20, False)])
def test_of_many_that_are_waited_for_one_has_the_most_damage_in_its_windows(waited_for: int, is_told: bool) -> None:
    """6 of 115 answers then, 1 of 337 elsewhere: 15 in 10 000 by chance."""
    late, name = LateSpeakers(), "station 1"
    late.windows = {100 + at: Window() for at in range(1, waited_for)}
    whole = Counter({name: 109, MASTER: 115})
    late.windows[9] = Window(60, 6, damage=Tally(6, 0, 9, [7]), struck=Counter({name: 6}), whole=whole)
    late.damaged = Counter({name: 7})
    told = list(late_speakers(late, {name: 445}, {9: Heard(5, 0, 60)}))
    assert bool(told) is is_told


def test_noise_into_a_wait_is_nobodys_late_answer() -> None:
    """In each of three bursts of noise the answer of station 9 is lost, and what comes behind it is damaged: all that
    ever is, but for what began the burst."""
    late, now = LateSpeakers(), 0
    for _ in range(3):
        now += 3600 * 1000 * MS
        late.damaged_answer(2, "station 2", b"", now, 1, is_longer=False)
        late.unanswered(9, Due(), now + 60 * MS, now + 68 * MS, WAIT)
        for turn in range(3):
            late.damaged_answer(1, "station 1", b"", now + WAIT + (100 + 60 * turn) * MS, 1, is_longer=False)
    whole = {"station 1": 30_000, "station 2": 30_000, MASTER: 60_000}
    assert late.windows[9].damage.count == 9
    assert not list(late_speakers(late, whole, {9: Heard(30_000, 0, 3)}))


def test_one_wait_has_one_late_answer() -> None:
    late = LateSpeakers()
    late.unanswered(9, Due(), 0, 8 * MS, WAIT)
    for turn in range(6):
        late.damaged_answer(1, "station 1", b"", WAIT + 60 * turn * MS, 1, is_longer=False)
    whole = {"station 1": 30_000, MASTER: 60_000}
    assert not list(late_speakers(late, whole, {9: Heard(30_000, 0, 1)}))
