"""A bus as others of its site are held against it."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dissectors.findings import Finding
    from sniff.analysis.site_ear import SiteEar
    from sniff.analysis.site_findings import SiteBus
    from sniff.bus.model import BusModel

_OF_FILE = re.compile(r"(.*?\.\w+) \[[^/\\]*\]", re.DOTALL)
"""A file with a suffix, and a bus in it."""

_MORE_PARTS = re.compile(r" and \d+ more parts?$")


def site_bus(model: BusModel, ear: SiteEar, findings: tuple[Finding, ...] | None = None) -> SiteBus:
    """What is known of a bus so far; its findings are those of its model, unless others are given."""
    from sniff.analysis.site_findings import SiteBus  # most captures are of one bus

    session, summary = model.session, model.summary
    return SiteBus(
        session.bus,
        ear,
        model.judging.line.stops(),
        summary.load.first,
        summary.load.last,
        session.timing.latency + session.timing.char,
        model.findings() if findings is None else findings,
    )


def site_name(source: str) -> str:
    """The recording that a bus is one of, by how its captures are called: "site.mcap [boiler]". Folders and files may
    have brackets in their names, too."""
    first = _MORE_PARTS.sub("", source)
    if not first.endswith("]"):
        return source
    of_file = _OF_FILE.fullmatch(first)
    return first.split(" [", 1)[0] if of_file is None else of_file[1]
