"""Completion for shells, by shtab."""

from __future__ import annotations

import argparse

import shtab

from docs.generate.commands import every_parser, whole_parser
from sniff.cli.completion import SCRIPTS

FILES = {"FILE", "FILES", "OUT", "IN", "CAPTURE", "BEFORE", "AFTER", "A", "B", "WRITE", "FILE|PORT", "FILE|PORT|BUS"}
FOLDERS = {"FOLDER", "DIRECTORY"}


def completions() -> dict[str, str]:
    """Places below the prefix, and the scripts that belong there."""
    parser = whole_parser()
    for one in every_parser(parser):
        for action in one._actions:
            _teach(action)
    return {place: shtab.complete(parser, shell) for shell, place in SCRIPTS.items()}


def _teach(action: argparse.Action) -> None:
    """Say what an argument takes, where its name says it."""
    from dissectors import registry
    from sniff.analysis.judging import all_rules

    metavar = action.metavar if isinstance(action.metavar, str) else ""
    if action.choices is not None:
        return
    if metavar in FOLDERS:
        action.complete = shtab.DIRECTORY  # type: ignore[attr-defined]
    elif metavar == "PROTOCOL":
        action.choices = (*registry.BUILT_IN, "auto")
    elif metavar == "CODE" and not action.option_strings:
        action.choices = tuple(sorted(all_rules()))
    elif metavar in FILES or not action.option_strings:
        action.complete = shtab.FILE  # type: ignore[attr-defined]
