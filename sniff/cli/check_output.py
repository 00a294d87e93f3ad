"""The output of `check`: text for people, JSON Lines for programs; `check_junit.py` has JUnit XML for build servers."""

from __future__ import annotations

import shutil
import textwrap
from array import array
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from operator import itemgetter
from typing import TYPE_CHECKING

from dissectors.findings import Finding, Rule, Severity, merged, times, under_causes
from dissectors.line import NS_PER_S
from dissectors.words import span
from sniff.analysis.health import Health, health_of
from sniff.analysis.json_text import dumps
from sniff.analysis.judging import rules_over
from sniff.analysis.sanitizing import sanitized
from sniff.analysis.site_rules import SITE_RULES
from sniff.analysis.wording import station_word
from sniff.bus.row_words import iso, since_start
from sniff.cli.consequences import folded
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Session

if TYPE_CHECKING:
    from sniff.analysis.site_findings import SiteBus
    from sniff.analysis.summary import Summary

EVIDENCE_SHOWN = 5
LONG = 600
"""Seconds of a capture from which on it is told when a finding was seen: seconds since its begin are no time of day."""

_NEARLY_ALL = 0.9
_A_YEAR = 366 * 86_400 * NS_PER_S
_INDENT = " " * 9
_COLOURS = {Severity.ERROR: "31;1", Severity.WARNING: "33", Severity.NOTE: "36", Severity.INFO: "2"}


@dataclass(frozen=True, slots=True)
class Checked:
    """What the rules found in one source.

    `note`: why it is not whole. `stations`: health by address. `starts`: begin of each frame by its number − 1, ns.
    `site_bus`: what others on the same clock are held against. `buses`: of what several say together, their names.
    `summary`: what its health is reckoned from.
    """

    source: str
    session: Session
    note: str
    seconds: float
    frames: int
    findings: tuple[Finding, ...]
    health: Health
    stations: Mapping[int, Health]
    starts: array[int]
    site_bus: SiteBus | None = None
    buses: tuple[str, ...] = ()
    summary: Summary | None = None

    def explained(self, findings: tuple[Finding, ...]) -> Checked:
        """The same with its findings after others explained some: what is a consequence costs no health."""
        if findings == self.findings or self.summary is None:
            return self.with_findings(findings)
        health = health_of(self.summary, findings, station_word(self.session.protocol))
        return replace(self, findings=findings, health=health.bus, stations=health.stations)

    def with_findings(self, findings: tuple[Finding, ...]) -> Checked:
        """The same with a choice of its findings."""
        return replace(self, findings=findings)

    def start(self, no: int) -> int | None:
        """When a frame began, ns since the epoch; None where nobody knows."""
        return self.starts[no - 1] if 0 < no <= len(self.starts) and self.session.has_times else None


def as_site(name: str, buses: Sequence[Checked]) -> list[Checked]:
    """The buses of one recording, behind what they say together where that is anything."""
    held = [one.site_bus for one in buses if one.site_bus is not None]
    if len(held) < 2 or len(held) < len(buses):
        return list(buses)
    from sniff.analysis.site_findings import judged  # of several buses

    site = judged([replace(bus, findings=one.findings) for bus, one in zip(held, buses, strict=True)])
    told = [one.explained(own) for one, own in zip(buses, site.buses, strict=True)]
    if not site.findings:
        return told
    seconds, frames = max(one.seconds for one in buses), sum(one.frames for one in buses)
    names = tuple(bus.name for bus in held)
    return [
        replace(buses[0], source=name, note="", seconds=seconds, frames=frames, findings=site.findings, buses=names),
        *told,
    ]


def rules_of(one: Checked) -> Mapping[str, Rule]:
    """The catalogue by which it was judged."""
    return SITE_RULES if one.buses else rules_over(dissector_for(one.session))


def failures(findings: Sequence[Finding], fail_on: Severity, code: str = "") -> list[Finding]:
    """Those at or above a severity, with `code` only that rule's. A consequence counts by its cause, where that is
    among them."""
    return [
        finding
        for finding, under in under_causes(findings)
        if not under and finding.severity >= fail_on and code in ("", finding.code)
    ]


