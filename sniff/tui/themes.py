"""The two themes, dark and light: every text has a contrast of 4.5 to 1 or more on what it stands on, bars and lines 3.

Colours by a name of a terminal's own sixteen ("yellow", in texts and colour rules) are the theme's as well. Two of them
are backgrounds here, for no text has them: BENEATH the column of a cursor, CHOSEN what is selected.
"""

from __future__ import annotations

from dataclasses import replace

from rich.terminal_theme import TerminalTheme
from textual.theme import BUILTIN_THEMES, Theme

BENEATH, CHOSEN = "bright_black", "bright_white"

DIM = 0.76
"""How much of a dim text is its own colour and not its background's."""

DARK: Theme = replace(
    BUILTIN_THEMES["textual-dark"],
    name="sniff485-dark",
    primary="#0A4F90",
    secondary="#5E93BF",
    error="#E0506F",
    variables={"scrollbar": "#3A6E9C", "scrollbar-background": "#1C2126"},
)
LIGHT: Theme = replace(
    BUILTIN_THEMES["textual-light"],
    name="sniff485-light",
    secondary="#2F5F88",
    accent="#8F4E00",
    warning="#8A5200",
    error="#A3123A",
    success="#1A6E36",
    variables={"scrollbar": "#5C84A3", "scrollbar-background": "#CACACA"},
)
THEMES: tuple[Theme, Theme] = (DARK, LIGHT)

_Colour = tuple[int, int, int]


def _sixteen(
    black: _Colour, white: _Colour, text: tuple[_Colour, ...], beneath: _Colour, chosen: _Colour
) -> TerminalTheme:
    """`text`: red, green, yellow, blue, magenta, cyan."""
    return TerminalTheme(black, white, [black, *text, white, beneath], [*text, chosen])


DARK_SIXTEEN = _sixteen(
    (12, 12, 12),
    (217, 217, 217),
    ((255, 92, 115), (126, 204, 120), (240, 178, 72), (104, 152, 196), (152, 148, 200), (88, 196, 220)),
    (60, 66, 74),
    (36, 66, 104),
)
LIGHT_SIXTEEN = _sixteen(
    (0, 0, 0),
    (247, 247, 247),
    ((166, 28, 40), (28, 104, 44), (124, 80, 0), (44, 92, 144), (98, 84, 156), (0, 96, 128)),
    (182, 190, 198),
    (160, 196, 232),
)
