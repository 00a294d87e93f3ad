"""The application as its screens and widgets see it: what they may ask of it."""

from __future__ import annotations

from abc import abstractmethod

from textual.app import App
from textual.message_pump import MessagePump

from sniff.bus.feed import FeedStatus
from sniff.bus.rows import Store
from sniff.tui.health_meter import HealthMeter
from sniff.tui.viewing import Viewing


class Analyzer(App[None]):
    """`status`: of the feed, ten times a second. `viewing`: how the user looks at things.
    `tabs`: key and title of each screen. `health`: of the bus, a look every now and then."""

    status: FeedStatus
    viewing: Viewing
    tabs: tuple[tuple[str, str], ...]
    health: HealthMeter

    @property
    @abstractmethod
    def store(self) -> Store:
        """The rows."""

    @abstractmethod
    def draw_screen(self) -> None:
        """Bring the shown screen up to date."""

    @abstractmethod
    def action_switch(self, name: str) -> None:
        """Show a screen."""

    @abstractmethod
    def filter(self, text: str) -> None:
        """Show only what a filter accepts, on all lists."""

    @abstractmethod
    def mark_row(self, no: int, text: str | None) -> None:
        """Keep what a person wrote about a row, None to take it away."""

    @abstractmethod
    def show_row(self, no: int) -> None:
        """Put the cursor of the frame list on a row and show it."""


def analyzer(node: MessagePump) -> Analyzer:
    """The application that a screen or widget stands in."""
    app = node.app
    assert isinstance(app, Analyzer)
    return app
