"""Changes of the findings of a bus since the last look: appeared, became graver, is over or found no more. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum

from dissectors.findings import Finding, Severity, merged

OVER_AFTER = 600_000_000_000
"""ns without another occurrence after which a finding is over, unless it lasts as long as it is found."""


class NewsKind(Enum):
    """What happened to a finding. Gone: it has not occurred for long, or is found no more: what was heard since speaks
    against it, or another finding explains it."""

    NEW = "new"
    WORSE = "worse"
    GONE = "gone"


@dataclass(frozen=True, slots=True)
class News:
    """One thing to tell. `held_back`: how many of the same finding were not told since the last one."""

    what: NewsKind
    finding: Finding
    held_back: int = 0


@dataclass(slots=True)
class _Known:
    finding: Finding  # as it was found last
    severity: Severity
    is_over: bool = False
    told: int | None = None  # ns, when it was told last
    waits: NewsKind | None = None  # for its time
    held_back: int = 0


class NewsDesk:
    """`least`: findings below are nobody's business. `every`: ns between two words about the same finding; its last
    change is told when they are over, those before it are counted. What becomes graver is told at once."""

    def __init__(self, least: Severity, every: int) -> None:
        self._least = least
        self._every = every
        self._known: dict[tuple[str, str], _Known] = {}

    def another(self) -> NewsDesk:
        """One for something else, as strict."""
        return NewsDesk(self._least, self._every)

    def look(self, findings: Iterable[Finding], now: int) -> list[News]:
        """What is to be told at `now` (ns on the capture's clock) of all that is found by then."""
        own: list[Finding] = []
        going_on: dict[tuple[str, str], int] = {}  # until when what a finding explains was seen
        for one in findings:
            if one.cause is None:
                own.append(one)
            else:
                going_on[one.cause] = max(one.last, going_on.get(one.cause, one.last))
        found = {one.key: one for one in merged([own]) if one.severity >= self._least}
        told = [
            self._rationed(self._what(one, max(one.last, going_on.get(one.key, one.last)), now), one, now)
            for one in found.values()
        ]
        for key, known in self._known.items():
            if key not in found:
                was_over, known.is_over = known.is_over, True
                told.append(self._rationed(None if was_over else NewsKind.GONE, known.finding, now))
        return [news for news in told if news is not None]

    def _what(self, finding: Finding, last: int, now: int) -> NewsKind | None:
        """`last`: when it, or what comes of it, was seen last."""
        known = self._known.get(finding.key)
        over = not finding.lasts and now - last > OVER_AFTER
        if known is None:
            self._known[finding.key] = _Known(finding, finding.severity, over)
            return None if over else NewsKind.NEW
        known.finding = finding
        was_over, known.is_over = known.is_over, over
        if over:
            return None if was_over else NewsKind.GONE
        if was_over:
            known.severity = finding.severity
            return NewsKind.NEW
        worse, known.severity = finding.severity > known.severity, max(known.severity, finding.severity)
        return NewsKind.WORSE if worse else None

    def _rationed(self, what: NewsKind | None, finding: Finding, now: int) -> News | None:
        known = self._known[finding.key]
        if what is not None:
            known.held_back += known.waits is not None
            known.waits = what
        if known.waits is None:
            return None
        early = known.told is not None and now - known.told < self._every
        if early and known.waits is not NewsKind.WORSE:  # which happens but once a grade
            return None
        news = News(known.waits, finding, known.held_back)
        known.waits, known.held_back, known.told = None, 0, now
        return news
