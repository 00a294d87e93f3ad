"""Slaves that take their parameters and never exchange data, and those of which only rubbish is heard."""

from __future__ import annotations

import pytest

from dissectors.findings import Severity
from dissectors.profibus.telegram import SC, telegram
from tests.dissectors.profibus.test_slaves import Telegrams, diagnosis, exchanges, found, judged, parameters

RUBBISH = (1, b"\x40\x02\x02\x40\x00\x30")
CONFIGURED: Telegrams = [(1, telegram(5, 1, 0x7D, b"\x7f", 62, 62)), (1, bytes((SC,)))]
REFUSED: Telegrams = [(1, telegram(5, 1, 0x7D, b"\0")), (1, telegram(1, 5, 0x03))]
GIVEN: Telegrams = [*diagnosis(), *parameters(), *CONFIGURED]
UNREADY = diagnosis(owner=1, first=0x02, second=0x0C)
STATIC = diagnosis(owner=1, first=0x00, second=0x0E)
READY = diagnosis(owner=1, first=0x00, second=0x0C)


@pytest.mark.parametrize(
    "start", [[*GIVEN, *UNREADY], [*GIVEN, *READY, *REFUSED], [*GIVEN, *READY, (1, telegram(5, 1, 0x7D, b"\0"))]]
)
def test_starts_that_come_to_nothing_are_told(start: Telegrams) -> None:
    told = found(judged(list(start) * 4), "PB022")
    assert told is not None
    assert (told.subject, told.severity, told.count) == ("station 5", Severity.ERROR, 3)


@pytest.mark.parametrize(("octets", "words"), [(5, "has 5 octets, 32 are configured"), (32, "first answer with data;")])
def test_whose_first_answer_is_not_taken_is_told(octets: int, words: str) -> None:
    once = [(1, telegram(5, 1, 0x7D, b"\0")), (1, telegram(1, 5, 0x08, bytes(octets)))]
    told = found(judged([*GIVEN, *READY, *once] * 4), "PB022")
    assert told is not None
    assert words in told.seen


@pytest.mark.parametrize(("says", "turns", "is_told"), [(UNREADY, 120, True), (STATIC, 120, True), (READY, 120, False)])
def test_who_is_not_ready_for_long_is_told(says: Telegrams, turns: int, is_told: bool) -> None:
    told = found(judged([*GIVEN, *[(silence * 50, octets) for silence, octets in says] * turns]), "PB022")
    assert (told is not None) is is_told
    assert told is None or told.severity is Severity.WARNING


@pytest.mark.parametrize(
    "heard",
    [
        [*GIVEN, *UNREADY] * 3,  # the third one may lead to something yet
        [*([*GIVEN, *UNREADY] * 6), *GIVEN, *READY, *exchanges(2)],  # it was slow
        [*GIVEN, *UNREADY, RUBBISH] * 6,  # what came of it may be lost
        [*GIVEN, *diagnosis(owner=1, first=0x04)] * 6,  # PB005 says why
        [*GIVEN, *diagnosis(owner=2, first=0x80)] * 6,  # PB011 does
        [*GIVEN, *READY, *exchanges(2)] * 6,  # given again while it exchanges data
    ],
)
def test_others_are_on_their_way(heard: Telegrams) -> None:
    assert found(judged(heard), "PB022") is None


def test_two_stations_at_once_are_no_telegrams() -> None:
    asked = [(1, telegram(9, 1, 0x6D, dsap=60 - at % 2, ssap=62)) for at in range(8)]
    told = found(judged([*exchanges(2), *(one for request in asked for one in (request, RUBBISH))]), "PB001")
    assert told is not None
    assert (told.subject, told.severity) == ("station 9", Severity.ERROR)
    assert "at once" in told.means
    noisy = found(judged([*exchanges(2), *asked[:6], asked[6], RUBBISH, asked[7], RUBBISH]), "PB001")
    assert noisy is not None
    assert "at once" not in noisy.means
