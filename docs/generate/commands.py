"""The command line as values: every command, its arguments and what they do, read from the parsers themselves."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

WIDTH = 96
"""Columns of a usage line."""


@dataclass(frozen=True, slots=True)
class Argument:
    """One argument: how it is written ("-s LINE, --line LINE"), and what it does."""

    written: str
    says: str


@dataclass(frozen=True, slots=True)
class Group:
    """Arguments under one title of the help."""

    title: str
    arguments: tuple[Argument, ...]


@dataclass(frozen=True, slots=True)
class Command:
    """A command. `words`: as typed behind the program. `text`: what stands below its help. `parts`: its commands."""

    words: tuple[str, ...]
    summary: str
    usage: str
    groups: tuple[Group, ...]
    text: str
    parts: tuple[Command, ...]

    @property
    def name(self) -> str:
        """As it is typed."""
        return " ".join(("sniff485", *self.words))


def whole_parser() -> argparse.ArgumentParser:
    """The parser with the options of all commands; nothing of it depends on a terminal."""
    from sniff.cli import command_line

    parser, _ = command_line()
    for one in every_parser(parser):
        one.formatter_class = partial(argparse.RawDescriptionHelpFormatter, width=WIDTH)  # type: ignore[assignment]
        if hasattr(one, "color"):  # Python 3.14
            one.color = False
    return parser


def all_commands() -> Command:
    """The program, with its commands as parts."""
    return _command((), whole_parser(), "")


def every_parser(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    """A parser and those of its commands."""
    yield parser
    for sub in _parts(parser):
        for one in sub.choices.values():
            yield from every_parser(one)


def _parts(parser: argparse.ArgumentParser) -> list[argparse._SubParsersAction[argparse.ArgumentParser]]:
    return [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]


def _command(words: tuple[str, ...], parser: argparse.ArgumentParser, said: str) -> Command:
    formatter = parser._get_formatter()
    groups = []
    for group in parser._action_groups:
        arguments = tuple(
            Argument(formatter._format_action_invocation(action), formatter._expand_help(action) if action.help else "")
            for action in group._group_actions
            if action.help is not argparse.SUPPRESS and not isinstance(action, argparse._SubParsersAction)
        )
        if arguments:
            groups.append(Group(group.title or "", arguments))
    parts = []
    for sub in _parts(parser):
        texts = {choice.dest: choice.help or "" for choice in sub._choices_actions}
        parts += [_command((*words, name), one, texts.get(name, "")) for name, one in sub.choices.items()]
    usage = parser.format_usage().removeprefix("usage: ").rstrip()
    summary = said or (parser.description or "").strip()
    return Command(words, summary, usage, tuple(groups), (parser.epilog or "").strip(), tuple(parts))