# ---- text


def write_text(checked: Sequence[Checked], colour: bool) -> None:
    """Print for people."""
    width = min(110, max(60, shutil.get_terminal_size((100, 24)).columns))
    for number, one in enumerate(checked):
        if number:
            print()
        _write_head(one, width)
        for is_under, findings in groupby(under_causes(one.findings), key=itemgetter(1)):
            if is_under:
                for who, finding in folded(finding for finding, _ in findings):
                    _write_consequence(one, who, finding, width)
                continue
            for finding, _ in findings:
                print()
                _write_finding(one, finding, width, colour)
        print()
        print(_count_words(one.findings))
    is_one_bus = len({one.session.bus for one in checked}) == 1 and not any(one.buses for one in checked)
    if len(checked) > 1 and is_one_bus:  # several buses are told apart
        _write_together(checked, width)


def _write_head(one: Checked, width: int) -> None:
    session = one.session
    heard = f"{one.frames} frames"
    if one.session.has_times:
        heard = f"{span(one.seconds)}, {heard}"
    if one.buses:
        print(f"{sanitized(one.source)}: {sanitized(', '.join(one.buses))} together, {heard}")
        return
    print(f"{sanitized(one.source)}: {session.protocol_words}, {session.line_words}, {heard}")
    if one.note:
        print(f"  incomplete: {sanitized(one.note)}")
    if one.frames:
        _paragraph(f"health {one.health}", width, "  ", "    ")
        word = station_word(session.protocol)
        for address, health in sorted(one.stations.items()):
            if health.score < 100:
                _paragraph(f"{word} {address}: {health}", width, "    ", "      ")
        whole = [address for address, health in sorted(one.stations.items()) if health.score == 100]
        if whole:
            several = "s" if len(whole) > 1 and word.islower() else ""  # but "MAC 1, 2"
            _paragraph(f"at 100: {word}{several} {', '.join(map(str, whole))}", width, "    ")


def _write_together(checked: Sequence[Checked], width: int) -> None:
    """Which findings come back from capture to capture, one a line."""
    print(f"\nall {len(checked)} captures together:")
    rules = [rules_over(dissector_for(one.session)) for one in checked]
    for finding in merged(one.findings for one in checked):
        if finding.severity is Severity.INFO:
            continue
        within = sum(
            any((found.code, found.subject) == (finding.code, finding.subject) for found in one.findings)
            for one in checked
        )
        title = next((catalogue[finding.code].title for catalogue in rules if finding.code in catalogue), "")
        label = finding.severity.label.upper().ljust(8)
        often = f"{times(finding.count)}, in {within} of {len(checked)} captures"
        _paragraph(f"{label} {finding.subject}: {title}  [{finding.code}]  {often}", width, "", _INDENT)


def _write_finding(one: Checked, finding: Finding, width: int, colour: bool) -> None:
    title = _title(one, finding)
    label = finding.severity.label.upper().ljust(8)
    if colour:
        label = f"\x1b[{_COLOURS[finding.severity]}m{label}\x1b[0m"
    print(f"{label} {sanitized(finding.subject)}: {title}  [{finding.code}]")
    _paragraph(sentence(finding.seen), width, _INDENT)
    for word, text in (("means", finding.means), ("next", finding.next)):
        if text and finding.severity > Severity.INFO:
            _paragraph(f"{word + ':':<7}{text}", width, _INDENT, _INDENT + " " * 7)
    if seen := when(one, finding):
        _paragraph(f"when:  {seen}", width, _INDENT, _INDENT + " " * 7)
    if finding.evidence:
        _paragraph(evidence(one, finding), width, _INDENT, _INDENT + " " * 7)


