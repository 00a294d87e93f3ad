"""A hang-up: the terminal is gone, and whoever draws on it ends as if SIGHUP had reached him.

The signal goes to the leader of a terminal's session and, when he ends, to those in front; below a leader that stays
(`make`, `sudo`) nobody tells us. Textual would then read the end of the input again and again for ever.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import sys
import threading
from collections.abc import Iterator

LOOK = 1000
"""Milliseconds between two looks at whether somebody still draws."""


@contextlib.contextmanager
def ending_at_hangup() -> Iterator[None]:
    """While this lasts, the end of the terminal at standard input ends the process: by SIGHUP, or with 129 (128 and
    that signal's number) where it is ignored. A recording is the capture process's own, which goes on. Does nothing
    where standard input is no terminal, and on systems without `poll`."""
    if not (hasattr(select, "poll") and sys.stdin.isatty()):
        yield
        return
    done = threading.Event()
    threading.Thread(target=_watch, args=(sys.stdin.fileno(), done), name="hang-up", daemon=True).start()
    try:
        yield
    finally:
        done.set()


def _watch(terminal: int, done: threading.Event) -> None:
    poll = select.poll()
    poll.register(terminal, 0)  # nothing that may be read: POLLHUP comes unasked
    while not done.is_set():
        events = sum(event for _, event in poll.poll(LOOK))
        if done.is_set():
            return
        if events & select.POLLHUP:
            os.kill(os.getpid(), signal.SIGHUP)
            os._exit(128 + signal.SIGHUP)  # it is ignored, and there is nobody to tell anything
        if events:  # some systems do not poll terminals, and would say so again and again
            return
