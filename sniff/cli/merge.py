"""The captures must be of one bus with the same settings: parts of a rotation, or several days."""

from __future__ import annotations

import argparse
import sys
from collections import Counter

from dissectors.findings import counted
from dissectors.frame import Chunk
from sniff.cli import UNREADABLE, Failure, arguments, writing
from sniff.cli.incomplete import say_incomplete
from sniff.engine.capture import CaptureError


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `merge`."""
    arguments.add_files(parser)
    arguments.add_reference(parser)
    writing.add_output(parser)


def run(args: argparse.Namespace) -> int:
    """Merge by time."""
    from sniff.editing.merging import merged, merged_session

    opened = arguments.open_parts(args.files)
    captures = [capture for _, capture in opened]
    try:
        session = merged_session(captures, [name for name, _ in opened])
    except CaptureError as error:
        raise Failure(str(error), UNREADABLE) from None
    arguments.say_assumed(session, args.files[0])
    shared: Counter[type] = Counter()
    writing.write(args, session, writing.Items(merged(captures, lambda item: shared.update([type(item)]))), args.files)
    if shared[Chunk]:
        print(f"sniff485: {counted(shared[Chunk], 'read')} in more than one capture, written once", file=sys.stderr)
    for path, capture in opened:
        say_incomplete(path, capture)
    return 0
