"""For captures that go to somebody else: stations get other addresses, texts are blanked, checksums are made right
again. Times, damage, values and findings stay.
"""

from __future__ import annotations

import argparse

from sniff.cli import USAGE, Failure, arguments, writing
from sniff.cli.incomplete import say_incomplete


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `anonymise`."""
    parser.add_argument("file", metavar="FILE", help="capture")
    arguments.add_bus(parser)
    writing.add_output(parser)
    arguments.add_line(parser)
    arguments.add_reference(parser)


def run(args: argparse.Namespace) -> int:
    """Write the capture under other names."""
    from sniff.editing import anonymising

    capture = arguments.open_capture(args.file)
    session = arguments.settings_of(args, capture.session, args.file)
    if not anonymising.knows(session.protocol):
        raise Failure(f"anonymise: does not know where {session.protocol} keeps addresses and texts", USAGE)
    items = writing.Items(anonymising.anonymised(capture.items(), session))
    writing.write(args, anonymising.anonymous_session(session), items, [args.file])
    say_incomplete(args.file, capture)
    return 0
