"""What the buses of a box say together: looked at now and then, and told to whoever is to be."""

from __future__ import annotations

from collections.abc import Sequence

from sniff.analysis.site_findings import SiteJudgement, judged
from sniff.analysis.site_rules import SITE
from sniff.bus.site import site_bus
from sniff.cli.printing import Printer
from sniff.outlets.news import NewsDesk

JUDGED_EVERY = 10.0
"""Seconds between looks at what the buses say together."""


class BoxSite:
    """`path`: of the recording, by which alerts name the site."""

    def __init__(self, path: str) -> None:
        self._path = path
        self._judged: SiteJudgement | None = None
        self._due = 0.0
        self._desk: NewsDesk | None = None

    def begin(self) -> None:
        """Another capture was begun: what the one before said is over."""
        self._judged = None

    def look(self, printers: Sequence[Printer], monotonic: float, now: int) -> SiteJudgement | None:
        """The newest judgement, None of one bus alone. `monotonic`: s; `now`: ns on the capture's clock."""
        if len(printers) < 2:
            return None
        if self._judged is None or monotonic >= self._due:
            self._due = monotonic + JUDGED_EVERY
            lives = [printer.live for printer in printers]
            self._judged = judged([site_bus(live.model, live.ear, live.findings()) for live in lives])
            self._tell(printers[0], self._judged, now)
        return self._judged

    def _tell(self, printer: Printer, site: SiteJudgement, now: int) -> None:
        if printer.alerts is None:
            return
        alerts, desk = printer.alerts
        self._desk = self._desk or desk.another()
        for news in self._desk.look(site.findings, now):
            alerts.tell(SITE, self._path, news)
