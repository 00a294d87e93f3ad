"""Keys are shown at the foot of the screen and under `?`. Several captures are shown one after the other,
the parts of one recording as one, its buses beside each other: `b` goes from one to the next. --follow shows a
recording while another process writes it, a second behind the bus.
"""

from __future__ import annotations

import argparse
import gc
from collections import Counter
from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING

from sniff.analysis.sanitizing import sanitized
from sniff.cli import UNREADABLE, USAGE, Failure, arguments

if TYPE_CHECKING:
    from sniff.bus.file_source import FileFeed

SAID = 76
"""Characters of what is said at the start: a line of a terminal."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `open`."""
    arguments.add_files(parser)
    arguments.add_line(parser)
    arguments.add_devices(parser)
    parser.add_argument("--follow", action="store_true", help="go on with what is still being recorded into FILE")


def run(args: argparse.Namespace) -> int:
    """Show captures in the terminal UI."""
    if args.follow:
        return _follow(args)
    _say_begin(args.files)
    gc.disable()  # what is imported stays: looking through it meanwhile is a tenth of the time until the first screen
    try:
        from sniff.tui import run

        import_module("sniff.tui.app")
        sites = _feeds(args)
    finally:
        gc.enable()
    for feeds in sites:
        run(feeds)
    return 0


def _say_begin(files: Sequence[str]) -> None:
    """A terminal says at once what is done: the first screen takes a while."""
    if arguments.on_terminal():
        said = sanitized(f"sniff485: opening {', '.join(files)}")
        print(said if len(said) <= SAID else said[: SAID - 1] + "…", flush=True)


def _feeds(args: argparse.Namespace) -> list[list[FileFeed]]:
    """The captures of each recording."""
    captures = arguments.open_captures(args.files)
    if not arguments.on_terminal():
        raise Failure("open needs a terminal; use `sniff485 show` for text", USAGE)
    from sniff.bus.file_source import FileFeed
    from sniff.bus.site import site_name

    sites: dict[str, list[FileFeed]] = {}
    shares = Counter(site_name(path) for path, _ in captures)
    for path, capture in captures:
        session, name = arguments.settings_of(args, capture.session, path), site_name(path)
        feed = FileFeed(path, capture, session, arguments.noted_devices(args, session), shares[name])
        sites.setdefault(name, []).append(feed)
    return list(sites.values())


def _follow(args: argparse.Namespace) -> int:
    """A recording that grows is a source like a port, which is not recorded again."""
    if len(args.files) > 1:
        raise Failure("--follow: one recording at a time", USAGE)
    from sniff.bus.row_source import LiveFeed
    from sniff.capture.config import SourceSpec
    from sniff.cli import listening
    from sniff.engine.capture import CaptureError
    from sniff.recording.following import Following
    from sniff.tui import run as run_tui

    path = args.files[0]
    try:
        session = arguments.settings_of(args, Following(path).session, path)
    except CaptureError as error:
        raise Failure(str(error), UNREADABLE) from None
    if session.unknown:
        raise Failure(f"{path}: its settings are still being searched for; try again, or name them with -s, -p", USAGE)
    if not arguments.on_terminal():
        raise Failure("open needs a terminal; use `sniff485 show` for text", USAGE)
    devices = arguments.noted_devices(args, session)
    bus = session.bus or "bus"
    live = listening.start(SourceSpec(f"follow:{path}", session.line, session.protocol, bus), None, devices=devices)
    run_tui(LiveFeed(live, follows=path))
    return 0
