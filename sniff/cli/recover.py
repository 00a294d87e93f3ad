"""For recordings that were cut off or damaged: keeps all that can be read, marks the holes, says what was wrong."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from sniff.analysis.sanitizing import sanitized
from sniff.cli import UNREADABLE, Failure, arguments, writing
from sniff.engine.capture import CaptureError


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `recover`."""
    parser.add_argument("file", metavar="FILE", help="capture, damaged or not")
    arguments.add_bus(parser)
    writing.add_output(parser)
    arguments.add_reference(parser)


def run(args: argparse.Namespace) -> int:
    """Write a whole file."""
    from dataclasses import replace

    if args.bus is None and args.output.lower().endswith(".mcap") and _buses_recorded(args.file) > 1:
        return _all_buses(args)
    capture = arguments.open_capture(args.file)
    session = capture.session
    before = capture.completeness()
    if not before.whole:
        session = replace(session, notes={**session.notes, "recovered": before.text})
    writing.write(args, session, capture, [args.file])
    complete = capture.completeness()
    said = "was whole" if complete.whole else complete.text
    print(f"sniff485: {sanitized(args.file)}: {sanitized(said)}", file=sys.stderr)
    return 0


def _buses_recorded(path: str) -> int:
    """How many buses a recording has; 0 for other files."""
    from sniff.recording.reader import buses_of

    try:
        return len(buses_of(path))
    except CaptureError:
        return 0


def _all_buses(args: argparse.Namespace) -> int:
    """A recording of several buses as one again."""
    from sniff.recording.recovery import recover

    writing.refuse_to_overwrite(Path(args.output), [args.file], args.force)
    try:
        before = recover(args.file, args.output)
    except CaptureError as error:
        raise Failure(str(error), UNREADABLE) from None
    said = "was whole" if before.whole else before.text
    print(f"sniff485: {sanitized(args.file)}: {sanitized(said)}", file=sys.stderr)
    return 0
