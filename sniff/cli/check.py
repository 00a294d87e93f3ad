"""What is wrong with a bus, where, and what to do next. `sniff485 rule CODE` explains a rule. Severities: info, note,
warning, error; exit code 1 when a finding is at or above --fail-on. A port is listened to for --duration.
"""

from __future__ import annotations

import argparse
import sys
from array import array
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from dissectors.findings import Finding, Severity
from sniff.analysis.sanitizing import sanitized
from sniff.bus.model import BusModel
from sniff.bus.offline import survey
from sniff.bus.site import site_bus, site_name
from sniff.cli import (
    INTERRUPTED,
    PORT_TROUBLE,
    USAGE,
    Failure,
    arguments,
    check_output,
    filtering,
    watching,
)
from sniff.cli.check_output import Checked
from sniff.cli.incomplete import say_why
from sniff.cli.interruption import until_interrupted
from sniff.cli.progress import Watched
from sniff.engine.capture import Capture
from sniff.engine.engine import Output
from sniff.engine.follow_settings import dissector_for
from sniff.engine.observer import observe
from sniff.engine.session import LineEvent
from sniff.formats.table import suffixes

if TYPE_CHECKING:
    from sniff.analysis.site_ear import SiteEar
    from sniff.bus.live import LiveBus, LiveItem
    from sniff.engine.table import Table

DEFAULT_DURATION = 30.0
_EARLIEST, _LATEST = -(1 << 63), (1 << 63) - 1
"""Times that fit into 64 bits; a damaged file may have others."""

