"""Manual pages, in the man macros: one for the program, one for each command."""

from __future__ import annotations

import re

from docs.generate.commands import Command, all_commands


def manual_pages() -> dict[str, str]:
    """File names ("sniff485-check.1") and their text."""
    from sniff.version import __version__

    program = all_commands()
    every = [program, *program.parts]
    return {f"{_file_name(one)}.1": _page(one, __version__, every) for one in every}


def _file_name(command: Command) -> str:
    return "-".join(("sniff485", *command.words))


def _page(command: Command, version: str, every: list[Command]) -> str:
    name = _file_name(command)
    lines = [
        f'.TH {name.upper()} 1 "" "sniff485 {version}" "sniff485"',
        ".SH NAME",
        f"{escaped(name)} \\- {escaped(_plain_sentence(command.summary))}",
        ".SH SYNOPSIS",
        *_as_is(command.usage),
    ]
    if command.words:
        lines += [".SH DESCRIPTION", *_prose(command.text)]
        lines += _arguments(command)
        for part in command.parts:
            lines += [f".SH {escaped(part.name.upper())}", *_prose(part.summary), *_as_is(part.usage)]
            lines += _arguments(part) + _prose(part.text)
    else:
        lines += [".SH DESCRIPTION", *_prose(command.summary), ".SH COMMANDS"]
        for part in command.parts:
            lines += [".TP", f"\\fB{escaped(part.name)}\\fR", escaped(part.summary)]
        lines += [*_arguments(command), ".SH NOTES", *_prose(command.text)]
    others = [f"\\fB{escaped(_file_name(one))}\\fR(1)" for one in every if one is not command]
    seen = others if not command.words else others[:1]
    return "\n".join([*lines, ".SH SEE ALSO", ", ".join(seen), ""])


def _arguments(command: Command) -> list[str]:
    lines: list[str] = []
    for group in command.groups:
        lines.append(f".SH {escaped(group.title.upper())}" if len(command.words) < 2 else f".SS {escaped(group.title)}")
        for one in group.arguments:
            lines += [".TP", f"\\fB{escaped(one.written)}\\fR", escaped(one.says)]
    return lines


def _prose(text: str) -> list[str]:
    """Paragraphs as they are written in docstrings: what is indented stands as it is."""
    lines: list[str] = []
    for paragraph in re.split(r"\n\s*\n", text.strip("\n")):
        if not paragraph.strip():
            continue
        if all(line.startswith("  ") for line in paragraph.splitlines()):
            lines += [".PP", *_as_is(paragraph)]
        else:
            marked = re.sub(r"`([^`\n]+)`", "\0\\1\1", " ".join(paragraph.split()))
            lines += [".PP", escaped(marked).replace("\0", "\\fB").replace("\1", "\\fR")]
    return lines


def _as_is(text: str) -> list[str]:
    return [".nf", *(escaped(line) for line in text.splitlines()), ".fi"]


def escaped(text: str) -> str:
    r"""Text that troff takes for text.

    >>> escaped(".mcap - a\\b")
    '\\&.mcap \\- a\\eb'
    """
    out = " ".join(text.split("\n")).replace("\\", "\\e").replace("-", "\\-")
    return f"\\&{out}" if out[:1] in (".", "'") else out


def _plain_sentence(text: str) -> str:
    """A summary as whatis lists it: no full stop at its end."""
    return " ".join(text.split()).rstrip(".")
