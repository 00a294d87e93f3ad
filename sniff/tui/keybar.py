"""The line at the bottom: the keys that work here, as many as fit, the most wanted first.

A binding's description is its short name here; its tooltip says in full what it does (help page, command palette).
Bindings with the same description share one place: "e/E error".
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

from rich.text import Text
from textual import events
from textual.binding import ActiveBinding
from textual.keys import format_key
from textual.screen import Screen
from textual.widget import Widget
from textual.widgets import Input

NAMES = {"escape": "esc", "pageup": "page up", "pagedown": "page down"}
"""Keys that are not written as the framework writes them, or not as their sign."""
NOT_OURS = {"screen.copy_text", "help_quit", "app.focus_next", "app.focus_previous"}
"""Actions that the framework binds; they count here only where a screen explains them (a binding with a tooltip)."""
ALWAYS = ("help", "back")
"""Descriptions of the keys that the bar never leaves out."""
FIRST = ("bus", "filter", "", "freeze", "follow", "error", "pair", "mark", "time", "open", "go to")
"""The order of wanting by description; "" stands for all that are not named here."""


def key_name(key: str) -> str:
    """A key as people read it."""
    plain = key.removeprefix("upper_")
    sign = format_key(plain)
    return NAMES.get(key) or (sign if len(sign) == 1 and sign.isascii() else plain.replace("ctrl+", "^"))


def explanation(active: ActiveBinding) -> str:
    """What a binding does, in full."""
    return active.binding.tooltip or active.binding.description


def working_keys(screen: Screen[Any]) -> list[tuple[str, ActiveBinding]]:
    """Keys that work on a screen and have a description: those of the focused pane, of the screen, then of the app.

    While something is typed, only the keys of the field and of what is around it.
    """
    focused = screen.focused
    return [
        (active.binding.key_display or key_name(key), active)
        for key, active in screen.active_bindings.items()
        if active.binding.description
        and active.enabled
        and (active.binding.tooltip or active.binding.action not in NOT_OURS)
        and (not isinstance(focused, Input) or active.node in (focused, focused.parent))
    ]


@dataclass(slots=True)
class _Entry:
    active: ActiveBinding
    keys: list[str] = field(default_factory=list)
    begin: int = 0
    end: int = 0

    @property
    def label(self) -> str:
        return self.active.binding.description

    @property
    def length(self) -> int:
        return len("/".join(self.keys)) + 1 + len(self.label)


class KeyBar(Widget):
    """Keys in bold with what they do; a click works like the key."""

    COMPONENT_CLASSES: ClassVar[set[str]] = {"key-bar--key", "key-bar--label"}

    def __init__(self) -> None:
        super().__init__()
        self._drawn: list[_Entry] = []

    def on_mount(self) -> None:
        """Draw again whenever other keys work."""
        self.screen.bindings_updated_signal.subscribe(self, lambda _: self.refresh())

    def render(self) -> Text:
        """The keys that fit."""
        key_style = self.get_component_rich_style("key-bar--key", partial=True)
        label_style = self.get_component_rich_style("key-bar--label", partial=True)
        self._drawn = self._that_fit(self.size.width)
        text = Text(no_wrap=True, overflow="crop", end="")
        for entry in self._drawn:
            text.append("  " if text else "")
            entry.begin = text.cell_len
            text.append("/".join(entry.keys), key_style).append(" ").append(entry.label, label_style)
            entry.end = text.cell_len
        return text

    def _that_fit(self, width: int) -> list[_Entry]:
        entries: dict[str, _Entry] = {}
        for key, active in working_keys(self.screen):
            if active.binding.show:
                keys = entries.setdefault(active.binding.description, _Entry(active)).keys
                if key not in keys:  # two that are shown as one: + with and without shift
                    keys.append(key)
        always = [entry for entry in entries.values() if entry.label in ALWAYS]
        room = width - sum(entry.length + 2 for entry in always) + 2
        fitting = []
        for entry in sorted(entries.values(), key=lambda entry: rank(entry.active)):
            if entry not in always and entry.length + 2 <= room:
                fitting.append(entry)
                room -= entry.length + 2
        return [*fitting, *always]

    async def on_click(self, event: events.Click) -> None:
        """Do what the key would do."""
        for entry in self._drawn:
            if entry.begin <= event.x < entry.end:
                await self.app.run_action(entry.active.binding.action, entry.active.node)


def rank(active: ActiveBinding) -> tuple[bool, int]:
    """How little a key is wanted: those that no footer shows come last."""
    label = active.binding.description
    return not active.binding.show, FIRST.index(label if label in FIRST else "")
