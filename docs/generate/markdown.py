"""Pieces of Markdown."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence


def told(text: str) -> str:
    """Plain text as Markdown that reads the same; what stands between backticks stays code."""
    parts = re.split(r"(`[^`\n]+`)", text)
    return "".join(part if part.startswith("`") else _escaped(part) for part in parts)


def _escaped(text: str) -> str:
    for old, new in (("&", "&amp;"), ("<", "&lt;"), (">", "&gt;"), ("\\", "\\\\")):
        text = text.replace(old, new)
    return re.sub(r"([*_\[\]|#])", r"\\\1", text)


def code(text: str) -> str:
    """Code inside a line or a cell."""
    return f"<code>{re.sub(r'[&<>|*_`[]', lambda match: f'&#{ord(match[0])};', text)}</code>"


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    """A table; cells are Markdown."""
    yield f"| {' | '.join(head)} |"
    yield f"|{'---|' * len(head)}"
    for row in rows:
        yield f"| {' | '.join(cell.replace(chr(10), ' ') for cell in row)} |"


def anchored(level: int, title: str, anchor: str) -> Iterator[str]:
    """A heading with an address that does not depend on its words."""
    yield f"{'#' * level} {told(title)} {{ #{anchor} }}"


def prose(text: str) -> str:
    """The text of a docstring: what is indented in it is code, all else is as it is."""
    paragraphs = re.split(r"\n\s*\n", text.strip("\n"))
    made = []
    for paragraph in paragraphs:
        if all(line.startswith("  ") for line in paragraph.splitlines()):
            made.append("```text\n" + "\n".join(line[4:] for line in paragraph.splitlines()) + "\n```")
        else:
            made.append(told(" ".join(paragraph.split())))
    return "\n\n".join(made)
