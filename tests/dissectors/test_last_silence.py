"""A station that used to answer and does not any more, up to the end."""

from __future__ import annotations

from dissectors.findings import Rule, Severity, found
from dissectors.last_silence import LastSilence, fallen_silent

S = 1_000_000_000
RULE = Rule("XX001", Severity.WARNING, "no answer", "", "a loose wire", "the wire")


def silent(count: int, turns: int) -> LastSilence:
    silence = LastSilence()
    for at in range(count):
        silence.miss(at * S, at + 1, is_repeat=at >= turns)
    return silence


def test_five_in_a_row_of_two_turns_are_a_station_that_is_gone() -> None:
    finding = found(RULE, "station 2", "no answer to 9 of 90 requests", count=9)
    told = fallen_silent(finding, silent(5, 2), 12 * S)
    assert told.severity is Severity.ERROR
    assert told.seen == "no answer to 9 of 90 requests; none to the last 5, from 12.0 s before the end on"
    assert (told.count, told.evidence) == (9, (1, 2, 3, 4, 5))
    assert "wire" not in told.means


def test_fewer_or_repeats_alone_are_not() -> None:
    finding = found(RULE, "station 2", "")
    assert fallen_silent(finding, silent(4, 4), 0) is fallen_silent(finding, silent(30, 1), 0) is finding


def test_a_sign_of_life_ends_it() -> None:
    silence = silent(9, 9)
    silence.heard()
    assert not silence.is_lasting
    assert silence.missed.count == 0
