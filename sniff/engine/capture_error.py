"""The error of a file that cannot be read or written as a capture."""

from __future__ import annotations


class CaptureError(Exception):
    """A file that cannot be read or written; the message names it, what is wrong and the way out."""
