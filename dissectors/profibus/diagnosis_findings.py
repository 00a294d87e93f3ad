"""What the newest diagnosis of a slave says in findings: of what, in which words, and how grave it still is. Pure."""

from __future__ import annotations

from collections.abc import Iterator

from dissectors.findings import Finding, Severity, counted, times
from dissectors.line import NS_PER_S
from dissectors.profibus.configuration import parse_configuration
from dissectors.profibus.diagnosis import CONFIGURATION_FAULT, PARAMETER_FAULT
from dissectors.profibus.rules import RULES
from dissectors.profibus.slave_watch import SlaveView
from dissectors.subject import Subject
from dissectors.words import duration

_OF_BEFORE = ("PB004", "PB005")
"""Of what a slave was given, and kept until it is given something else."""

_FAILED_LEAST = 3
_UNREADY_LONG = 10 * NS_PER_S
"""ns in which most devices are through with what they do when they get their parameters."""


def codes_of(slave: SlaveView) -> Iterator[str]:
    """What a diagnosis that was just told speaks of."""
    told, given = slave.told, slave.given
    if told is None:
        return
    if told.first & PARAMETER_FAULT:
        yield "PB004"
    if told.first & CONFIGURATION_FAULT:
        yield "PB005"
    if given is not None and given.ident != told.ident:
        yield "PB006"
    if slave.has_trouble:
        yield "PB009"


def diagnosis_seen(code: str, slave: SlaveView, words: str) -> str:
    """What was seen; `words`: of the newest diagnosis."""
    told, given = slave.told, slave.given
    if code in _OF_BEFORE and slave.is_told_before:
        return "told before the master gave it anything here: from an earlier start, or by another project"
    if code == "PB006" and told is not None and given is not None:
        return f"the master gives ident {given.ident:04X}h, the slave has {told.ident:04X}h"
    if code == "PB005":
        modules = "; ".join(module.words for module in parse_configuration(slave.configured))
        wanted = f"the master configures {modules}" if modules else "what the master configures was not seen"
        has = "; ".join(module.words for module in parse_configuration(slave.has))
        return wanted + (f"; the slave has {has}" if has else "")
    if code == "PB009" and not slave.has_trouble:
        return "had a diagnosis to tell, which is gone"
    if code == "PB011" and told is not None:
        wanted = " and ".join(str(one) for one in sorted(slave.wanted_by))
        owner = "another master" if slave.owner is None else f"master {slave.owner}"
        return f"given parameters by {wanted}; its diagnosis says that it belongs to {owner}"
    return f"its newest diagnosis: {words or 'nothing to report'}"


def diagnosis_grave(code: str, slave: SlaveView) -> Severity:
    """A note where it is gone, or tells of what is no longer asked for."""
    told = slave.told
    if told is None:
        return RULES[code].severity
    still = {
        "PB004": bool(told.first & PARAMETER_FAULT) and not slave.is_told_before,
        "PB005": bool(told.first & CONFIGURATION_FAULT) and not slave.is_told_before,
        "PB006": slave.given is not None and slave.given.ident != told.ident,
        "PB009": slave.has_trouble,
    }.get(code, True)
    return RULES[code].severity if still else Severity.NOTE


def start_found(who: Subject, slave: SlaveView, words: str) -> Finding | None:
    """That a slave does not come into data exchange, where nothing else that is found of it says why; `words`: of its
    newest diagnosis."""
    told, failed, unready = slave.told, slave.failed, slave.unready
    if told is None or {*codes_of(slave)} - {"PB009"} or any(map(slave.is_of_another, slave.wanted_by)):
        return None
    last = f"; its newest diagnosis: {words or 'nothing to report'}"
    if failed.count >= _FAILED_LEAST:
        came = "no data exchange came of it" if slave.single is None else _single(slave, slave.single)
        seen = f"took its parameters {times(failed.count)}, and {came}{last}"
        return failed.found(RULES["PB022"], who, seen)
    if unready.last - unready.first < _UNREADY_LONG:
        return None
    seen = f"is configured and says for {duration(unready.last - unready.first)} that it is not ready{last}"
    return unready.found(RULES["PB022"], who, seen, Severity.WARNING)


def _single(slave: SlaveView, octets: int) -> str:
    """That its master takes no second answer; and how long that one is, where it is not as long as configured."""
    modules = parse_configuration(slave.configured)
    configured = sum(module.inputs for module in modules)
    begins = "its master began anew after the first answer with data"
    if not modules or modules[-1].end < len(slave.configured) or octets == configured:
        return begins
    return f"{begins}: that has {counted(octets, 'octet')}, {configured} are configured"
