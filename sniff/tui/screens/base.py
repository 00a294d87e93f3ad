"""What all screens share: header, prompt, key bar, and being brought up to date."""

from __future__ import annotations

from typing import Any, ClassVar

from textual import events
from textual.app import ComposeResult
from textual.containers import Vertical
from textual.messages import Layout
from textual.reactive import Reactive
from textual.screen import Screen
from textual.scrollbar import ScrollBar
from textual.widget import Widget

from sniff.bus.rows import Store
from sniff.tui.analyzer import analyzer
from sniff.tui.busbar import BusBar
from sniff.tui.header import StatusHeader
from sniff.tui.key_names import named
from sniff.tui.keybar import KeyBar
from sniff.tui.prompt import Prompt
from sniff.tui.view_state import Viewing

LOW = 18
"""Height below which the list gets what there is and what is said below it the least."""
TALL = 24
"""Height from which everything has room, a prompt too."""
SMALL = (60, 16)
"""Below these columns or lines much is left out; that is said once."""


class Foot(Vertical):
    """The last lines: the prompt while it is open, and the keys. They stay in sight where there are few lines."""


class ViewScreen(Screen[None]):
    """A screen of the analyzer.

    A subclass gives `TITLE` (as in the table of screens), `compose_view` (its widgets) and `draw` (brings them up to
    date: called when shown and then ten times a second while anything changes; it must not walk over all rows).
    Rules in its tcss file stand inside a block with its class name: style sheets hold for the whole app.
    """

    TITLE: ClassVar[str] = ""
    LEGEND: ClassVar[tuple[tuple[str, str], ...]] = ()  # marks and titles of this screen, for its help page
    AUTO_FOCUS: ClassVar[str] = "#main"
    VERTICAL_BREAKPOINTS: ClassVar[list[tuple[int, str]]] = [(0, "-low"), (LOW, "-high"), (TALL, "-tall")]  # type: ignore[misc]

    focused: Reactive[Widget | None] = Reactive(None, repaint=False)
    """What has the keys. Who gets and who loses them is drawn anew; Textual draws the whole screen."""

    def __init_subclass__(cls, **kwargs: Any) -> None:
        """Keys have names, so that a configuration can give others."""
        if "BINDINGS" in cls.__dict__:
            cls.BINDINGS = named(cls.BINDINGS)
        super().__init_subclass__(**kwargs)

    def compose(self) -> ComposeResult:
        """Header, the bar of buses where there are several, the view, prompt, keys."""
        yield StatusHeader(self.TITLE)
        if analyzer(self).buses:
            yield BusBar()
        yield from self.compose_view()
        with Foot():
            yield Prompt()
            yield KeyBar()

    def compose_view(self) -> ComposeResult:
        """The widgets of the view; the one with the id "main" gets the focus."""
        raise NotImplementedError

    def draw(self) -> None:
        """Bring the view up to date; while `viewing.frozen` nothing newer than the freeze is shown."""
        raise NotImplementedError

    def work_left(self) -> bool:
        """Whether `work` has something to do."""
        return False

    def work(self) -> bool:
        """Do a small piece of pending work (some ms); whether more is left."""
        return False

    @property
    def viewing(self) -> Viewing:
        """How the user looks at things."""
        return analyzer(self).viewing

    @property
    def store(self) -> Store:
        """The rows."""
        return analyzer(self).store

    def on_resize(self, event: events.Resize) -> None:
        """What was laid out for another width is drawn anew, also where nothing comes any more."""
        self.call_after_refresh(analyzer(self).draw_screen)
        is_small = event.size.width < SMALL[0] or event.size.height < SMALL[1]
        if is_small and not self.viewing.is_small:
            said = f"{event.size.width}×{event.size.height} is small: much is left out, 80×24 shows it"
            self.notify(said, severity="warning", timeout=4, markup=False)
        self.viewing.is_small = is_small

    def on_layout(self, message: Layout) -> None:
        """These have their size from what they belong to or hold; Textual lays the screen out a second time when they
        have got another one."""
        if isinstance(message.widget, ScrollBar | Foot):
            message.stop()
            message.prevent_default()

    def _compositor_refresh(self) -> None:
        """Draw all that waits for it at once: Textual draws what has another size now, and again when its own word of
        it has come through the queue."""
        shown = self._compositor.visible_widgets
        self._compositor.update_widgets({widget for widget in shown if widget._repaint_regions})
        super()._compositor_refresh()

    def on_screen_resume(self) -> None:
        """Shown (again): catch up."""
        analyzer(self).draw_screen()

    def keys_after_prompt(self) -> Widget:
        """What has the keys when the prompt is left."""
        return self.query_one(self.AUTO_FOCUS, Widget)

    def on_prompt_closed(self) -> None:
        """Back to where the keys were, unless the prompt asks again; at once, for a key may follow."""
        if not self.query_one(Prompt).is_open:
            self.set_focus(self.keys_after_prompt())
