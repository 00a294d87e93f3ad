"""A profile that says only what it has otherwise than a packaged one: the same drive by its own Ethernet card."""

from __future__ import annotations

import pytest

from dissectors.profiles.checked import ProfileError
from dissectors.profiles.packaged import packaged, parse_text

HEAD = 'name = "own"\ntitle = "Own"\nprotocols = ["modbus-tcp"]\n'


def test_the_acn_by_tcp_has_the_manuals_numbers_on_the_wire() -> None:
    """Output current is 0h0310: 40784 by RTU, 40785 by TCP, which is 40001 + 310h."""
    serial, card = packaged("automationdirect-acn"), packaged("automationdirect-acn-eth")
    for profile, wire in ((serial, 0x030F), (card, 0x0310)):
        entry = profile.at("holding", wire)
        assert entry is not None
        assert (entry.name, entry.number) == ("output-current", "0310h")
    assert [entry.number for entry in serial.entries] == [entry.number for entry in card.entries]
    assert {entry.address for entry in card.entries} == {entry.address + 1 for entry in serial.entries}
    assert [sign.address for sign in card.signs] == [0x0300]
    assert card.reserved == tuple((first + 1, last + 1) for first, last in serial.reserved)


def test_only_what_is_said_is_otherwise() -> None:
    own = parse_text(HEAD + 'same-as = "teco-e510"\n[modbus.limits]\nframe = 100\n', "own.toml")
    base = packaged("teco-e510")
    assert own.entries == base.entries
    assert own.exceptions == base.exceptions
    limits = own.limits_on("modbus")
    assert (own.name, limits.frame, limits.functions) == ("own", 100, None)


@pytest.mark.parametrize("other", ['"nothing"', '"automationdirect-acn-eth"', "3"])
def test_what_cannot_be_taken_from_is_said(other: str) -> None:
    with pytest.raises(ProfileError, match="is no packaged profile that stands by itself"):
        parse_text(HEAD + f"same-as = {other}\n", "own.toml")
