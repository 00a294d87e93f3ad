"""Times: seconds from the start (+12.5, 90s, 5m), a time of day (10:00:12.5, UTC) or ISO 8601 (2026-03-01T10:00:12.5Z).
Frames: numbers as `show` has them.
--around takes the code of a finding, as `check` has it, and cuts from its first to its last evidence.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from sniff.cli import USAGE, Failure, arguments, filtering, writing
from sniff.cli.incomplete import say_incomplete
from sniff.cli.progress import Watched


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `cut`."""
    parser.add_argument("file", metavar="FILE", help="capture")
    arguments.add_bus(parser)
    writing.add_output(parser)
    arguments.add_line(parser)
    arguments.add_reference(parser)
    filtering.add_filter(parser, "of it only the octets of frames that match; alone: of the whole capture")
    parser.add_argument("--from", dest="since", metavar="TIME", help="begin here")
    parser.add_argument("--to", dest="until", metavar="TIME", help="end here")
    parser.add_argument("--frames", metavar="A-B", help="these frames")
    parser.add_argument("--around", metavar="CODE", help="around the evidence of a finding")
    parser.add_argument(
        "--margin", type=arguments.margin, default=None, metavar="TIME", help="more on both sides (--around: 2s)"
    )


def run(args: argparse.Namespace) -> int:
    """Cut one stretch out."""
    from sniff.editing import cutting

    chosen = [bool(args.since or args.until), bool(args.frames), bool(args.around)]
    if sum(chosen) > 1 or not (sum(chosen) or args.filter):
        raise Failure("say what to keep: --from and --to, or --frames, or --around", USAGE)
    capture = arguments.open_capture(args.file)
    session = arguments.settings_of(args, capture.session, args.file)
    if (args.since or args.until or args.margin) and not session.has_times:
        raise Failure(f"{args.file} does not say when anything came; choose by --frames, --around or -Y", USAGE)
    watched = Watched(capture)
    try:
        if args.frames:
            stretch = cutting.of_frames(watched, session, args.frames, args.reference)
        elif args.around:
            stretch = cutting.around_finding(watched, session, args.around, args.reference)
        else:
            first = cutting.parse_time(args.since, session) if args.since else -cutting.FOREVER
            last = cutting.parse_time(args.until, session) if args.until else cutting.FOREVER
            if first > last:
                raise ValueError(f"--from {args.since} is after --to {args.until}")
            stretch = cutting.Stretch(first, last)
    except ValueError as error:
        raise Failure(str(error), USAGE) from None
    margin = args.margin if args.margin is not None else 2.0 if args.around else 0.0
    stretch = stretch.widened(int(margin * 1e9))
    cut = cutting.CutOut(filtering.sifted(args, capture, session), stretch, session.line.char)
    nothing = Failure(f"{args.file}: nothing in that stretch; nothing is written", USAGE)
    output = Path(args.output)
    if args.force and output.is_file() and filtering.is_empty(cut):  # what is there is lost as soon as writing begins
        raise nothing
    if not writing.write(args, session, cut, [args.file]):
        if output.is_file():
            output.unlink()
        raise nothing
    say_incomplete(args.file, capture)
    return 0
