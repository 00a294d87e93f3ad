"""Pages of all commands with their options."""

from __future__ import annotations

from collections.abc import Iterator

from docs.generate.commands import Command, all_commands
from docs.generate.markdown import anchored, code, prose, table, told


def command_pages() -> Iterator[tuple[str, str]]:
    """Page addresses and their Markdown."""
    program = all_commands()
    yield "reference/commands/index.md", _index(program)
    for one in program.parts:
        yield f"reference/commands/{one.words[0]}.md", "\n".join(_page(one, 1)) + "\n"


def _index(program: Command) -> str:
    rows = [(f"[{one.name}]({one.words[0]}.md)", told(one.summary)) for one in program.parts]
    lines = ["# Commands", "", told(program.summary), "", *table(("command", "does"), rows), "", prose(program.text)]
    return "\n".join(lines) + "\n"


def _page(command: Command, level: int) -> Iterator[str]:
    if level == 1:
        yield f"# {command.name}"
    else:
        yield from anchored(level, command.name, "-".join(command.words))
    summary = command.summary
    yield from ("", told(summary[:1].upper() + summary[1:].rstrip(".") + "."), "", "```text", command.usage, "```")
    for group in command.groups:
        title = {"positional arguments": "argument", "options": "option"}.get(group.title, group.title)
        rows = [(code(one.written), told(one.says)) for one in group.arguments]
        yield from ("", *table((title, ""), rows))
    if command.text:
        yield from ("", prose(command.text))
    for part in command.parts:
        yield from ("", *_page(part, level + 1))
