"""For recordings that were cut off or damaged: keeps all that can be read, marks the holes, says what was wrong."""

from __future__ import annotations

import argparse
import sys

from sniff.analysis.plain import plain
from sniff.cli import arguments, writing


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `recover`."""
    parser.add_argument("file", metavar="FILE", help="capture, damaged or not")
    arguments.add_bus(parser)
    writing.add_output(parser)
    arguments.add_reference(parser)


def run(args: argparse.Namespace) -> int:
    """Write a whole file."""
    from dataclasses import replace

    capture = arguments.open_capture(args.file)
    session = capture.session
    before = capture.completeness()
    if not before.whole:
        session = replace(session, notes={**session.notes, "recovered": before.text})
    writing.write(args, session, capture, [args.file])
    complete = capture.completeness()
    said = "was whole" if complete.whole else complete.text
    print(f"sniff485: {args.file}: {plain(said)}", file=sys.stderr)
    return 0
