"""Before and after a repair: stations, answers, times, values, findings. A time counts as changed when it moved by a
tenth and by more than both adapters together may have added (p50 of 3 answers and more on both sides, p95 of 20); a
value when the newest readings before and after have no number in common. Exit code 1 when something differs.
"""

from __future__ import annotations

import argparse

from sniff.analysis.summary import Summary
from sniff.bus.model import BusModel
from sniff.bus.offline import survey
from sniff.cli import arguments, filtering, tables
from sniff.cli.incomplete import say_incomplete
from sniff.cli.progress import Watched
from sniff.devices import noted_devices
from sniff.engine.follow_settings import dissector_for


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `diff`."""
    parser.add_argument("before", metavar="BEFORE", help="capture")
    parser.add_argument("after", metavar="AFTER", help="capture")
    arguments.add_bus(parser)
    arguments.add_devices(parser)
    arguments.add_reference(parser)
    filtering.add_filter(parser, "only what matches, and exchanges with a frame that does")
    style = parser.add_mutually_exclusive_group()
    style.add_argument("--json", action="store_const", const="json", dest="style", help="one JSON object a difference")
    style.add_argument("--csv", action="store_const", const="csv", dest="style", help="comma-separated values")
    parser.set_defaults(style="text")


def run(args: argparse.Namespace) -> int:
    """Compare two captures."""
    from sniff.editing.comparing import Side, differences

    said = arguments.devices_of(args)
    sides = []
    for path in (args.before, args.after):
        capture = arguments.open_capture(path)
        session = capture.session
        model = BusModel(session, dissector_for(session), said.over(noted_devices(session)))
        survey(Watched(capture), session, model, reference=args.reference)
        arguments.say_assumed(session, path)
        say_incomplete(path, capture)
        summary, points = model.summary, tuple(model.points)
        if args.filter:
            counted = BusModel(session, dissector_for(session), model.devices)
            taken = Summary(session.line)
            filtering.surveyed(args, capture, session, counted, every_row=True, devices=model.devices)
            filtering.surveyed(args, capture, session, taken, devices=model.devices)
            summary, points = taken, tuple(counted.points)
        findings = filtering.shown_findings(args, capture, session, model.findings(), model.devices)
        line = "" if session.line_is_assumed else str(session.line)
        spoken = dissector_for(session)
        has_times, latency = session.has_times, session.adapter.latency
        sides.append(Side(path, summary, findings, latency, points, spoken.title, line, has_times, spoken.noun))
    found = list(differences(*sides))
    rows = [(one.subject, one.what, one.before, one.after) for one in found]
    if rows or args.style != "text":
        tables.write(("subject", "what", "before", "after"), rows, args.style)
    else:
        print("no difference worth saying")
    return 1 if found else 0
