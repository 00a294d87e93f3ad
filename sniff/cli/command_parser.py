"""The parser of the command line: what is wrong with it is one line, and where to read more."""

from __future__ import annotations

import argparse
from typing import NoReturn


class CommandParser(argparse.ArgumentParser):
    """argparse's, but for a usage of ten lines before the one that says what is wrong."""

    def error(self, message: str) -> NoReturn:
        """Say it, and end with exit code 2."""
        from sniff.analysis.sanitizing import sanitized  # most command lines have no fault

        self.exit(2, f"{self.prog}: {sanitized(message)}; `{self.prog} --help` says more\n")
