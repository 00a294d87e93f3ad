"""The parser of the command line: what is wrong with it is one line, and where to read more."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any, NoReturn

_MANY = ("+", "*")


class CommandParser(argparse.ArgumentParser):
    """argparse's, but for a usage of ten lines before the one that says what is wrong, and for files that stand on
    both sides of an option: argparse takes the first of them for all."""

    _is_mixing = False

    def error(self, message: str) -> NoReturn:
        """Say it, and end with exit code 2."""
        from sniff.analysis.sanitizing import sanitized  # most command lines have no fault

        self.exit(2, f"{self.prog}: {sanitized(message)}; `{self.prog} --help` says more\n")

    def parse_known_args(  # type: ignore[override]  # argparse's has four overloads for its namespaces
        self, args: Sequence[str] | None = None, namespace: Any = None
    ) -> tuple[Any, list[str]]:
        """As argparse has it; where words are left over and there may be any number of them, once more for these."""
        parsed = super().parse_known_args(args, namespace)
        words_left = any(not word.startswith("-") for word in parsed[1])
        if self._is_mixing or not words_left or not any(one.nargs in _MANY for one in self._get_positional_actions()):
            return parsed
        self._is_mixing = True  # what follows asks this method twice
        try:
            return self.parse_known_intermixed_args(args, None)
        finally:
            self._is_mixing = False
