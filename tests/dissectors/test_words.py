"""Shares and names in words."""

from __future__ import annotations

from dissectors.modbus.finding_words import share_words
from dissectors.register_maps import Mapped, RegisterMap, document
from dissectors.words import percent


def test_some_is_not_none_and_nearly_all_is_not_all() -> None:
    assert [percent(share) for share in (0, 0.0004, 0.0006, 0.5, 0.9996, 1)] == [
        *("0.0%", "under 0.1%", "0.1%", "50.0%", "over 99.9%", "100.0%"),
    ]
    assert [percent(share, 0) for share in (0, 0.004, 0.05, 0.996)] == ["0%", "under 1%", "5%", "over 99%"]


def test_the_bounds_of_a_share_differ() -> None:
    assert share_words(3, 543) == "0.2% to 1.6%"
    assert share_words(3, 100_000) == "0.0010% to 0.0088%"
    assert share_words(10_000, 10_000) == "99.962% to 100.000%"
    assert (share_words(0, 20), share_words(20, 20)) == ("0.0% to 16.1%", "83.9% to 100.0%")


def test_many_entries_of_one_name_are_told_apart() -> None:
    said = RegisterMap([Mapped("holding", at, title) for at, title in enumerate(("a", "a-2", "a", "a", "A-2"))])
    text, count = document("x", "x", said, "modbus", ("modbus-rtu",))
    names = [line for line in text.splitlines() if line.startswith("name = ")]
    assert count == 5
    assert names == [f'name = "{name}"' for name in ("x", "a", "a-2", "a-3", "a-4", "a-2-2")]
