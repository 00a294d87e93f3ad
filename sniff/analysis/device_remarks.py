"""What profiles tell of devices: remarks that become findings, and how each device said that it runs. Pure.

A fault that stands for a night is said with every answer: it is one remark, told again and again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from dissectors.findings import Finding, Severity, Tally, times
from dissectors.line import NS_PER_S
from dissectors.subject import Subject
from dissectors.words import milliseconds
from sniff.analysis.profile_rules import PROFILE_RULES, WRITTEN_BEYOND, WRITTEN_NEXT
from sniff.analysis.written_together import Written, together

MOST_TOLD = 2_000
"""Different things that are told of at most: rubbish that passes a check must not fill the memory."""

OF_STATUS = "status word"
"""Which of several things about a device: what its status word says, without saying why."""

STATE_HOLDS = 10 * NS_PER_S
"""How long what a device said of its state is taken to be so, ns."""

_OF_ALL = -1

Key = tuple[str, Subject, str]
"""Code, subject, and which of several things about it."""


@dataclass(frozen=True, slots=True)
class Remark:
    """One thing that a rule has to say of a device, whenever it was. `thing`: what was written, where that is all that
    counts. `sure`: whether no layout behind it is a guess. `is_written`: a master gave the value."""

    code: str
    subject: Subject
    which: str
    seen: str
    thing: str = ""
    sure: bool = True
    is_written: bool = False

    @property
    def key(self) -> Key:
        """Of the finding that it becomes a part of."""
        return self.code, self.subject, self.which


@dataclass(slots=True)
class _Told:
    """One finding in the making. `first`: the first remark; `is_same`: all others said the same. `worst`: ns, of the
    slowest answer."""

    first: Remark
    is_same: bool = True
    tally: Tally = field(default_factory=Tally)
    worst: int = 0
    sure: bool = False


class DeviceRemarks:
    """Of all devices of one bus. Bounded memory."""

    def __init__(self) -> None:
        self._told: dict[Key, _Told] = {}
        self._running: dict[int, tuple[int, str]] = {}  # by station: when it said that it runs, and how

    def tell(self, remark: Remark, time: int, no: int, took: int = 0) -> None:
        """Take a remark about a frame: when it ended, ns, and its number. `took`: ns, of an answer that was slow."""
        told = self._told.get(remark.key)
        if told is None:
            if len(self._told) >= MOST_TOLD:
                return
            told = self._told[remark.key] = _Told(remark)
        told.is_same = told.is_same and told.first.seen == remark.seen
        told.sure = told.sure or remark.sure
        told.worst = max(told.worst, took)
        told.tally.add(time, no)

    def state_at(self, station: int | None, time: int) -> str:
        """How a station said lately that it runs; empty where it did not. `time`: ns."""
        since, state = self._running.get(_OF_ALL if station is None else station, (0, ""))
        return state if time - since <= STATE_HOLDS else ""

    def note_state(self, station: int, time: int, state: str) -> None:
        """A station said how it runs; empty where it stands. `time`: ns."""
        if state:
            self._running[station] = time, state
        else:
            self.forget_state(station)

    def forget_state(self, station: int | None) -> None:
        """A command may change it; without a `station` that of all."""
        if station is None:
            self._running.clear()
        else:
            self._running.pop(station, None)

    def findings(self, answers: Mapping[Subject, int]) -> tuple[Finding, ...]:
        """All findings so far, in the order of first sight. `answers`: how many of each device had a known time.

        A bit of a status word that says no more than a code or trip bit of the same device is left out.
        """
        worded = {(code, subject) for code, subject, which in self._told if which != OF_STATUS}
        written = [Written(key, told.first.thing, told.tally) for key, told in self._told.items() if told.first.thing]
        at_once = {one.key: seen for one, seen in together(written)}
        return tuple(
            _found(told, at_once.get(key, ""), answers.get(key[1], 0))
            for key, told in self._told.items()
            if (key[2] != OF_STATUS or (key[0], key[1]) not in worded) and (not told.first.thing or key in at_once)
        )


def _found(told: _Told, at_once: str, answers: int) -> Finding:
    """`at_once`: what is seen of it and of all that was written with it."""
    remark, count = told.first, told.tally.count
    seen = at_once or remark.seen
    if remark.code == "PR007":
        seen = f"{count} of {answers} answers {seen}, the slowest at least {milliseconds(told.worst)}"
    elif count > 1:
        seen = f"{seen}, {times(count)}" if told.is_same or at_once else f"{seen}; that is the first of {count} times"
    if told.sure:
        finding = told.tally.found(PROFILE_RULES[remark.code], remark.subject, seen)
        return replace(finding, means=WRITTEN_BEYOND, next=WRITTEN_NEXT) if remark.is_written else finding
    seen += ", as far as this is where the state stands in the answer, which no public source confirms"
    return told.tally.found(PROFILE_RULES[remark.code], remark.subject, seen, Severity.NOTE)
