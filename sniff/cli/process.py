"""The command line as the process that somebody started: `main`, with what only the owner of a process may set."""

from __future__ import annotations

import gc

from sniff.cli import main

MADE = 50_000
"""Objects made, less those gone, after which circles among the young ones are looked for."""


def run() -> int:
    """Run the command of this process; give its exit code.

    The imports of a short command make some thirty thousand objects that stay to the end. To look for circles among
    them each 700 (Python's own measure), and among all of them once more when it ends, took a seventh of its time.
    Circles that are left at the end go with the process: what must be closed or flushed is by those who opened it.
    """
    gc.set_threshold(MADE)
    try:
        return main()
    finally:
        gc.freeze()
