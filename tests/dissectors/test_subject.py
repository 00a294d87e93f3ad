"""What findings are about: values whose words can be read back, and what may be seen at what."""

from __future__ import annotations

import pytest

from dissectors.findings import Finding, Rule, Severity, found, under_causes, with_consequences
from dissectors.subject import ADAPTER, BUS, MASTER, About, Subject, as_subject, pair, station

RULES = {
    "XX1": Rule("XX1", Severity.ERROR, "cause", "", explains=("XX2",)),
    "XX2": Rule("XX2", Severity.WARNING, "effect", ""),
}


@pytest.mark.parametrize(
    ("subject", "words"),
    [
        (BUS, "bus"),
        (MASTER, "master"),
        (ADAPTER, "adapter"),
        (station(3), "station 3"),
        (station(27, "MAC"), "MAC 27"),
        (station(1, "drive"), "drive 1"),
        (station(1, part="AI 200"), "station 1, AI 200"),
        (pair(0, 27), "0 → 27"),
        (Subject(About.OTHER, name="all drives"), "all drives"),
    ],
)
def test_words_and_value_are_one(subject: Subject, words: str) -> None:
    assert str(subject) == words
    assert as_subject(words) == subject
    assert found(RULES["XX2"], subject, "seen").about == found(RULES["XX2"], words, "seen").about == subject


@pytest.mark.parametrize("words", ["", "3", "station", "station x", "\n", "→ 5", "station 3\n", "station 999999"])
def test_any_other_words_are_a_name(words: str) -> None:
    assert str(as_subject(words)) == words
    assert as_subject(words).station is None


def test_of_a_pair_the_taker_is_told_on() -> None:
    assert pair(0, 27).station == 27
    assert pair(0, 27).is_of(station(27, "MAC"))
    assert not pair(27, 0).is_of(station(27, "MAC"))


def test_a_station_explains_what_is_said_of_things_in_it_not_the_reverse() -> None:
    inside, whole, other = station(1, part="AI 200"), station(1, "drive"), station(2)
    assert inside.is_of(whole)
    assert not whole.is_of(inside)
    assert not other.is_of(whole)


def _finding(code: str, subject: str, severity: Severity = Severity.WARNING) -> Finding:
    return found(RULES[code], subject, "seen", severity=severity)


def test_consequences_follow_their_cause() -> None:
    made = with_consequences(
        (
            _finding("XX1", "station 1", Severity.ERROR),
            _finding("XX1", "station 2", Severity.ERROR),
            _finding("XX2", "station 2, AI 1"),
            _finding("XX2", "station 1"),
            _finding("XX2", "station 3"),
        ),
        RULES,
    )
    assert [(one.code, one.subject, under) for one, under in under_causes(made)] == [
        ("XX1", "station 1", False),
        ("XX2", "station 1", True),
        ("XX1", "station 2", False),
        ("XX2", "station 2, AI 1", True),
        ("XX2", "station 3", False),
    ]


def test_a_consequence_without_its_cause_stands_for_itself() -> None:
    made = with_consequences((_finding("XX1", "bus", Severity.ERROR), _finding("XX2", "station 1")), RULES)
    assert [under for _, under in under_causes(made[1:])] == [False]
    assert [one.key for one, _ in under_causes(reversed(made))] == [("XX1", "bus"), ("XX2", "station 1")]
