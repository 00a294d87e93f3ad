"""What takes the time of a bus that is slow: data, waits for answers, or waits in vain (MS603)."""

from __future__ import annotations

from tests.dissectors.bacnet.make_ring_captures import READ, VALUE
from tests.dissectors.bacnet.ring_script import Read, Step, data, found, poll, rounds, script, token

ASK, SAID = data(4, 9, READ, expects=True), data(9, 4, VALUE)


def _limits(read: Read) -> list[str]:
    assert read.ring.span > 10**10
    return [one.seen for one in read.findings if one.code == "MS603"]


def test_waits_for_a_dead_station_are_no_data() -> None:
    steps: list[Step] = []
    for _ in range(45):
        steps += [*rounds(1, 4, 9), (2, data(4, 200, READ, expects=True)), (257, token(4, 9)), (2, token(9, 4))]
    read = script(steps)
    assert ("MS301", "4 → 200") in read.graves()
    assert not _limits(read)


def test_silence_is_no_data() -> None:
    steps: list[Step] = []
    for _ in range(22):
        steps += [(2, token(4, 9)), (515, poll(4, 9)), (3, found(9, 4)), *rounds(1, 4, 9)]
    assert not _limits(script(steps))


def test_waits_for_slow_answers_are_said() -> None:
    steps: list[Step] = [step for _ in range(50) for step in ((2, ASK), (215, SAID), *rounds(1, 4, 9))]
    (said,) = _limits(script(steps))
    assert "% the wait for answers (longest for MAC 9, median 215 ms)" in said


def test_many_frames_are_data() -> None:
    many: list[Step] = [step for _ in range(8) for step in ((2.0, ASK), (3.0, SAID))]
    (said,) = _limits(script([*many, *rounds(1, 4, 9)] * 80))
    assert "wait for answers" not in said
