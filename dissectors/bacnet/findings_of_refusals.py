"""Findings about requests that stations refuse: one for each, or one for all where somebody looks what there is."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from dissectors.bacnet.ring_remarks import listed
from dissectors.bacnet.rules import RULES
from dissectors.findings import EVIDENCE_MAX, Finding, Severity, Tally

Refused = Mapping[tuple[int, str, str], Tally]
"""Error answers by station, service, and class and code in words."""

_NOT_SUPPORTED = frozenset(("property unknown-property", "reject unrecognized-service"))
"""What a device says of something that it may have or not."""


def refusals(asked: Mapping[tuple[int, str], int], refused: Refused) -> Iterable[Finding]:
    """Error answers. `asked`: answered requests, by station and service."""
    common = set(_common(asked, refused))
    for service, words in sorted(common):
        yield _of_all(asked, refused, service, words)
    for (mac, service, words), tally in refused.items():
        if (service, words) in common:
            continue
        answered = max(tally.count, asked[mac, service])
        some = f"the only {service} request" if answered == 1 else f"{tally.count} of {answered} {service} requests"
        severity = Severity.NOTE if tally.count == 1 else None
        yield tally.found(RULES["MS305"], f"MAC {mac}", f"{_error(words)} in answer to {some}", severity)


def _common(asked: Mapping[tuple[int, str], int], refused: Refused) -> Iterable[tuple[str, str]]:
    """What is asked for that no station has: each of several refuses it, none that is asked does not."""
    for service, words in {(service, words) for _, service, words in refused}:
        if _without_error(words) in _NOT_SUPPORTED:
            stations = {mac for mac, asked_service in asked if asked_service == service}
            if len(stations) > 1 and all((mac, service, words) in refused for mac in stations):
                yield service, words


def _of_all(asked: Mapping[tuple[int, str], int], refused: Refused, service: str, words: str) -> Finding:
    stations = sorted(mac for mac, *what in refused if what == [service, words])
    tallies = [refused[mac, service, words] for mac in stations]
    together = Tally(sum(one.count for one in tallies), min(one.first for one in tallies))
    together.last = max(one.last for one in tallies)
    together.evidence = sorted({no for one in tallies for no in one.evidence})[:EVIDENCE_MAX]
    answered = sum(max(refused[mac, service, words].count, asked[mac, service]) for mac in stations)
    seen = (
        f"{_error(words)} in answer to {together.count} of {answered} {service} requests, from each station that was "
        f"asked: MAC {listed(stations)}"
    )
    return together.found(RULES["MS305"], "bus", seen, Severity.NOTE)


def _without_error(words: str) -> str:
    return words.removeprefix("error ")


def _error(words: str) -> str:
    return words if words.startswith(("error", "reject", "abort")) else f"error {words}"
