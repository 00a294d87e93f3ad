"""Guessing a profile from what a station answers and refuses."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import pytest

from dissectors.bacnet.application import confirmed
from dissectors.bacnet.envelope import npdu_frame
from dissectors.bacnet.f510 import f510
from dissectors.bacnet.readings import readings
from dissectors.frame import Check, FoundBy, Frame
from dissectors.profiles.packaged import packaged
from dissectors.readings import Origin, Reading
from sniff.analysis.profile_guess import Guess, Guessing, HeardPlaces, guess
from sniff.bus.offline import outputs
from sniff.engine.engine import Output
from sniff.engine.follow_settings import dissector_for
from sniff.simulation.scenarios import scenario, simulate

PROFILES = [packaged(name) for name in ("teco-e510", "teco-f510", "automationdirect-acn")]


def load(name: str) -> Any:
    spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name(f"{name}.py"))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


bus = load("points_bus")


def guesses(*exchanges: tuple[str, str | None]) -> list[Guess]:
    guessing = Guessing(dissector_for(bus.SESSION))
    for output in bus.run(bus.chunks(*exchanges)):
        guessing.add(output)
    return list(guessing.guesses(PROFILES))


def test_the_acn_says_its_name() -> None:
    best = guesses(("010302ff0001", "0103020006"), ("0103030f0002", "01030400321770"))[0]
    assert (best.station, best.profile.name, best.score) == (1, "automationdirect-acn", 1.0)
    assert "0300h fits" in best.why


def test_a_wrong_sign_rules_a_profile_out() -> None:
    found = guesses(("010302ff0001", "0103020007"), ("0103030f0002", "01030400321770"))
    assert "automationdirect-acn" not in {guess.profile.name for guess in found}


def test_what_is_refused_counts_against() -> None:
    fine = guesses(("010325200005", "01030a00000000000000000000"))
    less = guesses(("010325200005", "01030a00000000000000000000"), ("010325270001", "018302"))
    assert less[0].score < fine[0].score
    assert "1 refused that it should have" in less[0].why


@pytest.mark.parametrize("first", [0x0000, 0x0100, 0x0300])
def test_registers_that_any_device_has_name_none(first: int) -> None:
    """The first registers of a meter: many drives have parameters there, which may hold anything."""
    values = [2301, 2310, 65535, 12, 40000, 0, 9999, 31000, 17, 500]
    answer = "010314" + "".join(f"{value:04x}" for value in values)
    assert [guess for guess in guesses((f"0103{first:04x}000a", answer)) if guess.score >= 0.5] == []


def test_how_sure_it_is_when_nothing_names_the_device() -> None:
    (best, other, *_) = guesses(("010325240001", "0103021770"))
    assert {best.profile.name, other.profile.name} == {"teco-e510", "teco-f510"}
    assert best.score == other.score < 0.5
    assert "nothing was read that names it" in best.why


@pytest.mark.parametrize(("code", "first"), [(0x0B, "teco-f510"), (0x2F, "teco-e510")])
def test_a_fault_code_that_only_one_has_speaks_for_it(code: int, first: str) -> None:
    found = guesses(("010325200004", f"0103080000{code:04x}00000000"))
    assert [guess.profile.name for guess in found][:2][0] == first
    assert found[0].score > found[1].score


def test_a_reserved_register_at_nought_is_no_hint_against() -> None:
    (zero, *_) = guesses(("010325240004", "010308" + "1770" + "0000" + "0ce4" + "0020"))
    (held, *_) = guesses(("010325240004", "010308" + "1770" + "0001" + "0ce4" + "0020"))
    assert held.score < zero.score


def test_strange_registers_give_no_guess() -> None:
    assert guesses(("0103f0000001", "0103020000")) == []


def test_an_e510_is_told_from_an_f510_by_what_is_not_reserved() -> None:
    found = guesses(("010325030002", "01030400010002"), ("010325240001", "0103020000"))
    assert [guess.profile.name for guess in found] == ["teco-e510", "teco-f510"]
    assert found[0].score > found[1].score


def test_n2_and_mstp_stations() -> None:
    for name, stations in (("n2", {1, 2}), ("mstp", {5})):
        session, items = simulate(scenario(name, faults=False), 15)
        guessing = Guessing(dissector_for(session))
        for output in outputs(items, session):
            if isinstance(output, Output):
                guessing.add(output)
        best = {guess.station: guess.profile.name for guess in reversed(list(guessing.guesses(PROFILES)))}
        assert {station: best.get(station) for station in stations} == dict.fromkeys(stations, "teco-f510")


def test_a_device_as_its_manual_has_it_fits_wholly() -> None:
    profile = next(profile for profile in PROFILES if profile.name == "teco-f510")
    drive, heard = f510(510), HeardPlaces(5)
    for name in profile.constants:
        request = confirmed(1, 12, {"object-identifier": "device,510", "property-identifier": name})
        answer = drive.answer(1, request)
        assert answer is not None
        frames = [
            Frame("mstp", npdu_frame(to, source, npdu, source == 1), 0, 1, Check.GOOD, FoundBy.DELIMITER)
            for source, to, npdu in ((1, 5, request), (5, 1, answer))
        ]
        for reading in readings(*frames):
            heard.answered[reading.space, reading.address, reading.part] = reading
    assert len(heard.answered) == len(profile.constants)
    best = guess(heard, profile)
    assert (best.score, "is another" in best.why) == (1.0, False), best.why


def test_a_version_names_no_device() -> None:
    profile = next(profile for profile in PROFILES if profile.name == "teco-f510")
    heard = HeardPlaces(5)
    for part in ("firmware-revision", "location"):
        value = profile.constants[part]
        heard.answered["device", 5, part] = Reading("device", 5, None, value, Origin.READ, part)
    assert "nothing was read that names it" in guess(heard, profile).why
