"""JSON for the command line: one object a line, text as it is, except for what a terminal obeys or nobody sees."""

from __future__ import annotations

from sniff.analysis.json_text import dumps

__all__ = ["dumps"]
