"""For assistants that speak the Model Context Protocol: they start this command themselves, and talk to it over
standard input and output. It tells of these captures and of nothing else: what is in them, findings with their
evidence, frames, stations, values, the master's programme. It only reads; answers are bounded, and what comes from the
wire is marked as data. It needs `pip install 'sniff485[mcp]'`.
"""

from __future__ import annotations

import argparse
import os

from sniff.cli import UNREADABLE, USAGE, Failure


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `mcp`."""
    parser.add_argument("files", nargs="+", metavar="FILE", help="captures that may be asked about")


def run(args: argparse.Namespace) -> int:
    """Answer until standard input ends."""
    try:
        import mcp  # noqa: F401
    except ImportError:
        raise Failure("this needs the library mcp: pip install 'sniff485[mcp]'", USAGE) from None
    from sniff.assistant.asking import Asking
    from sniff.assistant.captures import Captures
    from sniff.assistant.server import server

    for path in args.files:
        if not os.path.isfile(path):
            raise Failure(f"{path}: no such file", UNREADABLE)
    server(Captures(args.files), Asking()).run("stdio")
    return 0
