"""PORT: a serial port, socket://HOST:PORT, rfc2217://HOST:PORT, or a bus named in sniff485.toml. Ends on Ctrl-C,
SIGTERM, --duration or --count. Several ports are recorded by one process, on one clock, into one file; every command
reads such a file, one bus of it with --bus NAME. A file cut off by a crash opens, and says where it ends.
"""

from __future__ import annotations

import argparse

from sniff.analysis.sanitizing import sanitized
from sniff.capture.config import RecordSpec
from sniff.cli import USAGE, Failure, arguments, listening, outlets, printing, targets, telling
from sniff.cli.interruption import until_interrupted


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `record`."""
    parser.add_argument(
        "ports", nargs="*", metavar="PORT", help="port, gateway, or a configured bus; several go into one file"
    )
    parser.add_argument("--all", action="store_true", help="every bus of the configuration that has a port")
    arguments.add_line(parser, auto=True)
    arguments.add_devices(parser)
    arguments.add_recording(parser, "recording (.mcap); default: a new name in this folder")
    parser.add_argument("--duration", type=arguments.duration, metavar="TIME", help="stop after: 90, 90s, 5m, 2h")
    parser.add_argument("--count", type=arguments.positive, metavar="N", help="stop after N frames")
    parser.add_argument(
        "--rotate",
        type=arguments.rotation,
        metavar="RULE",
        help="begin a new file by size:64MB, time:1h, or both with a comma",
    )
    parser.add_argument(
        "--keep", type=arguments.positive, metavar="N", help="remove this recording's files but the N newest"
    )
    parser.add_argument(
        "--keep-free",
        type=arguments.octets,
        metavar="SIZE",
        help="keep so much of the disk free (1GB): the oldest parts of this name go first",
    )
    parser.add_argument(
        "--on",
        action="append",
        default=[],
        metavar="FILTER|CODE",
        help="a trigger: frames that match, or findings (MB001, MS104); marked in the recording; repeatable",
    )
    parser.add_argument("--before", type=arguments.duration, metavar="TIME", help="keep triggers, and so much before")
    parser.add_argument("--after", type=arguments.duration, metavar="TIME", help="and so much after; nothing else")
    parser.add_argument(
        "--json",
        action="store_const",
        const="-",
        dest="json_lines",
        help="values, findings and health on standard output: JSON Lines",
    )
    outlets.add_outlets(parser)
    parser.add_argument("-q", "--quiet", action="store_true", help="no progress, no summary; only what goes wrong")


def run(args: argparse.Namespace) -> int:
    """Record until the end."""
    buses = targets.targets_of(args)
    path = args.write or (buses[0].record if len(buses) == 1 else None)
    path = path or targets.new_recording("-".join(target.source.bus for target in buses[: targets.NAMED]))
    targets.refuse_recording(path)
    if (args.keep or args.keep_free) and not args.rotate:
        raise Failure(
            "--keep, --keep-free: of which rotation? say when a new file begins with --rotate size:64MB or time:1h",
            USAGE,
        )
    before, after = (None if each is None else int(each * 1e9) for each in (args.before, args.after))
    if not args.on and (before is not None or after is not None):
        raise Failure("--before, --after: round which trigger? say with --on FILTER or --on CODE", USAGE)
    telling.refuse_triggers(args.on, buses)
    told_to = outlets.prepare(outlets.settings_of(args))
    alert = targets.configured().alert  # before it begins: what becomes of the configuration then ends no capture
    record = RecordSpec(path, args.rotate, args.keep, before, after, args.keep_free)
    with until_interrupted():  # from before it begins: else it might go on with nobody who ends it
        lives = listening.start_all(buses, record, args.duration, args.count, watched=False)
        try:
            printers = [printing.Printer(live, quiet=True) for live in lives]
            telling.add_triggers(printers, args.on)
            with telling.alerting(printers, alert), outlets.telling(lives, told_to) as printers[0].telling:
                code = listening.run(printers, not args.quiet)
        except BaseException:
            lives[0].stop()
            raise
    if not args.quiet:
        listening.say_end(printers)
    else:  # what is lost is no summary
        for live in lives:
            listening.say_lost(live, "" if len(lives) == 1 else f"{sanitized(live.session.bus)}: ")
    return code
