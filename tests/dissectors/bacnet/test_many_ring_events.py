"""What is said of many events: of all of them, and not of the first that are kept one by one."""

from __future__ import annotations

from dissectors.bacnet import ring_table
from dissectors.bacnet.envelope import frame
from dissectors.bacnet.ring import Ring, RingNode
from dissectors.bacnet.ring_events import EVENTS_MAX, RingEventKind
from tests.dissectors.bacnet.ring_script import Read, Step, data, rounds, script, token

READ = "010400030 10c0c020004d2194d".replace(" ", "")
VALUE = "01003 0010c0c020004d2194d3e75030041313f".replace(" ", "")


def answers(*waits: float) -> Read:
    steps: list[Step] = []
    for wait in waits:
        steps += [*rounds(2, 1, 5), (2, data(1, 5, READ, expects=True)), (wait, data(5, 1, VALUE))]
    return script([*steps, *rounds(2, 1, 5)])


def test_the_longest_of_many_late_answers_is_told():
    assert "answered late 40 times, up to 290 ms" in answers(*[260.0] * 39, 290.0).of("MS302").seen


def test_all_who_had_a_second_token_are_named():
    steps: list[Step] = []
    for _ in range(EVENTS_MAX + 8):
        for stray in (9, 20):
            steps += [*rounds(2, 1, 5, 9, 20), (2, token(1, 5)), (2, token(stray, 1)), (2, token(5, 9))]
            steps += [(2, token(9, 20)), (2, token(20, 1))]
    assert "MAC 9, 20 sent" in script(steps).of("MS104").seen


def storm(broadcasts: int) -> list[Step]:
    steps: list[Step] = []
    for _ in range(broadcasts // 2):
        steps += [(2, data(1, 255)), (2, data(1, 255)), *rounds(1, 1, 5)]
    return steps


def test_searches_for_all_devices_an_hour_apart_are_no_storm():
    pause = [(2_000.0, step) for _, step in rounds(6, 1, 5)]
    read = script([*rounds(2, 1, 5), *storm(200), *pause, *storm(200), *rounds(2, 1, 5)])
    assert read.ring.of(RingEventKind.STORM, 1).count > 100
    assert "MS602" not in {one.code for one in read.findings}


def test_an_answer_that_was_postponed_is_not_what_comes_minutes_later():
    steps: list[Step] = rounds(2, 1, 5)
    for _ in range(5):
        steps += [(2, data(1, 5, READ, expects=True)), (3, frame(7, 1, 5)), (2, token(1, 5))]
        steps += [(5, data(5, 1, VALUE)), (2, token(5, 1))]
    steps += [(2, data(1, 5, READ, expects=True)), (3, frame(7, 1, 5)), *rounds(2, 1, 5)]
    steps += [(450.0, step) for _, step in rounds(15, 1, 5)]
    read = script([*steps, (2, token(1, 5)), (5, data(5, 1, VALUE)), (2, token(5, 1))])
    node = read.ring.nodes[5]
    assert (node.postponed, node.service.count) == (6, 5)
    assert "up to 14.2 ms" in read.of("MS303").seen


def test_a_station_that_one_part_did_not_hear_is_heard():
    part, other = RingNode(first=0), RingNode(first=7)
    assert (part.merge(other).first, other.merge(part).first, part.merge(part).first) == (7, 7, 0)


def test_a_table_of_one_frame():
    assert ring_table.sentences(Ring(first=0, last=1_000_000_000, frames=1))[1].startswith("1 frame in 1.00 s")
