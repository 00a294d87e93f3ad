"""Everything but the octets and their times is computed anew, with -s and -p where they are given, and written beside
them. What was found is kept in the file: as long as neither it nor the program changes, all commands take it from there
and read a large or damaged capture in a fraction of the time; --reference finds it anew.
"""

from __future__ import annotations

import argparse

from sniff.cli import USAGE, Failure, arguments, writing
from sniff.cli.incomplete import say_incomplete


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `redissect`."""
    parser.add_argument("file", metavar="FILE", help="capture")
    arguments.add_bus(parser)
    writing.add_output(parser)
    arguments.add_line(parser)
    arguments.add_reference(parser)


def run(args: argparse.Namespace) -> int:
    """Write the capture with what is found in it."""
    if not str(args.output).lower().endswith(".mcap"):
        raise Failure(f"{args.output}: only .mcap holds what was found; for other formats use convert", USAGE)
    capture = arguments.open_capture(args.file)
    session = arguments.settings_of(args, capture.session, args.file)
    writing.write(args, session, capture, [args.file], with_frames=True)
    say_incomplete(args.file, capture)
    return 0
