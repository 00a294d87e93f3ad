"""The suffix of OUT chooses the format. With - as OUT a text capture goes to standard output."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from dissectors.frame import Chunk
from sniff.cli import UNREADABLE, USAGE, Failure, arguments
from sniff.formats import CaptureError, create


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `convert`."""
    parser.add_argument("source", metavar="IN", help="capture to read")
    parser.add_argument("target", metavar="OUT", help="capture to write")
    arguments.add_line(parser)
    parser.add_argument(
        "--link-type",
        type=int,
        choices=[147, 165, 250, 252],
        help="pcap, pcapng: 252 exported PDU (default for Modbus RTU; opens in Wireshark as it is), 147 bare RTU "
        "(needs a DLT_USER entry for mbrtu), 250 RTAC serial with line errors (Decode As: RTAC Serial → Modbus RTU), "
        "165 MS/TP",
    )
    parser.add_argument("-f", "--force", action="store_true", help="overwrite OUT")


def run(args: argparse.Namespace) -> int:
    """Read, write, say what was lost."""
    source = arguments.open_capture(args.source)
    session = arguments.settings_of(args, source.session)
    target = Path(args.target)
    if target.exists() and not args.force and not target.is_char_device():
        raise Failure(f"{target}: exists; add --force to overwrite it", USAGE)
    if args.source != "-" and target.exists() and Path(args.source).samefile(target):
        raise Failure(f"{target}: is the capture to read; name another file", USAGE)
    options = {"link-type": str(args.link_type)} if args.link_type is not None else None
    chunks = octets = 0
    progress = _Progress(args.source)
    try:
        with create(target, session, options) as writer:
            for item in source.items():
                writer.write(item)
                if isinstance(item, Chunk):
                    chunks += 1
                    octets += len(item.octets)
                    progress.show(chunks)
    except CaptureError as error:
        raise Failure(str(error), UNREADABLE) from None
    progress.end()
    print(f"{target}: {octets} octets in {chunks} reads", file=sys.stderr)
    for loss in getattr(writer, "losses", ()):
        print(f"sniff485: {target}: {loss}", file=sys.stderr)
    complete = source.completeness()
    if not complete.whole:
        print(f"sniff485: {args.source}: {complete.text}", file=sys.stderr)
    return 0


class _Progress:
    """Says on a terminal, twice a second, how far a long conversion is."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.next = time.monotonic() + 1
        self.shown = False

    def show(self, chunks: int) -> None:
        if chunks % 1024 or not sys.stderr.isatty() or time.monotonic() < self.next:
            return
        self.next = time.monotonic() + 0.5
        self.shown = True
        print(f"\r{self.name}: {chunks} reads", end="", file=sys.stderr, flush=True)

    def end(self) -> None:
        if self.shown:
            print("\r\x1b[K", end="", file=sys.stderr)
