"""A capture, read once for its numbers and, where findings name rows, once more for their words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any

from dissectors.findings import Finding, Severity, under_causes
from dissectors.line import MS, NS_PER_S
from dissectors.manifest import Dissector
from dissectors.profiles import Devices
from dissectors.token_ring import TokenRing
from dissectors.tracker import Verdict
from dissectors.words import milliseconds
from sniff.analysis.health import Health
from sniff.analysis.json_text import iso
from sniff.analysis.judging import rules_over
from sniff.analysis.load import Load
from sniff.analysis.nodes import Node
from sniff.analysis.summary import Summary, ranked
from sniff.analysis.trends import Trend, Trends
from sniff.analysis.wording import describe
from sniff.bus.model import BusModel
from sniff.bus.offline import outputs, survey
from sniff.bus.sifting import shown_findings, sift
from sniff.engine.capture import Capture
from sniff.engine.engine import Output, Row
from sniff.engine.follow_settings import dissector_for
from sniff.engine.read_source import ReadSource
from sniff.engine.session import DEVICES_NOTE, LineEvent, Session
from sniff.filter import Filter
from sniff.reporting.happenings import Happenings
from sniff.reporting.numbers import (
    CaptureNumbers,
    Distribution,
    EvidenceRow,
    FindingRow,
    Measurement,
    RingNumbers,
    Score,
    StationNumbers,
    TimePart,
    ValueTrend,
    seconds_since,
)
from sniff.reporting.timeline import MOST_PARTS, Timeline

EVIDENCE_SHOWN, EVIDENCE_OF_NOTES = 5, 2
LONGEST_TEXT = 180
VALUES_SHOWN = 12
"""Plots of values at most."""


def collect(
    source: str,
    capture: Capture,
    session: Session,
    devices: Devices,
    watched: ReadSource | None = None,
    reference: bool = False,
    wanted: Filter | None = None,
) -> CaptureNumbers:
    """Read a capture to its end. `session`: with the settings to use; `watched`: the same capture, whose reading is
    told; `reference`: row by row, for comparison. `wanted`: numbers are of what a filter accepts; the bus is judged
    whole, and of what was found that is told which shows such a row. Raises CaptureError."""
    read = watched or capture
    dissector = dissector_for(session)
    model, timeline, told = (
        BusModel(session, dissector, devices, with_points=False),
        Timeline(session.line.char),
        Happenings(session),
    )
    trends = Trends(dissector, devices)
    if wanted is None:
        survey(read, session, model, timeline, told, trends, reference=reference)
    else:
        survey(read, session, model, reference=reference)
    complete = capture.completeness()  # before it is read again, which need not go to its end
    summary, findings, healths = model.summary, model.findings(), model.health()
    if wanted is not None:
        summary = Summary(session.line)
        sift(capture, session, wanted, summary, timeline, told, trends)
        findings = shown_findings(capture, session, wanted, findings)
    health = healths.bus if summary.octets else None
    stations = tuple(
        _station(node, told.trouble.get(node.address, Counter()), healths.stations.get(node.address))
        for node in summary.nodes.present()
    )
    found = _found(findings, _words(read, session, dissector, findings, reference), session, dissector)
    load = summary.load
    numbers = CaptureNumbers(
        source=source,
        title=dissector.title,
        verdict=verdict(health, found, stations, summary),
        health=None if health is None else _score(health),
        complete=complete.whole,
        completeness=complete.text,
        first=None if load.first is None else iso(load.first),
        last=None if load.last is None else iso(load.last),
        seconds=summary.seconds,
        octets=summary.octets,
        noise_octets=summary.noise,
        frames=summary.frames,
        damaged=summary.damaged,
        load=load.overall(),
        findings=found,
        stations=stations,
        polled_only=tuple(summary.nodes.absent()),
        kinds=ranked(summary.kinds),
        verdicts=ranked({verdict.value: count for verdict, count in summary.verdicts.items()}),
        damages=ranked(summary.damages),
        line_errors=ranked(summary.marks),
        response=Distribution.of(summary.latency),
        part=timeline.width / 1e9 if timeline.origin is not None else 0.0,
        timeline=_parts(timeline, load, session),
        happenings=tuple(told.happenings),
        measurement=_measurement(session, dissector),
        ring=None if dissector.ring is None else _ring(dissector.ring, model.ring()),
        values=tuple(_value(trend, session) for trend in trends.moved(VALUES_SHOWN)),
        happenings_left_out=told.left_out,
    )
    return numbers if session.has_times else numbers.without_times()


def _value(trend: Trend, session: Session) -> ValueTrend:
    at = tuple(round(seconds_since(session.started, time), 3) for time in trend.times)
    return ValueTrend(trend.station, trend.name, trend.unit, trend.how, at, tuple(trend.values))


def verdict(
    health: Health | None, findings: tuple[FindingRow, ...], stations: tuple[StationNumbers, ...], summary: Summary
) -> str:
    """The whole capture in a sentence or two."""
    if health is None and summary.searched:
        return "Octets were heard, but the settings of the bus were not found while this was recorded."
    if health is None:
        return "Nothing was heard: the capture holds no octet."
    if not summary.frames:
        return "Octets were heard, but not one frame: wrong line settings or protocol, or a broken line."
    errors = [finding for finding in findings if finding.severity == Severity.ERROR.label]
    warnings = [finding for finding in findings if finding.severity == Severity.WARNING.label]
    ill = [station for station in stations if station.health is not None and station.health.score < 50]
    if errors:
        said = f"Something fails: {_subject(errors[0])}."
    elif ill:
        said = f"The bus works, but {_many([station.address for station in ill])} hardly."
    elif warnings:
        said = f"The bus works, with trouble: {_subject(warnings[0])}."
    elif health.score < 90:
        said = "The bus works, with losses."
    else:
        said = "The bus is in good order."
    counted = [
        f"{len(group)} {word}{'s' if len(group) > 1 else ''}"
        for group, word in ((errors, "error"), (warnings, "warning"))
        if group
    ]
    return said + (f" {' and '.join(counted)} in all." if len(errors) + len(warnings) > 1 else "")


def _many(addresses: list[int]) -> str:
    return f"station{'s' if len(addresses) > 1 else ''} {', '.join(map(str, addresses))}"


def _subject(finding: FindingRow) -> str:
    return f"{finding.subject}: {finding.title}" if finding.title else f"{finding.subject}: {finding.seen}"


def _station(node: Node, kinds: Counter[str], health: Health | None) -> StationNumbers:
    trouble = dict(kinds.most_common())
    if node.damaged:
        trouble["damaged frame"] = node.damaged
    return StationNumbers(
        address=node.address,
        sent=node.sent,
        received=node.received,
        asked=node.asked,
        answered=node.answered,
        exceptions=node.verdicts[Verdict.EXCEPTION],
        unanswered=node.unanswered,
        damaged=node.damaged,
        health=None if health is None else _score(health),
        trouble=trouble,
        response=Distribution.of(node.latency),
    )


def _score(health: Health) -> Score:
    return Score(health.score, health.reasons)


def _parts(timeline: Timeline, load: Load, session: Session) -> tuple[TimePart, ...]:
    if timeline.origin is None:
        return ()
    begin = (timeline.origin - session.started) / NS_PER_S  # parts begin at round times, the first before the start
    width = timeline.width / 1e9
    edges = range(timeline.origin, timeline.origin + MOST_PARTS * timeline.width + 1, timeline.width)
    return tuple(
        TimePart(
            begin + number * width,
            load.drawn(part.busy, edges[number], edges[number + 1]),
            part.damaged,
            part.noise,
            part.failed,
            part.exceptions,
            part.line_errors,
        )
        for number, part in enumerate(timeline.listed())
    )


def _words(
    capture: ReadSource, session: Session, dissector: Dissector, findings: tuple[Finding, ...], reference: bool
) -> dict[int, tuple[float, str]]:
    """Time and text of the rows that findings show."""
    wanted = {no for finding in findings for no in _shown(finding)}
    words: dict[int, tuple[float, str]] = {}
    if not wanted:
        return words
    for row in _rows(capture, session, wanted, reference):
        words[row.no] = (seconds_since(session.started, row.event.start), _cut(describe(dissector, row)))
    return words


def _rows(capture: ReadSource, session: Session, wanted: set[int], reference: bool) -> Iterator[Row]:
    """The rows with these numbers; what follows the last of them is not read."""
    last = max(wanted)
    if reference:
        for output in outputs(capture.items(), session):
            rows = output.rows if isinstance(output, Output) else ()
            yield from (row for row in rows if row.no in wanted)
            if rows and rows[-1].no >= last:
                return
        return
    from sniff.engine.bulk import tables_of

    for table in tables_of(capture, session):
        if not isinstance(table, LineEvent):
            yield from (table.row(no - table.first) for no in sorted(wanted) if 0 <= no - table.first < len(table))
            if table.first + len(table) > last:
                return


def _found(
    findings: tuple[Finding, ...], words: dict[int, tuple[float, str]], session: Session, dissector: Dissector
) -> tuple[FindingRow, ...]:
    rules = rules_over(dissector)
    return tuple(
        FindingRow(
            code=finding.code,
            severity=finding.severity.label,
            title=rules[finding.code].title if finding.code in rules else "",
            subject=finding.subject,
            count=finding.count,
            first=seconds_since(session.started, finding.first),
            last=seconds_since(session.started, finding.last),
            seen=finding.seen,
            means=finding.means,
            next=finding.next,
            evidence=tuple(EvidenceRow(no, *words.get(no, (None, ""))) for no in _shown(finding)),
            under=under,
        )
        for finding, under in under_causes(findings)
    )


def _shown(finding: Finding) -> tuple[int, ...]:
    """The rows to show: fewer of what does not matter much, so that a long capture's page stays short."""
    return finding.evidence[: EVIDENCE_SHOWN if finding.severity >= Severity.WARNING else EVIDENCE_OF_NOTES]


