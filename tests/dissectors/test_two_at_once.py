"""What proves two senders at once explains stretches that nobody can read: octets of two are those of no rate."""

from __future__ import annotations

import pytest

from dissectors.registry import get

TWO_AT_ONCE = {
    "modbus-rtu": ("MB201", "MB202", "MB203"),
    "n2": ("N2007", "N2008"),
    "mstp": ("MS104", "MS501"),
    "profibus": ("PB010", "PB015"),
}
TWO_MASTERS = {"modbus-rtu": "MB203", "n2": "N2007", "profibus": "PB015"}


@pytest.mark.parametrize(("protocol", "codes"), TWO_AT_ONCE.items())
def test_octets_of_two_are_no_other_settings(protocol: str, codes: tuple[str, ...]) -> None:
    rules = get(protocol).rules
    assert [code for code in codes if "LN303" not in rules[code].explains] == []


@pytest.mark.parametrize(("protocol", "code"), TWO_MASTERS.items())
def test_a_second_master_that_asks_by_a_clock_is_no_contactor(protocol: str, code: str) -> None:
    assert "LN302" in get(protocol).rules[code].explains
