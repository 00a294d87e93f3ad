"""The application: polls its feed ten times a second and keeps the shown screen up to date."""

from __future__ import annotations

import gc
import time
from collections.abc import Sequence
from functools import partial
from pathlib import PurePath
from typing import ClassVar

from textual.binding import Binding, BindingType
from textual.events import Event, InputEvent, Key
from textual.filter import DimFilter
from textual.screen import Screen
from textual.timer import Timer

from dissectors.findings import Finding
from sniff.analysis.sanitizing import sanitized
from sniff.bus.feed import Feed, FeedStatus
from sniff.bus.rows import Store
from sniff.config import ConfigError
from sniff.config import load as load_config
from sniff.filter import FilterError
from sniff.tui.analyzer import Analyzer
from sniff.tui.busbar import BusBar
from sniff.tui.buses import Buses
from sniff.tui.guest import is_guest
from sniff.tui.header import StatusHeader
from sniff.tui.health_meter import HealthMeter
from sniff.tui.help import HelpScreen
from sniff.tui.key_names import complaints, keymap, named
from sniff.tui.palette import ActionCommands
from sniff.tui.prompt import Prompt
from sniff.tui.screens import SCREENS, STYLED, Entry, load
from sniff.tui.screens.base import ViewScreen
from sniff.tui.seats import BusLine, Seat
from sniff.tui.termination import ends_when_asked
from sniff.tui.themes import DARK, DARK_SIXTEEN, DIM, LIGHT, LIGHT_SIXTEEN, THEMES
from sniff.tui.view_state import Viewing

POLL_SECONDS = 0.1
WORK_SECONDS = 0.02
"""Pause between two pieces of pending work, so that keys are answered in between."""
LOADING_SECONDS = 0.1
"""Pause between two screens that are imported before they are asked for."""
CALM_SECONDS = 0.2
"""How long what is not on the screen waits after a key: who holds one down must not feel it."""
SURE_SECONDS = 4.0
"""How long a first `q` during a recording waits for the second."""


