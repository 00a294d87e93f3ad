"""How the buses and the folder of a box stand, as values of its status page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from dissectors.findings import Finding, Severity
from sniff.box.status import BoxStatus, BusStatus, FindingLine
from sniff.box.watch import BusWatch
from sniff.bus.live import LiveBus
from sniff.capture.config import SourceSpec
from sniff.recording.rotation import file_octets, parts

MOST_FINDINGS = 20
"""Findings of a bus on the status page; more are counted."""


def bus_status(watch: BusWatch, source: SourceSpec, now: int, drift: int) -> BusStatus:
    """What befell a bus since the box began."""
    state, since, why = watch.state(now)
    return BusStatus(
        source.bus,
        source.spec,
        str(source.line),
        source.protocol,
        state,
        since + drift,
        why,
        None if watch.heard_at is None else watch.heard_at + drift,
        watch.octets,
        watch.lost,
        watch.unseen,
        watch.downs,
        watch.time_away(now),
    )


def judged_status(status: BusStatus, live: LiveBus, found: Sequence[Finding], drift: int) -> BusStatus:
    """With what was counted and found since the capture began."""
    summary = live.model.summary
    findings = [one for one in found if one.cause is None and one.severity >= Severity.NOTE]
    return replace(
        status,
        line=live.session.line_words,
        protocol=live.session.protocol_words,
        frames=summary.frames,
        damaged=summary.damaged,
        load=summary.load.share(now=live.now),
        health=live.model.health().bus.score if summary.frames else None,
        searching=live.searching is not None,
        findings=tuple(finding_line(one, drift) for one in findings[:MOST_FINDINGS]),
        more_findings=max(0, len(findings) - MOST_FINDINGS),
    )


def finding_line(one: Finding, drift: int) -> FindingLine:
    """A finding as the page tells it."""
    last = one.last + drift if one.last > 0 else None
    return FindingLine(one.code, one.severity.label, one.subject, one.seen, last)


def parts_and_size(path: Path) -> tuple[int, int]:
    """How many parts of a recording there are, and their octets."""
    there = parts(path)
    return len(there), sum(file_octets(part) for _, part in there)


def page_json(status: BoxStatus) -> str:
    """The page for machines."""
    from sniff.cli import json_output

    return json_output.dumps(status.to_json())
