"""Numbers and words of the Modbus findings."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from math import floor, log10, sqrt

from dissectors.findings import Finding, Severity
from dissectors.frame import Flaw
from dissectors.modbus.station_record import Key


def wilson(count: int, of: int) -> tuple[float, float]:
    """95 % confidence interval of a share (Wilson 1927); (0, 1) of nothing."""
    if of <= 0:
        return 0.0, 1.0
    z = 1.96
    share = min(1.0, count / of)
    middle = (share + z * z / (2 * of)) / (1 + z * z / of)
    half = z * sqrt(share * (1 - share) / of + z * z / (4 * of * of)) / (1 + z * z / of)
    return max(0.0, middle - half), min(1.0, middle + half)


def share_words(count: int, of: int) -> str:
    """The same in percent: "0.2% to 1.6%", with two digits of what is near to none or to all."""
    low, high = wilson(count, of)
    near = min(high, 1 - low)
    places = 1 if near >= _NEAR else 1 - floor(log10(100 * near))
    return f"{low:.{places}%} to {high:.{places}%}"


_NEAR = 0.005


def request_words(key: Key) -> str:
    """ "read holding registers from 0x2520"."""
    kind, address = key
    return kind.replace("-", " ") + (f" from 0x{address:04X}" if address is not None else "")


def units(units: Iterable[int]) -> str:
    """ "station 3", "stations 3, 4"; at most eight by number."""
    numbers = sorted(units)
    shown = ", ".join(map(str, numbers[:8])) + (" …" if len(numbers) > 8 else "")
    return f"station{'s' if len(numbers) > 1 else ''} {shown}"


def note_if(condition: bool) -> Severity | None:
    """The severity of what is not worth more than a note; None, the rule's own, for all else."""
    return Severity.NOTE if condition else None


def of_few(finding: Finding) -> Finding:
    """The finding of so little damage that nothing tells whose it is: one station's, or that of the line."""
    return replace(
        finding,
        means="noise on this station's drop, or anywhere on the line: too few to tell which",
        next="whether it comes again, and with whom; then that station's connector and stub, or termination, bias and "
        "ground",
    )


def without_check(finding: Finding, flaw: Flaw) -> Finding:
    """What is found of a sender whose frames lack the check, and nothing else: perhaps it makes none."""
    if flaw is not Flaw.LAST_TWO_MISSING:
        return finding
    return replace(
        finding,
        means="whoever sends makes no check, as a program does that leaves it to another; or its driver is released "
        "before the check is out",
        next="whether that program has to append the CRC itself; else its turnaround, its direction control",
    )


def of_two(finding: Finding, count: int) -> Finding:
    """The finding of damage of which much has more octets than an answer: noise makes none, two senders at once do."""
    return replace(
        finding,
        seen=f"{finding.seen}; {count} have more octets than they can have",
        means="two at once: this station answers late, into what the master sends next or its own next answer, or "
        f"somebody talks over it; or {finding.means}",
        next=f"its slowest answer against the master's timeout, and what else speaks then; {finding.next}",
    )
