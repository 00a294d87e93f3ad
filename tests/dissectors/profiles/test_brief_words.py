"""What gives way where a line has little room: bits first, never a number, never what is wrong."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from dissectors.profiles.brief_words import say_briefly
from dissectors.profiles.decoding import say
from dissectors.profiles.packaged import packaged
from dissectors.readings import Origin, Reading

E510 = packaged("teco-e510")


def read(first: int, *values: int) -> tuple[Reading, ...]:
    return tuple(Reading("holding", first + step, value, value, Origin.READ) for step, value in enumerate(values))


STATUS, SPEED = read(0x2520, 0x0007), read(0x2524, 4500)


def test_what_fits_is_said_whole() -> None:
    whole = say(E510, STATUS + SPEED)
    assert say_briefly(E510, STATUS + SPEED, len(whole)) == whole


def test_bits_give_way_to_numbers() -> None:
    whole = say(E510, STATUS + SPEED)
    assert "output frequency 45.00 Hz" in whole
    brief = say_briefly(E510, STATUS + SPEED, len(whole) - 1)
    assert brief.endswith("output frequency 45.00 Hz")
    assert brief.startswith("status running")
    assert " +" in brief
    assert len(brief) < len(whole)


def test_names_give_way_where_no_number_has_room() -> None:
    brief = say_briefly(E510, STATUS + SPEED, 24)
    assert brief.startswith("running")
    assert brief.endswith("; 45.00 Hz")


def test_a_fault_never_gives_way() -> None:
    failed = read(0x2520, 0x000C)
    words = say(E510, failed)
    assert "fault" in words
    for room in range(len(words)):
        assert "fault" in say_briefly(E510, failed + SPEED, room)


def test_words_without_a_number_keep_their_names() -> None:
    assert say_briefly(E510, STATUS, 3) == say(E510, STATUS)


@given(st.lists(st.integers(0, 0xFFFF), min_size=1, max_size=20), st.integers(0, 200))
def test_it_is_never_longer_than_the_whole(values: list[int], room: int) -> None:
    readings = read(0x2520, *values)
    brief = say_briefly(E510, readings, room)
    whole = say(E510, readings)
    assert len(brief) <= len(whole)
    assert brief == whole or len(whole) > room