def when(one: Checked, finding: Finding) -> str:
    """From when to when it was seen, "2026-03-29 02:10:00 … 02:24:58 UTC"; empty where a capture is short or has no
    dates, and of what stood nearly all the time."""
    span = finding.last - finding.first
    is_dated = one.session.has_times and finding.first >= _A_YEAR and finding.severity > Severity.INFO
    if one.seconds < LONG or not is_dated or span >= _NEARLY_ALL * one.seconds * NS_PER_S:
        return ""
    first, last = (iso(time)[:19].replace("T", " ") for time in (finding.first, finding.last))
    if first == last:
        return f"{first} UTC"
    return f"{first} … {last[11:] if first[:10] == last[:10] else last} UTC"


def _write_consequence(one: Checked, who: str, finding: Finding, width: int) -> None:
    """What a finding above most likely explains: one paragraph under it; what to do stands there. `who`: of whom, the
    finding is that of one of them."""
    seen = finding.seen if who == finding.subject else f"most at {finding.subject}: {finding.seen}"
    words = f"└ {who}: {_title(one, finding)}  [{finding.code}]  {sentence(seen)}"
    _paragraph(words, width, _INDENT, _INDENT + "  ")


def evidence(one: Checked, finding: Finding) -> str:
    shown = []
    for no in finding.evidence[:EVIDENCE_SHOWN]:
        start = one.start(no)
        at = f" at {since_start(start, one.session) / NS_PER_S:.3f} s" if start is not None else ""
        shown.append(f"{no}{at}")
    more = " …" if len(finding.evidence) > EVIDENCE_SHOWN or finding.count > len(finding.evidence) else ""
    return f"{'rows:' if len(shown) > 1 else 'row:':<7}{', '.join(shown)}{more}"


def _paragraph(text: str, width: int, first: str, rest: str | None = None) -> None:
    lines = textwrap.wrap(
        sanitized(text),
        width,
        initial_indent=first,
        subsequent_indent=first if rest is None else rest,
        break_on_hyphens=False,
    )
    for line in lines:
        print(line)


def _title(one: Checked, finding: Finding) -> str:
    rule = rules_of(one).get(finding.code) or SITE_RULES.get(finding.code)
    return rule.title if rule is not None else ""


def sentence(text: str) -> str:
    return text[:1].upper() + text[1:] + ("" if text.endswith(".") else ".")


def _count_words(findings: Sequence[Finding]) -> str:
    counts = Counter(finding.severity for finding in findings)
    if not counts:
        return "no findings"
    plural = {Severity.INFO: "facts", Severity.NOTE: "notes", Severity.WARNING: "warnings", Severity.ERROR: "errors"}
    parts = [
        f"{counts[severity]} {plural[severity][: -1 if counts[severity] == 1 else None]}"
        for severity in sorted(counts, reverse=True)
    ]
    under = sum(is_under for _, is_under in under_causes(findings))
    hanging = f" ({under} of them under {'its cause' if under == 1 else 'their causes'})" if under else ""
    return ", ".join(parts) + hanging + "; `sniff485 rule CODE` explains one"


# ---- JSON Lines


def write_json(checked: Sequence[Checked]) -> None:
    """Print one object a finding, consequences behind their cause; keys and their order are a promise."""
    for one in checked:
        for finding, _ in under_causes(one.findings):
            print(dumps(to_json(one, finding)))


def to_json(one: Checked, finding: Finding) -> dict[str, object]:
    """One finding; times both as ISO 8601 and as ns since the capture's start, null where nobody knows them."""
    session, has_times = one.session, one.session.has_times
    return {
        "source": one.source,
        "code": finding.code,
        "severity": finding.severity.label,
        "title": _title(one, finding),
        "subject": finding.subject,
        "count": finding.count,
        "first": iso(finding.first) if has_times else None,
        "last": iso(finding.last) if has_times else None,
        "first_ns": since_start(finding.first, session) if has_times else None,
        "last_ns": since_start(finding.last, session) if has_times else None,
        "frames": [
            {"no": no, "start_ns": None if (start := one.start(no)) is None else since_start(start, session)}
            for no in finding.evidence
        ],
        "seen": finding.seen,
        "means": finding.means,
        "next": finding.next,
        "cause": None if finding.cause is None else {"code": finding.cause[0], "subject": finding.cause[1]},
    }
