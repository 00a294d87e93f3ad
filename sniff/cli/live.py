"""PORT: a serial port, socket://HOST:PORT, rfc2217://HOST:PORT, or a bus named in sniff485.toml. Records into this
folder unless --no-record; says the file's name at the end. Where output is no terminal, frames come as lines.
"""

from __future__ import annotations

import argparse
import sys

from sniff.analysis.plain import plain
from sniff.bus.live import LiveBus
from sniff.capture.config import RecordSpec
from sniff.cli import UNREADABLE, USAGE, Failure, arguments, listening, outlets, printing, targets


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `live`."""
    parser.add_argument(
        "port", nargs="?", metavar="PORT", help="port, gateway, or a configured bus; not needed for one"
    )
    arguments.add_line(parser, auto=True)
    arguments.add_devices(parser)
    parser.add_argument("-w", "--write", metavar="FILE", help="recording (.mcap); default: a new name in this folder")
    parser.add_argument("--no-record", action="store_true", help="do not record")
    parser.add_argument("--duration", type=arguments.duration, metavar="TIME", help="stop after: 90, 90s, 5m, 2h")
    parser.add_argument(
        "--json", action="store_true", help="JSON lines instead of the terminal UI: frames, values, findings, health"
    )
    parser.add_argument("--lines", action="store_true", help="lines of text instead of the terminal UI")
    outlets.add_outlets(parser)


def run(args: argparse.Namespace) -> int:
    """Listen and show."""
    target = targets.target_of(args)
    if args.no_record and args.write:
        raise Failure("--no-record and -w contradict each other", USAGE)
    path = None if args.no_record else args.write or target.record or targets.new_recording(target.source.bus)
    if path:
        targets.refuse_recording(path)
    told_to = outlets.prepare(outlets.settings_of(args), [outlets.Printed()] if args.json else ())
    live = listening.start(
        target.source, RecordSpec(path) if path else None, args.duration, target.devices, target.search
    )
    if path and not args.port:
        print(f"sniff485: recording to {plain(path)}", file=sys.stderr)
    return show(live, args.json, args.lines, told_to)


def show(live: LiveBus, as_json: bool, as_lines: bool, told_to: outlets.Telling | None) -> int:
    """The terminal UI on a terminal; else frames as lines and a summary. `told_to`: who is told of it meanwhile."""
    with outlets.telling([live], told_to) as telling:
        return _show(live, as_json, as_lines, telling)


def _show(live: LiveBus, as_json: bool, as_lines: bool, telling: outlets.Telling | None) -> int:
    if not as_json and not as_lines and arguments.on_terminal():
        from sniff.bus.row_source import LiveFeed
        from sniff.tui import run as run_tui

        feed = LiveFeed(live, lambda status: print(f"sniff485: {printing.waiting_words(status)}", file=sys.stderr))
        run_tui(feed)
        total = feed.store.load.total
        print(
            f"sniff485: {total.frames} frames ({total.damaged} damaged), {total.noise} octets of noise", file=sys.stderr
        )
        if live.engine.searching:
            listening.say_not_found(live, "ended")
        if live.status.error:
            print(f"sniff485: recording: {plain(live.status.error)}", file=sys.stderr)
        listening.say_recorded(live, where=False)
        return UNREADABLE if listening.lost_something(live) else 0
    printer = printing.Printer(live, as_json=as_json, colour=arguments.colour())
    printer.telling = telling
    code = listening.run([printer])
    listening.say_end([printer])
    return code
