"""Arguments that several commands share, and how they become values."""

from __future__ import annotations

import argparse
import sys

from dissectors import registry
from dissectors.line import LineSettings
from sniff.cli import UNREADABLE, USAGE, Failure
from sniff.formats import Capture, CaptureError, read
from sniff.session import Session


def add_line(parser: argparse.ArgumentParser) -> None:
    """-s and -p, the same everywhere."""
    parser.add_argument(
        "-s", "--line", type=line_settings, metavar="LINE", help="line settings, for instance 19200,8E1 or 9600,8N1"
    )
    parser.add_argument(
        "-p", "--protocol", type=protocol, metavar="PROTOCOL", help=f"one of {', '.join(registry.BUILT_IN)}"
    )


def add_files(parser: argparse.ArgumentParser) -> None:
    """One or more captures."""
    parser.add_argument(
        "files", nargs="+", metavar="FILE", help="capture: .mcap, .cap.txt; - for text on standard input"
    )


def line_settings(token: str) -> LineSettings:
    """argparse type for -s."""
    try:
        return LineSettings.parse(token)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def protocol(name: str) -> str:
    """argparse type for -p."""
    if name not in registry.names():
        raise argparse.ArgumentTypeError(f"unknown protocol {name!r}; expected one of {', '.join(registry.names())}")
    return name


def duration(text: str) -> float:
    """argparse type for a duration in seconds: "90", "90s", "5m", "2h"."""
    units = {"s": 1, "m": 60, "h": 3600, "d": 86400}
    number, factor = (text[:-1], units[text[-1]]) if text[-1:] in units else (text, 1)
    try:
        seconds = float(number) * factor
    except ValueError:
        seconds = -1.0
    if not 0 < seconds < 10 * 365 * 86400:
        raise argparse.ArgumentTypeError(f"duration {text!r}: expected seconds, or a number with s, m, h or d")
    return seconds


def open_capture(path: str) -> Capture:
    """Open a capture, or end with exit code 3 (2 for an unknown suffix)."""
    try:
        return read(path)
    except CaptureError as error:
        raise Failure(str(error), USAGE if "unknown suffix" in str(error) else UNREADABLE) from None


def settings_of(args: argparse.Namespace, session: Session) -> Session:
    """The session with -s and -p applied; ends with exit code 2 when its protocol is unknown here."""
    from sniff.reading import dissector_for, with_settings

    session = with_settings(session, args.protocol, args.line)
    try:
        dissector_for(session)
    except registry.UnknownProtocol as error:
        raise Failure(f"{error}; say which with -p", USAGE) from None
    return session


def colour() -> bool:
    """Whether standard output takes colour: a terminal, and NO_COLOR is not set."""
    import os

    return sys.stdout.isatty() and "NO_COLOR" not in os.environ


def on_terminal() -> bool:
    """Whether there is a whole terminal for the terminal UI, which draws through standard error."""
    return sys.stdin.isatty() and sys.stdout.isatty() and sys.stderr.isatty()