def _cut(text: str) -> str:
    """A row's words with their middle left out where they are very long, so that what is wrong with it still shows."""
    return text if len(text) <= LONGEST_TEXT else f"{text[: LONGEST_TEXT // 2]} … {text[-LONGEST_TEXT // 3 :]}"


def _measurement(session: Session, dissector: Dissector) -> Measurement:
    adapter = session.adapter
    limits = []
    if not session.has_times:
        limits.append("When anything came is not known: nothing is said of response times, load or rounds.")
    elif adapter.latency:
        limits.append(
            f"The adapter may hold octets back for {milliseconds(adapter.latency)} ({adapter.latency_from}): "
            "every response time is known only to that."
        )
    else:
        limits.append(f"Times are taken as exact ({adapter.latency_from}).")
    if adapter.reports is None:
        limits.append("Nobody knows which line errors this adapter reports: none seen does not mean none there.")
    else:
        missing = [name for name in ("parity", "framing", "break") if name not in adapter.reports]
        if missing:
            limits.append(f"The adapter does not report {', '.join(missing)}: none seen does not mean none there.")
    if adapter.detail:
        limits.append(f"Of what it reports: {adapter.detail}.")
    return Measurement(
        protocol=dissector.name,
        line=session.line_words,
        port=session.port,
        bus=session.bus,
        program=session.program,
        adapter=adapter.name,
        driver=adapter.driver,
        latency_ms=adapter.latency / MS,
        latency_from=adapter.latency_from,
        reports=adapter.reports,
        detail=adapter.detail,
        limits=tuple(limits),
        devices=session.notes.get(DEVICES_NOTE, ""),
    )


def _ring(shown: TokenRing, ring: Any) -> RingNumbers:
    """What the token ring of a capture comes to."""
    return RingNumbers(shown.order(ring), shown.headings, tuple(shown.rows(ring)), tuple(shown.sentences(ring)))
