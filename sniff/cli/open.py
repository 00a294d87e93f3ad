"""Keys are shown at the foot of the screen and under `?`. Several captures are shown one after the other,
the parts of one recording as one, its buses beside each other: `b` goes from one to the next."""

from __future__ import annotations

import argparse
from collections import Counter

from sniff.cli import USAGE, Failure, arguments


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `open`."""
    arguments.add_files(parser)
    arguments.add_line(parser)
    arguments.add_devices(parser)


def run(args: argparse.Namespace) -> int:
    """Show captures in the terminal UI."""
    captures = arguments.open_captures(args.files)
    if not arguments.on_terminal():
        raise Failure("open needs a terminal; use `sniff485 show` for text", USAGE)
    from sniff.bus.file_source import FileFeed
    from sniff.bus.site import site_name
    from sniff.tui import run as run_tui

    sites: dict[str, list[FileFeed]] = {}
    shares = Counter(site_name(path) for path, _ in captures)
    for path, capture in captures:
        session, name = arguments.settings_of(args, capture.session, path), site_name(path)
        feed = FileFeed(path, capture, session, arguments.noted_devices(args, session), shares[name])
        sites.setdefault(name, []).append(feed)
    for feeds in sites.values():
        run_tui(feeds)
    return 0
