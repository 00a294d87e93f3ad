"""What findings mean where more was seen than their rule needs: the causes that are left, and what to check of them."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from dissectors.findings import Finding
from dissectors.frame import Flaw

_LAST: Final = frozenset((Flaw.LAST_MISSING, Flaw.LAST_TWO_MISSING, Flaw.LAST_SPOILT))

_REFUSALS: Final = {
    "02": (
        "the command reached the station damaged: noise on its way, or at the station alone",
        "whether commands are damaged here, too, at these times; the station's connector, stub and ground",
    ),
    "10": (
        "the value lies outside what the device takes there",
        "the value, its unit and scale in the master, against the device's list of points",
    ),
    "12": (
        "the master writes what can only be read",
        "the point in the master's list, against the device's list of points",
    ),
}
"""Error code → what it means, what to check. All others: as the rule says."""


def of_flaw(finding: Finding, flaw: Flaw | int, *, of_all: bool = False) -> Finding:
    """N2012, by what is always the same. `of_all`: several stations have it."""
    if isinstance(flaw, int) or flaw in (Flaw.CHECK_SWAPPED, Flaw.ONE_SPOILT, Flaw.ONE_MISSING):
        means = "the sender's program makes its frames or their checksum so; noise is never the same twice"
        return replace(finding, means=means, next="the device's firmware; what on the way may change octets")
    how = "lets go too soon" if flaw in _LAST else "is switched on too late"
    if of_all:
        means = f"what all of them share: a converter or repeater that {how}, or the adapter of this tap"
        return replace(finding, means=means, next="the same with another adapter; then the converter or repeater")
    return replace(finding, means=f"its driver {how}, or that of a converter before it")


def of_refusal(finding: Finding, code: str) -> Finding:
    """N2009, by the code that the station gives."""
    means, following = _REFUSALS.get({"0A": "10", "0C": "12"}.get(code.upper(), code), (finding.means, finding.next))
    return replace(finding, means=means, next=following)


def of_ordered_reset(finding: Finding) -> Finding:
    """N2001 of a reset that the master ordered."""
    return replace(
        finding,
        means="a warm reset that the master ordered; the station's overrides may be lost",
        next="whether it was meant, and whether overrides have to be given again",
    )


def of_late_answers(finding: Finding) -> Finding:
    """N2011 of answers to commands that were heard, after the master had gone on."""
    return replace(
        finding,
        means="a station that is slower than the master's timeout",
        next="compare the answer times with the master's timeout; what else the station is busy with",
    )


def of_unasked_answers(finding: Finding) -> Finding:
    """N2011 of answers before which no command was heard."""
    return replace(
        finding,
        means="a master that is not heard at this place of the bus, or an answer so late that its command is forgotten",
        next="whether the tap is at a place where the master is heard well; move the tap",
    )


def of_damage(finding: Finding, *, is_everybodys: bool) -> Finding:
    """N2004, by whose the damage is. Of the bus and not surely everybody's: as the rule says."""
    if finding.about.station is not None:
        return replace(finding, next="this station's connector, stub and driver, and its address; then the ground")
    if is_everybodys:
        return replace(finding, next="termination and bias at both ends, the shield, the ground")
    return finding
