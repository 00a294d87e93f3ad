"""PORT: a serial port, socket://HOST:PORT, rfc2217://HOST:PORT, or a bus named in sniff485.toml. Several are listened
to by one process, on one clock; a bar shows them all, and `b` goes from one to the next. Records into one file in this
folder unless --no-record; says the file's name at the end. Where output is no terminal, frames come as lines.
"""

from __future__ import annotations

import argparse
import contextlib
import sys
from collections.abc import Sequence
from dataclasses import replace

from dissectors.findings import counted
from sniff.analysis.sanitizing import sanitized
from sniff.bus.live import LiveBus
from sniff.capture.config import RecordSpec
from sniff.capture.ipc import Status
from sniff.cli import UNREADABLE, USAGE, Failure, arguments, listening, outlets, printing, targets
from sniff.cli.interruption import until_interrupted


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `live`."""
    parser.add_argument(
        "ports", nargs="*", metavar="PORT", help="ports, gateways, or configured buses; not needed for one"
    )
    parser.add_argument(
        "--all", action="store_true", help="every configured bus that has a port; one not there is waited for"
    )
    arguments.add_line(parser, auto=True)
    arguments.add_devices(parser)
    arguments.add_recording(parser, "recording (.mcap); default: a new name in this folder")
    parser.add_argument("--no-record", action="store_true", help="do not record")
    parser.add_argument("--duration", type=arguments.duration, metavar="TIME", help="stop after: 90, 90s, 5m, 2h")
    parser.add_argument(
        "--json", action="store_true", help="JSON lines instead of the terminal UI: frames, values, findings, health"
    )
    parser.add_argument("--lines", action="store_true", help="lines of text instead of the terminal UI")
    outlets.add_outlets(parser)


def run(args: argparse.Namespace) -> int:
    """Listen and show."""
    buses = targets.targets_of(args)
    if args.no_record and args.write:
        raise Failure("--no-record and -w contradict each other", USAGE)
    configured = buses[0].record if len(buses) == 1 else None
    named = "-".join(target.source.bus for target in buses[: targets.NAMED])
    path = None if args.no_record else args.write or configured or targets.new_recording(named)
    if path:
        targets.refuse_recording(path)
    if args.all:  # one that is not there yet is waited for; one that was named must be there
        buses = [replace(one, source=replace(one.source, patient=True)) for one in buses]
    told_to = outlets.prepare(outlets.settings_of(args), [outlets.Printed()] if args.json else ())
    has_screen = not args.json and not args.lines and arguments.on_terminal()  # which has signals of its own
    with contextlib.nullcontext() if has_screen else until_interrupted():
        lives = listening.start_all(buses, RecordSpec(path) if path else None, args.duration)
        if path and not args.ports:
            print(f"sniff485: recording to {sanitized(path)}", file=sys.stderr)
        return show(lives, args.json, args.lines, told_to)


def show(lives: Sequence[LiveBus], as_json: bool, as_lines: bool, told_to: outlets.Telling | None) -> int:
    """The terminal UI on a terminal; else frames as lines and a summary. `told_to`: who is told of it meanwhile."""
    with outlets.telling(lives, told_to) as telling:
        return _show(lives, as_json, as_lines, telling)


def _show(lives: Sequence[LiveBus], as_json: bool, as_lines: bool, telling: outlets.Telling | None) -> int:
    if not as_json and not as_lines and arguments.on_terminal():
        return _on_screen(lives)
    printers = [printing.Printer(live, as_json=as_json, colour=arguments.colour()) for live in lives]
    for printer in printers:
        printer.names_bus = len(printers) > 1
    printers[0].telling = telling
    code = listening.run(printers)
    listening.say_end(printers)
    return code


def _on_screen(lives: Sequence[LiveBus]) -> int:
    from sniff.bus.row_source import LiveFeed
    from sniff.tui import run as run_tui

    def tell(status: Status) -> None:
        print(f"sniff485: {printing.waiting_words(status)}", file=sys.stderr)

    feeds = [LiveFeed(live, tell, len(lives)) for live in lives]
    run_tui(feeds)
    for feed, live in zip(feeds, lives, strict=True):
        bus = f"{sanitized(live.session.bus)}: " if len(lives) > 1 else ""
        total = feed.store.load.total
        print(
            f"sniff485: {bus}{counted(total.frames, 'frame')} ({total.damaged} damaged), "
            f"{counted(total.noise, 'octet')} of noise",
            file=sys.stderr,
        )
        if live.engine.searching:
            listening.say_not_found(live, "ended")
        if live.status.error:
            print(f"sniff485: recording: {sanitized(live.status.error)}", file=sys.stderr)
        listening.say_recorded(live, where=False, bus=bus)
    return UNREADABLE if any(listening.lost_something(live) for live in lives) else 0
