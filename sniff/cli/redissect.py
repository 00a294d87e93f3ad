"""Everything but the octets and their times is computed anew, with -s and -p where they are given, and written beside
them, so that other programs see the same frames as this one. Without new settings nothing changes.
"""

from __future__ import annotations

import argparse

from sniff.cli import USAGE, Failure, arguments, writing


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `redissect`."""
    parser.add_argument("file", metavar="FILE", help="capture")
    arguments.add_bus(parser)
    writing.add_output(parser)
    arguments.add_line(parser)
    arguments.add_reference(parser)


def run(args: argparse.Namespace) -> int:
    """Write the capture with what is found in it today."""
    if not str(args.output).lower().endswith(".mcap"):
        raise Failure(f"{args.output}: only .mcap holds what was found; for other formats use convert", USAGE)
    capture = arguments.open_capture(args.file)
    session = arguments.settings_of(args, capture.session, args.file)
    writing.write(args, session, capture, [args.file], with_frames=True)
    writing.say_incomplete(args.file, capture)
    return 0