class SnifferApp(Analyzer):
    """Shows what a feed brings. Nothing that the user does here touches the capture."""

    TITLE = "sniff485"
    CSS_PATH: ClassVar[list[str | PurePath]] = [  # all at once: a sheet that comes later has all of them read anew
        "app.tcss",
        *(f"screens/{name}.tcss" for name in STYLED),
    ]
    COMMANDS = Analyzer.COMMANDS | {ActionCommands}
    ENABLE_COMMAND_PALETTE = True
    BINDINGS: ClassVar[list[BindingType]] = named(
        [
            Binding("space", "freeze", "freeze", tooltip="freeze the view, or let it go on; the capture never stops"),
            Binding("question_mark", "help", "help", tooltip="this page"),
            Binding("q", "go_back", "back", tooltip="go back to the screen before; quit at the first one"),
            *(
                Binding(entry.key, f"switch('{entry.name}')", entry.title, tooltip=f"screen {entry.title}", show=False)
                for entry in SCREENS
            ),
            Binding("b", "bus(1)", "bus", tooltip="the next bus, of several; the others are listened to meanwhile"),
            Binding("B", "bus(-1)", "bus", tooltip="the bus before", show=False),
            Binding("T", "theme", "theme", tooltip="dark or light theme", show=False),
            Binding("ctrl+p", "command_palette", "commands", tooltip="all commands by name", show=False),
            Binding("ctrl+q,ctrl+c", "quit", "quit", tooltip="quit at once", show=False),
        ]
    )

    def __init__(self, feed: Feed | Sequence[Feed], start_screen: str = "frames") -> None:
        """`feed`: of one bus, or those of several; the first is shown first."""
        if start_screen not in {entry.name for entry in SCREENS}:
            raise ValueError(f"screen {start_screen!r}: expected one of {', '.join(entry.name for entry in SCREENS)}")
        self.DEFAULT_MODE = start_screen  # type: ignore[misc]  # textual reads it from the instance
        super().__init__()
        self._take_themes()
        feeds = feed if isinstance(feed, Sequence) else [feed]
        self._followed = Buses(feeds, start_screen)
        for entry in SCREENS:
            for number in range(len(feeds)):
                self.add_mode(_mode(entry.name, number), partial(self._make, entry))
        self.tabs = tuple((entry.key, entry.title) for entry in SCREENS)
        self._worker: Timer | None = None
        self._not_loaded = list(SCREENS)
        self.is_alone = False  # whether this process is for nothing else
        self._asked_to_quit = 0.0
        self._pressed = 0.0  # when the last key was

    @property
    def broken_by(self) -> Exception | None:
        """What ended it, where that was no user."""
        return self._exception

    def _fatal_error(self) -> None:
        """Textual's page of a traceback is for nobody here: who runs this says it in a line, as of any command."""
        self._begin_batch()  # nothing is painted over the terminal that is given back, as where a user ends it
        self._close_messages_no_wait()

    def _take_themes(self) -> None:
        for theme in THEMES:
            self.register_theme(theme)
        self.set_reactive(SnifferApp.ansi_theme_dark, DARK_SIXTEEN)  # the theme below reads all sheets anew, once
        self.set_reactive(SnifferApp.ansi_theme_light, LIGHT_SIXTEEN)
        for one in self._filters:
            if isinstance(one, DimFilter):
                one.dim_factor = DIM
        self.theme = DARK.name

    def _make(self, entry: Entry) -> Screen[None]:
        made: Screen[None] = load(entry)()
        made._css_update_count = self._css_update_count  # its widgets get their style as they are put in: Textual
        return made  # would read all sheets twice more, which is most of what a screen costs the first time

    # -- the bus that is shown ---------------------------------------------------------------------------------

    @property
    def seat(self) -> Seat:
        """The bus that is shown."""
        return self._followed.shown

    @property
    def feed(self) -> Feed:
        """What fills it."""
        return self.seat.feed

    @property
    def store(self) -> Store:
        """Its rows."""
        return self.feed.store

    @property
    def status(self) -> FeedStatus:
        """How its feed is doing."""
        return self.seat.status

    @property
    def is_down(self) -> bool:
        """Whether its port is gone for now."""
        return self.seat.is_down

    @property
    def health(self) -> HealthMeter:
        """Its health, a look every now and then."""
        return self.seat.health

    @property
    def viewing(self) -> Viewing:
        """How the user looks at it."""
        return self.seat.viewing

    @property
    def visited(self) -> list[str]:
        """The screens that `q` walks back over."""
        return self.seat.visited

    @property
    def buses(self) -> Sequence[BusLine]:
        """What the bar says of each; none where there is only one."""
        return self._followed.lines

    def site_is_due(self) -> bool:
        """Whether the buses together would say more than they did."""
        return self._followed.site_is_due()

    def findings(self) -> tuple[Finding, ...]:
        """Of the bus that is shown; where there are several, with what they say together."""
        return self._followed.findings()

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """There is no other bus to show where there is only one."""
        return self._followed.are_several if action == "bus" else super().check_action(action, parameters)

    def action_bus(self, step: int) -> None:
        """Show another bus, on the screen that was shown of it last."""
        self._go_to(self._followed.after(step))

    def show_bus(self, name: str) -> None:
        """Show the bus of this name."""
        self._go_to(self._followed.named(name))

    def _go_to(self, number: int) -> None:
        if number == self._followed.here:
            return
        self._followed.here = number
        self.switch_mode(_mode(self.visited[-1], number))

    async def on_event(self, event: Event) -> None:
        """Note when somebody is at work here."""
        if isinstance(event, InputEvent):
            self._pressed = time.monotonic()
        await super().on_event(event)

    # -- keeping up --------------------------------------------------------------------------------------------

    def on_mount(self) -> None:
        """Start to poll."""
        if self.is_alone:
            ends_when_asked(self.exit)
        try:
            colours = load_config().colours
            for seat in self._followed.seats:
                seat.viewing.colour_rules(colours)
        except (ConfigError, FilterError) as error:
            self.notify(sanitized(error), severity="error", markup=False)
        self._take_keys()
        self._worker = self.set_interval(WORK_SECONDS, self._work, pause=True)
        self.set_interval(POLL_SECONDS, self.poll)
        self.set_timer(LOADING_SECONDS, self._load_more)
        self.poll()

    def _load_more(self) -> None:
        """Import another screen while nobody presses a key, so that showing it first takes no longer than again."""
        if time.monotonic() - self._pressed >= CALM_SECONDS and not self.status.reading:
            load(self._not_loaded.pop(0))
        if self._not_loaded:
            self.set_timer(LOADING_SECONDS, self._load_more)
        elif self.is_alone:
            gc.freeze()  # what is there by now stays: looking through all of it takes 100 ms each time

    def _take_keys(self) -> None:
        """Other keys, as the configuration says."""
        try:
            keys = load_config().keys
        except ConfigError:  # said already
            return
        if not keys:
            return
        for entry in SCREENS:
            load(entry)  # names of keys are known with their screens
        for said in complaints(keys):
            self.notify(sanitized(said), severity="error", markup=False)
        self.set_keymap(keymap(keys))

    def poll(self) -> None:
        """Take what the feed has and show it."""
        if not self.screen_stack:  # the app is ending
            return
        changed, notices = self._followed.poll()
        for notice in notices:
            self.notify(notice.text, title=notice.title, severity=notice.severity, markup=False)
        if self._worker is not None and self._followed.are_still_read:
            self._worker.resume()
        if changed:
            self.viewing.take_marks()
            self.draw_screen()
        self._draw_header()

    def draw_screen(self) -> None:
        """Bring the shown screen up to date."""
        screen = self.shown
        if screen is not None and _is_whole(screen):
            screen.draw()
            if self._worker is not None and screen.work_left():
                self._worker.resume()
            self._draw_header()

    @property
    def shown(self) -> ViewScreen | None:
        """The analyzer's screen in front, or behind a help page or palette."""
        screens = [screen for screen in self.screen_stack if isinstance(screen, ViewScreen)]
        return screens[-1] if screens else None

    def _work(self) -> None:
        screen = self.shown
        busy = time.monotonic() - self._pressed < CALM_SECONDS or self._followed.work()
        busy |= screen is not None and _is_whole(screen) and screen.work_left() and screen.work()
        if not busy and self._worker is not None:
            self._worker.pause()

    def _draw_header(self) -> None:
        status = self.status
        if not self.viewing.frozen and not status.reading:
            self.health.look(self.store, final=status.judged >= 1 and not status.live)
        for child in self.screen.children:  # a query would match every widget there is
            if isinstance(child, StatusHeader | BusBar):
                child.bring_up()

    # -- what keys do everywhere -------------------------------------------------------------------------------

    def action_switch(self, name: str) -> None:
        """Show a screen; `q` comes back from it."""
        if name == self.visited[-1]:
            return
        self.seat.visit(name)
        self.switch_mode(_mode(name, self._followed.here))

    def action_go_back(self) -> None:
        """Go to the screen before; quit at the first one, asking again while a recording runs."""
        if len(self.visited) > 1:
            self.visited.pop()
            self.switch_mode(_mode(self.visited[-1], self._followed.here))
            return
        if self.status.live and self.status.recording and time.monotonic() - self._asked_to_quit > SURE_SECONDS:
            self._asked_to_quit = time.monotonic()
            self.notify(
                f"recording to {sanitized(self.status.recording)}; q again stops it and quits",
                severity="warning",
                timeout=SURE_SECONDS,
                markup=False,
            )
            return
        self.exit()

    def action_freeze(self) -> None:
        """Freeze the view or let it go on; where nothing comes any more it stands anyway."""
        if not self.viewing.frozen and self._stands_still("freeze"):
            return
        self.viewing.freeze(not self.viewing.frozen)
        self.draw_screen()

    def action_follow(self) -> None:
        """Follow the newest row or stay; a frozen view goes on and follows."""
        if not (self.viewing.follow or self.viewing.frozen or self.status.reading) and self._stands_still("follow"):
            return
        self.viewing.follow = self.viewing.frozen or not self.viewing.follow
        self.viewing.freeze(False)
        self.draw_screen()

    def _stands_still(self, to_do: str) -> bool:
        """Whether nothing comes any more; then it is said that there is nothing to do so."""
        if self.status.live and not self.status.ended:
            return False
        what = "the capture has ended" if self.status.live else "a file stands still"
        self.notify(f"{what}: there is nothing to {to_do}", timeout=3)
        return True

    def action_time(self) -> None:
        """Next way to count time."""
        self.viewing.time_mode = self.viewing.time_mode.next()
        self.notify(f"time: {self.viewing.time_mode.words}", timeout=2)
        self.draw_screen()

    def action_theme(self) -> None:
        """Dark or light."""
        self.theme = LIGHT.name if self.theme == DARK.name else DARK.name

    def action_help(self) -> None:
        """All keys that work here."""
        shown = self.shown
        if shown is not None and not isinstance(self.screen, HelpScreen):
            self.push_screen(HelpScreen(shown, shown.TITLE))

    def filter(self, text: str) -> None:
        """Show only what a filter accepts, on all lists."""
        try:
            self.viewing.set_filter(text)
        except FilterError as error:
            self.notify(sanitized(error), severity="error", markup=False)
            return
        self.draw_screen()

    def mark_row(self, no: int, text: str | None) -> None:
        """Keep what a person wrote about a row, None to take it away, and say where it is kept."""
        row = self.store.by_no(no)
        if row is None:
            self.notify(f"row {no} is no longer in memory", timeout=3)
            return
        if is_guest():
            self.notify("who looks from another machine writes no marks here", severity="warning", timeout=3)
            return
        try:
            where = self.feed.mark(row.event.start, text)
        except OSError as error:
            where = f"until this view ends: {error.strerror or error}"
        if text is not None:
            self.notify(f"mark on row {no}, kept {sanitized(where)}", timeout=3, markup=False)
        self.viewing.take_marks()
        self.draw_screen()

    def show_row(self, no: int) -> None:
        """Put the cursor of the frame list on a row and show it."""
        self.viewing.follow = False
        self.viewing.row = no
        self.viewing.row_from = None
        self.action_switch("frames")

    def on_prompt_answered(self, message: Prompt.Answered) -> None:
        """Filters work on every screen."""
        if message.purpose == "filter":
            self.filter(message.text)

    def on_prompt_key_behind(self, message: Prompt.KeyBehind) -> None:
        """Press it again, where the keys are now; a key of the app's own, since one of a screen stops there."""
        self.post_message(Key(message.key, message.character))


def _mode(name: str, bus: int) -> str:
    """What a screen of a bus is called: each bus has its own, with its own cursor."""
    return f"{name} of {bus}" if bus else name


def _is_whole(screen: ViewScreen) -> bool:
    """Whether a screen can be drawn: a timer may still fire while its widgets are put in or taken out."""
    return screen.is_mounted and bool(screen.query("#main"))
