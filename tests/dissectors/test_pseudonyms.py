"""Numbers instead of numbers: in order, within their class, and none is listed before it is needed."""

from __future__ import annotations

from dissectors.pseudonyms import Pseudonyms


def test_each_class_gives_its_own_numbers_in_the_order_of_appearance() -> None:
    names = Pseudonyms(range(1, 4), range(4, 6), kept=(0, 2))
    assert [names.of(number) for number in (3, 5, 3, 0, 2, 1, 4)] == [1, 4, 1, 0, 2, 3, 5]


def test_a_number_of_no_class_stays_as_it_is() -> None:
    names = Pseudonyms(range(1, 2), kept=())
    assert [names.of(number) for number in (9, 1, 9)] == [9, 1, 9]


def test_so_many_that_they_cannot_be_listed() -> None:
    names = Pseudonyms(range(1, 1 << 62), kept=(1,))
    assert (names.of(1 << 61), names.of(7)) == (2, 3)


def test_a_doubtful_number_gets_a_name_from_the_end_and_keeps_it() -> None:
    names = Pseudonyms(range(1, 5), range(10, 12), kept=(0, 4))
    doubtful = [names.of_doubtful(number) for number in (2, 2, 0, 10, 77)]
    assert doubtful == [3, 3, 0, 11, 77]
    assert [names.of(number) for number in (3, 2, 1, 11)] == [1, 3, 2, 10]
    assert names.of_doubtful(3) == 1
