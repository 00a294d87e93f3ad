"""The terminal UI. Importing this package loads no Textual; `run` does."""

from __future__ import annotations

import gc
import sys
from collections.abc import Sequence

from sniff.bus.feed import Feed


def run(feed: Feed | Sequence[Feed], start_screen: str = "frames") -> None:
    """Show a feed, or those of several buses, until the user quits; then say where a recording is. Closes the feeds in
    every case. Raises what broke it, once the terminal is as it was and all is said."""
    from sniff.tui.app import SnifferApp
    from sniff.tui.hangup import ending_at_hangup

    feeds = feed if isinstance(feed, Sequence) else [feed]
    try:
        app = SnifferApp(feeds, start_screen)
        app.is_alone = True
        gc.freeze()  # what was imported stays: looking through it again and again slows the first seconds
        with ending_at_hangup():
            app.run()
        ended = [(status.port, status.ended) for status in (each.status() for each in feeds) if status.ended]
        broken = app.broken_by
    finally:
        unclosed = _close(feeds)
    for port, why in ended:
        sys.stdout.write(f"{_plain(port)}: {_plain(why)}\n")
    now = [each.status() for each in feeds]  # as it is now that the files are closed
    for recording in dict.fromkeys(status.recording for status in now if status.live and status.recording):
        sys.stdout.write(f"recorded to {_plain(recording)}\n")
    wrong = broken or unclosed
    if wrong is not None:
        raise wrong


def _close(feeds: Sequence[Feed]) -> Exception | None:
    """Close each, whatever becomes of another; what was wrong with the first that could not be closed well."""
    wrong: Exception | None = None
    for each in feeds:
        try:
            each.close()
        except Exception as error:  # what judges and reads the last rows runs then, plug-ins too
            wrong = wrong or error
    return wrong


def _plain(text: str) -> str:
    from sniff.analysis.sanitizing import sanitized

    return sanitized(text)
