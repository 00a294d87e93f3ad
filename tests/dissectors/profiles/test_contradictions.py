"""Where a manual says two things of one place, the profile takes the wider one or says that it is in doubt."""

from __future__ import annotations

import pytest

from dissectors.profiles.decoding import Quality, decode, say
from dissectors.profiles.model import Access, Profile
from dissectors.profiles.packaged import packaged
from dissectors.readings import Origin, Reading

E510, F510, ACN = (packaged(name) for name in ("teco-e510", "teco-f510", "automationdirect-acn"))


@pytest.mark.parametrize("profile", [E510, F510], ids=lambda profile: profile.name)
def test_the_display_word_stands_in_the_table_of_what_is_written(profile: Profile) -> None:
    entry = profile.at("holding", 0x2510)
    assert entry is not None
    assert (entry.name, entry.access) == ("display", Access.BOTH)


def test_a_value_that_one_protocol_allows_is_in_the_range_of_the_other() -> None:
    spaces = {"AI", "AO", "analog-input", "analog-output", "analog-value"}
    ranges: dict[str, set[tuple[float | None, float | None]]] = {}
    for entry in F510.in_space(*spaces):
        if entry.low is not None and not entry.doubt:
            ranges.setdefault(entry.name, set()).add((entry.low, entry.high))
    assert {name: found for name, found in ranges.items() if len(found) > 1} == {}


@pytest.mark.parametrize(
    ("profile", "space", "address"),
    [
        *((F510, "holding", address) for address in (0x2505, 0x2506, 0x252A, 0x252B)),  # volts or milliamperes
        *((F510, "holding", address) for address in (0x000C, 0x000D, 0x0C19, 0x0C1A)),  # Hz or per cent, V or per cent
        *((F510, "AI", number) for number in (13, 14)),
        *((F510, "AO", number) for number in (2, 3, 6, 7)),
        *((ACN, "holding", address - 1) for address in (0x1159, 0x140C, 0x140D, 0x140F, 0x1410, 0x1B49, 0x1B4B)),
    ],
)
def test_what_the_manual_contradicts_is_in_doubt(profile: Profile, space: str, address: int) -> None:
    reading = Reading(space, address, 50, 50, how=Origin.READ)
    (value, *_) = decode(profile, [reading])
    assert value.quality is Quality.UNCERTAIN
    assert say(profile, [reading]).endswith("(?)")


def test_a_setting_that_a_task_needs_is_no_default() -> None:
    for address in (0x1F03, 0x1F04, 0x161F, 0x1106, 0x1107):
        entry = ACN.at("holding", address - 1)
        assert entry is not None
        assert entry.default is None
    assert [F510.at("holding", at).default for at in (0x0002, 0x0005, 0x0901)] == [1, 1, 0]  # type: ignore[union-attr]


@pytest.mark.parametrize("profile", [E510, F510], ids=lambda profile: profile.name)
def test_abnormal_is_an_alarm_by_every_protocol(profile: Profile) -> None:
    found = [entry for entry in profile.entries if entry.name == "abnormal"]
    assert found
    assert {(entry.role.value, entry.title) for entry in found} == {("alarm", "abnormal")}
