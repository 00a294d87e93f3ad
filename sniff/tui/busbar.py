"""The bar of buses: name, state, health, load, errors of each; the one that is shown in brackets. Not there for one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import ClassVar

from rich.cells import cell_len
from rich.style import Style
from rich.text import Text
from textual import events
from textual.widget import Widget

from sniff.tui.analyzer import analyzer
from sniff.tui.columns import fit
from sniff.tui.plain import plain
from sniff.tui.seats import BusLine, BusState

LEAST_NAME = 4
"""Cells that are left of a name."""

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
    return f"{plain(bus.name)} {said} load {bus.load:.0%} err {bus.errors}"


def _close(bus: BusLine) -> str:
    return f"{plain(bus.name)} {_trouble(bus) or _health(bus)} {bus.load:.0%} err {bus.errors}"


def _short(bus: BusLine) -> str:
    return f"{plain(bus.name)} {_trouble(bus) or _health(bus)}"


def _least(bus: BusLine) -> str:
    mark = "!" if _trouble(bus) or is_poor(bus) else ""
    return f"{mark}{fit(plain(bus.name), min(LEAST_NAME, cell_len(plain(bus.name))))}"


def is_poor(bus: BusLine) -> bool:
    """Whether its health is worth a mark."""
    return bus.health is not None and bus.health < POOR


def labels(buses: Sequence[BusLine], width: int) -> list[tuple[str, BusLine]]:
    """Text for each bus, as much of it as fits for all; where not even that does, those around the one shown."""
    made: list[tuple[str, BusLine]] = []
    for say in (_full, _close, _short, _least):
        made = [(f"[{say(bus)}]" if bus.is_here else f" {say(bus)} ", bus) for bus in buses]
        if sum(cell_len(text) for text, _ in made) <= width:
            return made
    here = next((place for place, bus in enumerate(buses) if bus.is_here), 0)
    begin = end = here
    room = width - cell_len(made[here][0]) - 2
    while True:
        after = cell_len(made[end + 1][0]) if end + 1 < len(made) else width
        before = cell_len(made[begin - 1][0]) if begin else width
        if after <= room:
            end, room = end + 1, room - after
        elif before <= room:
            begin, room = begin - 1, room - before
        else:
            break
    left = [("…", buses[begin])] if begin else []
    right = [("…", buses[end])] if end + 1 < len(made) else []
    return [*left, *made[begin : end + 1], *right]


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
