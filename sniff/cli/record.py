"""PORT: a serial port, socket://HOST:PORT, rfc2217://HOST:PORT, or a bus named in sniff485.toml. Ends on Ctrl-C,
SIGTERM, --duration or --count. A file cut off by a crash opens, and says where it ends.
"""

from __future__ import annotations

import argparse

from sniff.capture.config import RecordSpec
from sniff.cli import USAGE, Failure, arguments, listening


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `record`."""
    parser.add_argument("port", metavar="PORT", help="port, gateway, or a configured bus")
    arguments.add_line(parser, auto=True)
    arguments.add_devices(parser)
    parser.add_argument("-w", "--write", metavar="FILE", help="recording (.mcap); default: a new name in this folder")
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
    parser.add_argument("-q", "--quiet", action="store_true", help="no progress, no summary")


def run(args: argparse.Namespace) -> int:
    """Record until the end."""
    target = listening.target_of(args)
    path = args.write or target.record or listening.new_recording(target.source.bus)
    listening.refuse_recording(path)
    if args.keep and not args.rotate:
        raise Failure("--keep: of which rotation? say when a new file begins with --rotate size:64MB or time:1h", USAGE)
    record = RecordSpec(path, args.rotate, args.keep)
    live = listening.start(
        target.source, record, args.duration, target.devices, target.search, args.count, watched=False
    )
    try:
        printer = listening.Printer(live, quiet=True)
        code = listening.run(printer, not args.quiet)
    except KeyboardInterrupt:  # before anybody listened to signals: the capture must not go on
        live.stop()
        raise
    if not args.quiet:
        listening.say_end(printer)
    return code
