"""The terminal UI. Importing this package loads no Textual; `run` does."""

from __future__ import annotations

import sys

from sniff.bus.feed import Feed


def run(feed: Feed, start_screen: str = "frames") -> None:
    """Show a feed until the user quits; then say where a recording is. Closes the feed in every case."""
    from sniff.tui.app import SnifferApp

    try:
        SnifferApp(feed, start_screen).run()
        status = feed.status()
    finally:
        feed.close()
    if status.ended:
        sys.stdout.write(f"{_plain(status.port)}: {_plain(status.ended)}\n")
    recording = feed.status().recording  # as it is now that its files are closed
    if status.live and recording:
        sys.stdout.write(f"recorded to {_plain(recording)}\n")


def _plain(text: str) -> str:
    from sniff.tui.plain import plain

    return plain(text)
