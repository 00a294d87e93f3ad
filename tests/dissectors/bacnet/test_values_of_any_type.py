"""Values that may be of any type: where one ends when others follow, and what type they must have."""

from __future__ import annotations

from typing import Any

import pytest

from dissectors.bacnet import codec, services
from dissectors.bacnet.dates import Date, Time, week_and_day
from dissectors.bacnet.packets.outlines import outlined
from dissectors.bacnet.values import ConstructedValue, ObjectId, show


def read_back(target: str, number: int, value: Any) -> codec.Decoded:
    about = {"object-identifier": target, "property-identifier": number, "property-value": value}
    return codec.decode(services.ACK[12], codec.encode(services.ACK[12], about))


def sequence(type_name: str, **parts: Any) -> ConstructedValue:
    return ConstructedValue(type_name, tuple(parts.items()))


DAY = sequence(
    "DailySchedule", **{"day-schedule": tuple(sequence("TimeValue", time=Time(h, 0, 0, 0), value=h) for h in (6, 18))}
)


def test_each_time_of_a_day_has_its_own_value():
    (day,) = read_back("schedule,1", 123, (DAY,)).record["property-value"]
    assert [(one["time"].hour, one["value"]) for one in day["day-schedule"]] == [(6, 6), (18, 18)]


def test_a_tag_may_have_no_value_one_or_a_date_with_a_time():
    when = (Date(126, 5, 1, 255), Time(8, 0, 0, 0))
    tags = ({"name": "a"}, {"name": "b", "value": 3}, {"name": "c", "value": when}, {"name": "d"})
    found = read_back("device,1", 486, tuple(sequence("NameValue", **tag) for tag in tags)).record["property-value"]
    assert [(one["name"], one.get("value", "none")) for one in found] == [
        *(("a", "none"), ("b", 3), ("c", when), ("d", "none")),
    ]


@pytest.mark.parametrize(
    ("target", "value", "wrong"),
    [
        ("analog-value,1", "off", True),
        ("program,1", "off", False),  # the standard gives programs and files no present value: a maker may add one
        ("file,1", 3, False),
    ],
)
def test_only_a_property_of_the_object_has_a_type(target: str, value: object, wrong: bool):
    assert bool(read_back(target, 85, value).wrong) == wrong


@pytest.mark.parametrize(
    ("octets", "words"),
    [
        ("ff0605", "Friday of last 7 days of any month"),
        ("0201ff", "any day of days 1-7 of February"),
        ("0dff07", "Sunday of any week of odd months"),
        ("ff0a05", "ff0a05"),
        ("ff06", "ff06"),
    ],
)
def test_days_of_a_calendar_in_words(octets: str, words: str):
    entry = ConstructedValue("CalendarEntry", (("week-n-day", bytes.fromhex(octets)),))
    assert show(entry) == f"week-n-day={words}"
    assert (week_and_day(bytes.fromhex(octets)) or octets) == words


@pytest.mark.parametrize(
    ("target", "number", "value", "names"),
    [
        ("device,1", 76, (ObjectId(8, 1), ObjectId(0, 1)), ["[1]", "[2]"]),
        ("analog-output,1", 87, (*({"null": None} for _ in range(7)), {"real": 21.0}), ["[7] null", "[8] real"]),
        ("schedule,1", 123, (DAY, DAY), ["[1] day-schedule", "[2] day-schedule"]),
        (
            "device,1",
            486,
            tuple(sequence("NameValue", name=n, value=1) for n in "ab"),
            ["[1] name value", "[2] name value"],
        ),
    ],
)
def test_elements_of_arrays_stand_under_the_number_that_asks_for_them(
    target: str, number: int, value: Any, names: list[str]
):
    about = {"object-identifier": target, "property-identifier": number, "property-value": ()}
    octets = codec.encode(services.ACK[12], {**about, "property-value": elements(number, value)})
    outline = codec.Outline()
    codec.decode(services.ACK[12], octets, outline)
    (top,) = outlined(octets, outline)
    assert [node.name for node in top.children[-1].children][-2:] == names


def elements(number: int, value: Any) -> Any:
    return tuple(ConstructedValue("PriorityValue", tuple(one.items())) for one in value) if number == 87 else value
