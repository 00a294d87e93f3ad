"""Another station answers in place of the one that was asked: who asked goes on with that, the other is innocent."""

from __future__ import annotations

import pytest

from dissectors.tracker import Verdict
from tests.dissectors.bacnet.make_ring_captures import READ, VALUE
from tests.dissectors.bacnet.ring_script import Read, Step, data, rounds, script, token


def _question(number: int) -> tuple[str, str]:
    return READ[:8] + f"{number:02x}" + READ[10:], VALUE[:6] + f"{number:02x}" + VALUE[8:]


def _bus(wait: float, *, later: bool) -> list[Step]:
    """3 asks 12, 19 answers at once, 3 goes on after `wait`; `later`: 12 answers with its own token."""
    steps: list[Step] = [*rounds(4, 3, 12, 19)]
    for number in range(6):
        ask, value = _question(number + 1)
        steps += [(2, data(3, 12, ask, expects=True)), (4, data(19, 3, value)), (wait, token(3, 12))]
        steps += [(3, data(12, 3, value))] if later else []
        steps += [(2, token(12, 19)), (2, token(19, 3)), *rounds(2, 3, 12, 19)]
    return steps


def _requests(read: Read) -> list[Verdict]:
    return [one.verdict for one in read.transactions if one.station == 12 and one.kind == "read-property"]


@pytest.mark.parametrize("latency", [0, 17.5])
def test_who_is_answered_for_is_not_at_fault(latency: float) -> None:
    read = script(_bus(2, later=False), latency)
    assert {(one.code, one.subject) for one in read.findings} == {("MS306", "MAC 19")}
    assert _requests(read) == [Verdict.OPEN] * 6


def test_its_own_answer_may_still_come() -> None:
    read = script(_bus(2, later=True))
    assert {(one.code, one.subject) for one in read.findings} == {("MS306", "MAC 19")}
    assert _requests(read) == [Verdict.ANSWERED] * 6


@pytest.mark.parametrize("source", [0, 150])
def test_who_is_heard_of_nowhere_else_may_be_the_one_that_was_asked(source: int) -> None:
    """12 answers with a source address that nobody has; 19 of the other bus has tokens, too."""
    steps = _bus(2, later=False)
    swapped = [
        (silence, data(source, 3, octets[8:-2].hex()) if octets[2] == 6 else octets) for silence, octets in steps
    ]
    words = "nothing else is heard of it: it may be MAC 12 itself"
    assert words in script(swapped).of("MS306").seen
    assert words not in script(steps).of("MS306").seen


def test_who_waits_to_the_end_had_no_answer() -> None:
    read = script(_bus(262, later=False))
    assert ("MS301", "3 → 12") in read.graves()
    assert _requests(read) == [Verdict.NO_RESPONSE] * 6
