"""A bus that is listened to: what its silence says while it lasts."""

from __future__ import annotations

from pathlib import Path

import pytest

from dissectors.line import NS_PER_S
from sniff.bus.model import BusModel
from sniff.bus.offline import survey
from sniff.engine.follow_settings import dissector_for
from sniff.formats import read

CAPTURE = Path(__file__).parents[3] / "captures/rtu-usual-faults.cap.txt"


@pytest.fixture
def model() -> BusModel:
    capture = read(CAPTURE)
    made = BusModel(capture.session, dissector_for(capture.session))
    survey(capture, capture.session, made)
    return made


def test_a_bus_that_fell_silent_has_a_finding_as_long_as_it_is(model: BusModel) -> None:
    before, last = model.findings(), model.summary.load.last
    assert last is not None
    assert "LN304" not in {one.code for one in before}
    model.listened_until = lambda: last + 600 * NS_PER_S
    told = model.findings()
    assert [one for one in told if one.code != "LN304"] == list(before)
    assert [one.severity for one in told] == sorted((one.severity for one in told), reverse=True)
    assert [(one.lasts, one.subject) for one in told if one.code == "LN304"] == [(True, "bus")]
    model.listened_until = lambda: last + 5 * NS_PER_S
    assert model.findings() == before
