"""Captures that end too early: said on standard error, after what was printed of them."""

from __future__ import annotations

import sys

from sniff.analysis.sanitizing import sanitized
from sniff.engine.capture import Capture
from sniff.formats import cut_capture


def say_incomplete(path: str, capture: Capture) -> None:
    """Where a capture that was read ends too early."""
    complete = capture.completeness()
    if not complete.whole:
        say_why(path, complete.text)
        cut_capture.said(path)


def say_why(path: str, why: str) -> None:
    """Why what was printed of a capture is not all."""
    sys.stdout.flush()
    print(f"sniff485: {sanitized(path)}: {sanitized(why)}", file=sys.stderr)
