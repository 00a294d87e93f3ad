"""Findings about requests that stations refuse: one for each, or one for all where somebody looks what there is."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from dissectors.bacnet import message as messages
from dissectors.bacnet.ring_remarks import listed
from dissectors.bacnet.rules import RULES
from dissectors.findings import EVIDENCE_MAX, Finding, Severity, Tally
from dissectors.frame import Event, Frame
from dissectors.tracker import Transaction

REFUSED_KEPT = 512
"""Most services and errors of stations that are counted apart."""

_DIFFERENT_KEPT = 64
_NOT_SUPPORTED = frozenset(("property unknown-property", "reject unrecognized-service"))
"""What a device says of something that it may have or not."""


_SMALLER = (
    "ask for less at once: single properties, elements of a list by their index; what both sides say of segmentation "
    "and of the longest message they take"
)
_BUSY = "load and firmware of the station, and of what it asks itself; ask seldom or later again"
_NEXT = {
    "segmentation-not-supported": _SMALLER,
    "buffer-overflow": _SMALLER,
    "apdu-too-long": _SMALLER,
    "insufficient-segments": _SMALLER,
    "out-of-resources": _BUSY,
    "tsm-timeout": _BUSY,
    "application-exceeded-reply-time": _BUSY,
    "preempted-by-higher-priority-task": _BUSY,
    "busy": _BUSY,
    "timeout": _BUSY,
    "read-access-denied": "who may read it; the buffer of a log is read by ReadRange alone",
    "write-access-denied": "whether the property can be written at all, or only while out-of-service is true; who may",
    "value-out-of-range": "the value that is sent, against the limits of the object",
    "invalid-data-type": "the type of the value that is sent, against that of the property; Null gives it up",
}
"""What to do next, by the last word of what a station says; of others, what the rule says."""


@dataclass(slots=True)
class _Refused:
    """One error in answer to one service of one station; `once`: nothing was asked for twice, as far as is known."""

    tally: Tally = field(default_factory=Tally)
    different: set[bytes] = field(default_factory=set)
    once: bool = True

    def add(self, transaction: Transaction, asked: bytes | None) -> None:
        self.tally.add(transaction.end, transaction.request, transaction.response)
        known = asked is not None and asked not in self.different and len(self.different) < _DIFFERENT_KEPT
        self.once = self.once and known
        if known and asked is not None:
            self.different.add(asked)


class Refusals:
    """Fed every answered request. `asked`: how many, by station and service."""

    def __init__(self) -> None:
        self.asked: Counter[tuple[int, str]] = Counter()
        self._refused: dict[tuple[int, str, str], _Refused] = {}  # by station, service, and class and code in words

    def answer(self, station: int, kind: str) -> None:
        """A request was answered, well or not."""
        if len(self.asked) < REFUSED_KEPT or (station, kind) in self.asked:
            self.asked[station, kind] += 1

    def refuse(self, station: int, transaction: Transaction, request: Event | None) -> None:
        """A request was answered with an error. `request`: the frame directly before the answer, None where unknown."""
        key = station, transaction.kind, transaction.error or "error"
        if key in self._refused or len(self._refused) < REFUSED_KEPT:
            message = messages.read(request) if isinstance(request, Frame) and request.ok else None
            asked = None if message is None or message.apdu is None else message.parameters
            self._refused.setdefault(key, _Refused()).add(transaction, asked)

    def findings(self) -> Iterable[Finding]:
        """What was found so far."""
        common = set(self._common())
        for service, words in sorted(common):
            yield self._of_all(service, words)
        for (mac, service, words), refused in self._refused.items():
            if (service, words) in common:
                continue
            tally = refused.tally
            answered = max(tally.count, self.asked[mac, service])
            some = f"the only {service} request" if answered == 1 else f"{tally.count} of {answered} {service} requests"
            looks = refused.once and _is_not_supported(words)
            seen = (
                f"{_error(words)} in answer to {some}{', each for something else' if looks and tally.count > 1 else ''}"
            )
            severity = Severity.NOTE if looks or tally.count == 1 else None
            finding = tally.found(RULES["MS305"], f"MAC {mac}", seen, severity)
            yield replace(finding, next=_NEXT.get(words.split()[-1], finding.next))

    def _common(self) -> Iterable[tuple[str, str]]:
        """What is asked for that no station has: each of several refuses it, none that is asked does not."""
        for service, words in {(service, words) for _, service, words in self._refused}:
            if _is_not_supported(words):
                stations = {mac for mac, asked in self.asked if asked == service}
                if len(stations) > 1 and all((mac, service, words) in self._refused for mac in stations):
                    yield service, words

    def _of_all(self, service: str, words: str) -> Finding:
        stations = sorted(mac for mac, *what in self._refused if what == [service, words])
        tallies = [self._refused[mac, service, words].tally for mac in stations]
        together = Tally(sum(one.count for one in tallies), min(one.first for one in tallies))
        together.last = max(one.last for one in tallies)
        together.evidence = sorted({no for one in tallies for no in one.evidence})[:EVIDENCE_MAX]
        answered = sum(
            max(self._refused[mac, service, words].tally.count, self.asked[mac, service]) for mac in stations
        )
        seen = (
            f"{_error(words)} in answer to {together.count} of {answered} {service} requests, from each station that "
            f"was asked: MAC {listed(stations)}"
        )
        return together.found(RULES["MS305"], "bus", seen, Severity.NOTE)


def _is_not_supported(words: str) -> bool:
    return words.removeprefix("error ") in _NOT_SUPPORTED


def _error(words: str) -> str:
    return words if words.startswith(("error", "reject", "abort")) else f"error {words}"
