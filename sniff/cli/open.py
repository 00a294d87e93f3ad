"""Keys are shown at the foot of the screen and under `?`. Several captures are shown one after the other,
the parts of one recording as one."""

from __future__ import annotations

import argparse

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
    from sniff.tui import run as run_tui

    for path, capture in captures:
        session = arguments.settings_of(args, capture.session, path)
        run_tui(FileFeed(path, capture, session, arguments.noted_devices(args, session)))
    return 0
