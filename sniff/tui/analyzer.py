"""The application as its screens and widgets see it: what they may ask of it."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence

from textual.app import App
from textual.message_pump import MessagePump

from dissectors.findings import Finding
from sniff.bus.feed import FeedStatus
from sniff.bus.rows import Store
from sniff.tui.health_meter import HealthMeter
from sniff.tui.seats import BusLine
from sniff.tui.view_state import Viewing


class Analyzer(App[None]):
    """`tabs`: key and title of each screen. Of several buses all but `buses` is that of the one which is shown."""

    tabs: tuple[tuple[str, str], ...]

    @property
    @abstractmethod
    def status(self) -> FeedStatus:
        """Of the feed, ten times a second."""

    @property
    @abstractmethod
    def is_down(self) -> bool:
        """Whether the port is gone for now."""

    @property
    @abstractmethod
    def health(self) -> HealthMeter:
        """Health of the bus, a look every now and then."""

    @property
    @abstractmethod
    def viewing(self) -> Viewing:
        """How the user looks at things."""

    @property
    @abstractmethod
    def buses(self) -> Sequence[BusLine]:
        """What the bar says of each bus; none where there is only one."""

    @abstractmethod
    def site_is_due(self) -> bool:
        """Whether `findings` would say more of what several buses say together than it did last."""

    @abstractmethod
    def findings(self) -> tuple[Finding, ...]:
        """Of the bus that is shown, and what several buses say together."""

    @property
    @abstractmethod
    def store(self) -> Store:
        """The rows."""

    @abstractmethod
    def show_bus(self, name: str) -> None:
        """Show the bus of this name."""

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
