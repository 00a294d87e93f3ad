"""Units and names that a device answers, beside what its manual has."""

from __future__ import annotations

import pytest

from dissectors.profiles.packaged import packaged
from dissectors.profiles.properties import due_property
from dissectors.readings import Origin, Reading


@pytest.mark.parametrize(
    ("space", "number", "said", "due"),
    [
        ("analog-output", 7, "hertz", None),
        ("analog-output", 7, "seconds", None),  # as printed, a row too far
        ("analog-output", 29, "hertz", None),
        ("analog-output", 8, "seconds", "hertz"),
        ("analog-output", 7, "volts", "hertz"),
        ("analog-input", 9, "no-units", None),
    ],
)
def test_a_device_may_answer_what_its_manual_misprints(space: str, number: int, said: str, due: str | None) -> None:
    entry = packaged("teco-e510").at(space, number)
    assert entry is not None
    assert due_property(entry, Reading(space, number, 1, 1, Origin.READ, "units", words=said)) == due
