"""Guessing a profile from what a station answers and refuses."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

from dissectors.bacnet.application import confirmed
from dissectors.bacnet.envelope import npdu_frame
from dissectors.bacnet.f510 import f510
from dissectors.bacnet.readings import readings
from dissectors.frame import Check, FoundBy, Frame
from dissectors.profiles.packaged import packaged
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
    assert "holding 767 fits" in best.why


def test_a_wrong_sign_rules_a_profile_out() -> None:
    found = guesses(("010302ff0001", "0103020007"), ("0103030f0002", "01030400321770"))
    assert "automationdirect-acn" not in {guess.profile.name for guess in found}


def test_what_is_refused_counts_against() -> None:
    fine = guesses(("010325240001", "0103020000"))
    less = guesses(("010325240001", "0103020000"), ("010325270001", "018302"))
    assert fine[0].score == 1.0
    assert less[0].score == 0.5
    assert "1 refused that it should have" in less[0].why


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
