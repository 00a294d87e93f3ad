"""Labelled lines that go on under their text, not under their label. Pure."""

from __future__ import annotations

from rich.text import Text


def hanging(text: Text, width: int, indent: int) -> Text:
    """The lines, those over `width` cells broken between words and going on `indent` cells from the left. A word that
    is longer stays whole: whoever shows it breaks it."""
    lines: list[Text] = []
    for line in text.split("\n", allow_blank=True):
        while line.cell_len > width:
            cut = line.plain.rfind(" ", 0, width + 1)
            if cut <= indent:
                break
            lines.append(line[:cut])
            line = Text(" " * indent).append_text(line[cut + 1 :])
        lines.append(line)
    return Text("\n").join(lines)
