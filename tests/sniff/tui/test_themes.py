"""Both themes are legible: the contrast of all texts with what they stand on, as WCAG 2 counts it."""

from __future__ import annotations

import pytest
from rich.terminal_theme import TerminalTheme
from textual.color import Color
from textual.theme import Theme

from sniff.tui.themes import DARK, DARK_SIXTEEN, DIM, LIGHT, LIGHT_SIXTEEN

TEXT, LINE = 4.5, 3.0
BRIGHT_BLACK, BRIGHT_WHITE = 8, 15


def contrast(one: Color, other: Color) -> float:
    low, high = sorted(
        sum(
            weight * (part / 12.92 if part <= 0.03928 else ((part + 0.055) / 1.055) ** 2.4)
            for weight, part in zip((0.2126, 0.7152, 0.0722), colour.normalized, strict=True)
        )
        for colour in (one, other)
    )
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize(("theme", "sixteen"), [(DARK, DARK_SIXTEEN), (LIGHT, LIGHT_SIXTEEN)])
def test_every_text_is_legible(theme: Theme, sixteen: TerminalTheme) -> None:
    made = {name: Color.parse(value) for name, value in theme.to_color_system().generate().items() if value[0] == "#"}
    grounds = [made["background"], made["panel"], made["surface"]]
    for name in ("text-accent", "text-warning", "text-error", "text-success", "foreground"):
        assert min(contrast(made[name], ground) for ground in grounds) >= TEXT, name
    dim = made["background"].blend(made["foreground"], DIM)
    assert contrast(dim, made["background"]) >= TEXT
    white = made["primary"].blend(Color(255, 255, 255), 0.87)
    assert contrast(white, made["primary"]) >= TEXT
    for number in range(1, 7):
        for at in (number, number + 8):
            assert contrast(Color(*sixteen.ansi_colors[at]), made["background"]) >= TEXT, at
            for ground in (BRIGHT_BLACK, BRIGHT_WHITE):
                assert contrast(Color(*sixteen.ansi_colors[at]), Color(*sixteen.ansi_colors[ground])) >= LINE, at