SEVERITIES = tuple(severity.label for severity in Severity)


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `check`."""
    arguments.add_reference(parser)
    filtering.add_filter(parser, "only findings with a frame that matches among their evidence")
    parser.add_argument("sources", nargs="+", metavar="FILE|PORT", help="captures, or one port or configured bus")
    arguments.add_bus(parser)
    arguments.add_line(parser, auto=True)
    arguments.add_devices(parser)
    parser.add_argument("--format", choices=("text", "json", "junit"), default="text", help="default: text")
    parser.add_argument("--json", action="store_const", const="json", dest="format", help="one JSON object a finding")
    parser.add_argument(
        "--fail-on",
        choices=(*SEVERITIES, "never"),
        default="warning",
        metavar="SEVERITY",
        help="exit with 1 at this severity or above (default: warning; never: always 0)",
    )
    parser.add_argument("--only", action="append", default=[], metavar="CODE", help="only these codes or prefixes")
    parser.add_argument("--ignore", action="append", default=[], metavar="CODE", help="without these codes or prefixes")
    parser.add_argument(
        "--duration", type=arguments.duration, metavar="TIME", help="a port: how long to listen (default: 30s)"
    )


def run(args: argparse.Namespace) -> int:
    """Check every source in turn."""
    for code in _words(args.only) + _words(args.ignore):
        _require_known(code)
    fail_on = None if args.fail_on == "never" else Severity[args.fail_on.upper()]
    found = _check(args)
    selected = [_select(one, args) for one in (found if args.filter else _with_sites(found))]
    checked = [one for one in selected if one.findings or not one.buses]
    colour = arguments.colour()
    if args.format == "junit":
        from sniff.cli.check_junit import write_junit

        write_junit(checked, Severity.WARNING if fail_on is None else fail_on)
    elif args.format == "json":
        check_output.write_json(checked)
    else:
        check_output.write_text(checked, colour)
    if args.format != "text":  # which has it where it belongs
        for one in found:
            if one.note:
                say_why(one.source, one.note)
    failing = fail_on is not None and any(check_output.failures(one.findings, fail_on) for one in checked)
    return int(failing)


def _check(args: argparse.Namespace) -> list[Checked]:
    """Every source; the parts of one recording are one."""
    ports = [source for source in args.sources if not watching.is_file(source)]
    if not ports:
        watching.refuse_duration(args)
        opened = arguments.open_captures(args.sources)
        sites = Counter(site_name(name) for name, _ in opened)
        return [_read(name, capture, args, sites[site_name(name)] > 1) for name, capture in opened]
    source = ports[0]
    if not watching.is_port(source) and ("." in source or "/" in source):
        arguments.open_captures([source])  # says what it is instead

    if len(args.sources) > 1:
        raise Failure(f"{source}: a port is checked alone; files end in {', '.join(suffixes())}", USAGE)
    if args.filter:
        raise Failure("-Y: a port is checked whole; record it, then check the file", USAGE)
    return [_listen(source, args)]


def _with_sites(checked: list[Checked]) -> list[Checked]:
    """What was found, and in front of the buses of one recording what they say together."""
    sites: dict[str, list[Checked]] = {}
    for one in checked:
        sites.setdefault(site_name(one.source), []).append(one)
    told: list[Checked] = []
    for name, buses in sites.items():
        told += check_output.as_site(name, buses)
    return told


def _read(source: str, capture: Capture, args: argparse.Namespace, several: bool = False) -> Checked:
    """What was found in a capture; `several`: one of several buses of a recording."""
    session = arguments.settings_of(args, capture.session, source)
    run_of = Checking(
        BusModel(session, dissector_for(session), arguments.noted_devices(args, session), with_points=False)
    )
    ear = _ear() if several else None
    ears = [] if ear is None else [ear]
    survey(Watched(capture), session, run_of.model, run_of, *ears, reference=args.reference)
    complete = capture.completeness()
    notes = [] if complete.whole else [complete.text]
    if session.unknown:
        name = " and ".join(arguments.options(session))
        notes.append(f"no settings were found while this was recorded, so nothing is judged; name them with {name}")
    result = run_of.result(source, "; ".join(notes))
    shown = filtering.shown_findings(args, capture, session, result.findings, run_of.model.devices)
    result = result.with_findings(shown)
    return result if ear is None else replace(result, site_bus=site_bus(run_of.model, ear))


def _ear() -> SiteEar:
    """What is held against the other buses."""
    from sniff.analysis.site_ear import SiteEar  # most captures are of one bus

    return SiteEar()


def _listen(port: str, args: argparse.Namespace) -> Checked:
    import time

    from sniff.cli import listening, targets

    args.port = port
    target = targets.target_of(args)
    duration = args.duration or DEFAULT_DURATION
    print(f"sniff485: listening to {sanitized(port)} for {duration:g} s", file=sys.stderr)
    with until_interrupted() as caught:
        live = listening.start(target.source, None, None, target.devices, target.search)
        early = _found_first(live, caught)
        run_of = Checking(live.model)
        observe(_heard(early), run_of)
        until = time.monotonic() + duration
        while live.ended is None:
            over = caught or time.monotonic() >= until
            observe(_heard(live.stop() if over else live.poll(0.1)), run_of)
    note = "" if live.ended.clean else live.ended.reason
    return run_of.result(port, note)


def _heard(items: list[LiveItem]) -> Iterator[Output | LineEvent]:
    """What an observer is to know of what a live bus gives."""
    return (item for item in items if isinstance(item, Output | LineEvent))


def _found_first(live: LiveBus, caught: list[int]) -> list[LiveItem]:
    """What comes until a search for settings has ended well. Ends with exit code 4 when it does not, 130 for Ctrl-C."""
    from sniff.cli import searching

    items: list[LiveItem] = []
    meter = searching.Meter()
    while live.searching is not None:
        meter.show(live.searching)
        in_vain = live.ended is not None or live.searching.seconds >= searching.TIMEOUT
        if caught or in_vain:
            meter.clear()
            live.stop()
            assert live.search is not None
            if live.ended is not None and not live.ended.clean:
                raise Failure(f"{live.session.port}: {live.ended.reason}", PORT_TROUBLE)
            said = searching.sentence(live.search.outcome(), "-s and -p name them")
            raise Failure(f"{live.session.port}: {said}", INTERRUPTED if caught else PORT_TROUBLE)
        items += live.poll(0.1)
    meter.follow(live)
    return items


class Checking:
    """One source on its way through the rules; its model is fed by others."""

    def __init__(self, model: BusModel) -> None:
        self.model = model
        self._starts = array("q")  # of each row, so that evidence can be given its time

    def add(self, output: Output) -> None:
        """Remember when rows began."""
        self._starts.extend(min(max(row.event.start, _EARLIEST), _LATEST) for row in output.rows)

    def add_table(self, table: Table) -> None:
        """The same of many rows."""
        self._starts.extend(table.frames.start.tolist())

    def add_line_event(self, event: LineEvent) -> None:
        """Nothing of it is kept here."""

    def result(self, source: str, note: str) -> Checked:
        """What was found."""
        summary, findings, health = self.model.summary, self.model.findings(), self.model.health()
        return Checked(
            source=source,
            session=self.model.session,
            note=note,
            seconds=summary.seconds,
            frames=summary.frames,
            findings=findings,
            health=health.bus,
            stations=health.stations,
            starts=self._starts,
            summary=summary,
        )


def _select(checked: Checked, args: argparse.Namespace) -> Checked:
    only, ignore = _words(args.only), _words(args.ignore)

    def wanted(finding: Finding) -> bool:
        code = finding.code.upper()
        return (not only or code.startswith(only)) and not (ignore and code.startswith(ignore))

    return checked.with_findings(tuple(finding for finding in checked.findings if wanted(finding)))


def _words(values: list[str]) -> tuple[str, ...]:
    return tuple(word.strip().upper() for value in values for word in value.split(",") if word.strip())


def _require_known(prefix: str) -> None:
    from sniff.analysis.judging import all_rules

    if not any(code.startswith(prefix) for code in all_rules()):
        raise Failure(f"{prefix}: no rule has that code or prefix; `sniff485 rule` lists them", USAGE)
