"""The bar of buses: name, state, health, load, errors of each; the one that is shown in brackets. Not there for one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import ClassVar

from rich.cells import cell_len
from rich.style import Style
from rich.text import Text
from textual import events
from textual.widget import Widget

from sniff.analysis.sanitizing import sanitized
from sniff.tui.analyzer import analyzer
from sniff.tui.columns import fit
from sniff.tui.seats import BusLine, BusState

BEYOND = "…!"
"""Stands for buses that do not fit, some of them in trouble."""

POOR = 70
"""Health below which a bus is marked."""

Label = Callable[[BusLine], str]


def _health(bus: BusLine) -> str:
    return "–" if bus.health is None else f"{bus.health:.0f}"


def _trouble(bus: BusLine) -> str:
    """What is wrong, in words; nothing that only colour tells."""
    return " ".join(filter(None, (bus.state.value, f"LOST {bus.lost}" if bus.lost else "")))


def _full(bus: BusLine) -> str:
    said = _trouble(bus) or f"health {_health(bus)}"
    return f"{sanitized(bus.name)} {said} load {bus.load:.0%} err {bus.errors}"


def _close(bus: BusLine) -> str:
    return f"{sanitized(bus.name)} {_trouble(bus) or _health(bus)} {bus.load:.0%} err {bus.errors}"


def _short(bus: BusLine) -> str:
    return f"{sanitized(bus.name)} {_trouble(bus) or _health(bus)}"


def is_poor(bus: BusLine) -> bool:
    """Whether its health is worth a mark."""
    return bus.health is not None and bus.health < POOR


def labels(buses: Sequence[BusLine], width: int) -> list[tuple[str, BusLine]]:
    """Text for each bus, as much of it as fits for all; where not even that does, those around the one shown, and
    whether there is trouble beyond."""
    made: list[tuple[str, BusLine]] = []
    for say in (_full, _close, _short):
        made = [(f"[{say(bus)}]" if bus.is_here else f" {say(bus)} ", bus) for bus in buses]
        if sum(cell_len(text) for text, _ in made) <= width:
            return made
    begin = end = next((place for place, bus in enumerate(buses) if bus.is_here), 0)
    most = max(0, width - 2 * len(BEYOND))
    text, here = made[begin]
    if cell_len(text) > most:
        made[begin] = f"[{fit(_short(here), max(1, most - 2))}]", here
    room = most - cell_len(made[begin][0])
    while True:
        after = cell_len(made[end + 1][0]) if end + 1 < len(made) else width
        before = cell_len(made[begin - 1][0]) if begin else width
        if after <= room:
            end, room = end + 1, room - after
        elif before <= room:
            begin, room = begin - 1, room - before
        else:
            break
    return [*_beyond(buses[:begin], -1), *made[begin : end + 1], *_beyond(buses[end + 1 :], 0)]


def _beyond(buses: Sequence[BusLine], nearest: int) -> list[tuple[str, BusLine]]:
    """What stands for buses that do not fit; a click shows the nearest of them."""
    if not buses:
        return []
    is_bad = any(_trouble(bus) or is_poor(bus) for bus in buses)
    return [(BEYOND if is_bad else BEYOND[0], buses[nearest])]


class BusBar(Widget):
    """One line; a click shows that bus."""

    COMPONENT_CLASSES: ClassVar[set[str]] = {"bus-bar--here", "bus-bar--bad", "bus-bar--doubt"}

    def __init__(self) -> None:
        super().__init__()
        self._drawn: list[tuple[str, BusLine]] = []

    def bring_up(self) -> None:
        """Draw again if anything changed."""
        drawn = labels(analyzer(self).buses, self.size.width)
        if drawn != self._drawn:
            self._drawn = drawn
            self.refresh()

    def on_resize(self) -> None:
        """Other width, other words."""
        self.bring_up()

    def render(self) -> Text:
        """The line."""
        text = Text(no_wrap=True, overflow="crop", end="")
        for label, bus in self._drawn:
            text.append(label, self._style(bus))
        return text

    def _style(self, bus: BusLine) -> Style:
        styles = []
        if bus.state not in (BusState.WELL, BusState.SEARCHING) or bus.lost:
            styles.append("bad")
        elif bus.state is BusState.SEARCHING or is_poor(bus):
            styles.append("doubt")
        if bus.is_here:
            styles.append("here")
        found = (self.get_component_rich_style(f"bus-bar--{name}", partial=True) for name in styles)
        return Style.combine([Style(), *found])

    def on_click(self, event: events.Click) -> None:
        """Show the bus that was clicked."""
        at = 0
        for label, bus in self._drawn:
            at += cell_len(label)
            if event.x < at:
                analyzer(self).show_bus(bus.name)
                return
