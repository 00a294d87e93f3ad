"""What the two long lists share: the filter, pending search, following, the cursor's row."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import ClassVar

from textual.binding import Binding, BindingType

from sniff.analysis.sanitizing import sanitized
from sniff.config import FILE, ConfigError, View, load, save_view
from sniff.filter import FilterError
from sniff.filter.completion import Completion, completions
from sniff.filter.told import names as point_names
from sniff.tui.analyzer import analyzer
from sniff.tui.filter_line import FilterLine
from sniff.tui.finding_rows import find
from sniff.tui.guest import is_guest
from sniff.tui.index import Index, Known
from sniff.tui.linelist import LineList
from sniff.tui.prompt import Prompt
from sniff.tui.screens.searching import SearchScreen
from sniff.tui.store_list import StoreList
from sniff.tui.views import use, view_of, wrong_columns

SLICE_SECONDS = 0.012
"""How long one piece of searching may take: short enough that a key never waits for it."""
SLICE_ROWS = 128
AT_ONCE_SECONDS = 0.05
"""How long a new filter may search before anything of it is shown."""
MOST_RETESTED = 5000
DATA_ONLY = "!(role in {token, poll})"
"""On an idle token ring more than nine rows of ten are tokens."""


class ListingScreen(SearchScreen):
    """A screen around one `LineList` with the id "main"; `THINGS` is what it lists."""

    THINGS: ClassVar[str] = "rows"
    LOOKED_FOR: ClassVar[str] = "holding   03:10"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("slash", "filter", "filter", tooltip="filter: show only what an expression accepts"),
        Binding("F", "saved", "saved", tooltip="a filter of the configuration by its name", show=False),
        Binding("C", "columns", "columns", tooltip="choose the columns of this list and their order", show=False),
        Binding("V", "view", "view", tooltip="a view by its name, or save what is shown as one", show=False),
        Binding("f", "app.follow", "follow", tooltip="follow the newest row, or stay"),
        Binding("t", "app.time", "time", tooltip="time of day, since the capture began, or since the row before"),
        Binding("d", "data", "data", tooltip="data only: hide tokens and polls, or show them again", show=False),
        Binding("escape", "leave", "clear", tooltip="back to the list; there: remove the filter", show=False),
        Binding("e", "error(1)", "error", tooltip="next error"),
        Binding("E", "error(-1)", "error", tooltip="error before"),
    ]

    def __init__(self) -> None:
        super().__init__()
        self._filter_version = 0
        self._saved: dict[str, str] = {}
        self._views: dict[str, View] = {}
        self._closed_seen = 0  # closed transactions that the index took into account
        self._lines_seen = 0  # and the last line then

    @property
    def lines(self) -> LineList:
        """The list."""
        return self.query_one("#main", LineList)

    def test(self, number: int) -> bool:
        """Whether the filter lets a line through."""
        raise NotImplementedError

    def known(self) -> Known | None:
        """What the filter says of many lines at once; None where each has to be tested."""
        raise NotImplementedError

    def bounds(self) -> tuple[int, int]:
        """First and last number there is to show."""
        raise NotImplementedError

    def place(self) -> int | None:
        """The number for the row under the shared cursor; None when this list has none for it."""
        raise NotImplementedError

    def rows_of(self, number: int) -> tuple[int, ...]:
        """The rows of the store that a line is about."""
        raise NotImplementedError

    # -- keeping up --------------------------------------------------------------------------------------------

    def draw(self) -> None:
        """Take new bounds and filter, and the cursor when another list moved it."""
        lines, viewing = self.lines, self.viewing
        first, last = self.bounds()
        place = self.place() if viewing.row_from is not lines and not viewing.follow else None
        viewing.row_from = lines
        if self._filter_version != viewing.filter_version:
            self._filter_version = viewing.filter_version
            anchor = min(max(place or lines.cursor or last, first), last + 1)
            index = Index(self.test if viewing.filter else None, anchor, self.known())
            index.bound(first, last)
            index.step(SLICE_ROWS)
            if viewing.masks is not None:
                end = time.perf_counter() + AT_ONCE_SECONDS
                while index.pending and time.perf_counter() < end:
                    index.step(SLICE_ROWS)
            lines.use_index(index)
        lines.bring_up(first, last)
        if place is not None:
            lines.go_to(place, by_user=False)
        self._retest_closed()
        self.query_one(FilterLine).show(viewing, lines.index, self.THINGS)

    def _retest_closed(self) -> None:
        """Rows whose transaction closed since may pass the filter now, or no longer."""
        last, before = self.viewing.last_closed, self._lines_seen
        seen, self._closed_seen, self._lines_seen = self._closed_seen, last, self.lines.index.last
        accepts = self.viewing.accepts
        if accepts is not None and accepts.of_closing and seen < last:
            numbers = [number for number in self.touched(seen + 1, last) if number <= before]
            self.lines.retest(numbers[-MOST_RETESTED:])

    def touched(self, first: int, last: int) -> Sequence[int]:
        """Lines about which the transactions that closed as `first` … `last` say something."""
        return ()

    def work_left(self) -> bool:
        """Whether the filter has not seen everything yet."""
        return self.lines.index.pending > 0

    def work(self) -> bool:
        """Search for some milliseconds."""
        index = self.lines.index
        end = time.perf_counter() + SLICE_SECONDS
        found = len(index)
        self.lines.search(SLICE_ROWS, end)
        self.query_one(FilterLine).show(self.viewing, index, self.THINGS)
        if len(index) != found:
            self.draw()
        return index.pending > 0

    # -- keys --------------------------------------------------------------------------------------------------

    def action_filter(self) -> None:
        """Ask for a filter."""
        hint = 'addr == 3 && verdict == no-response      kind contains "write"'
        self.query_one(Prompt).ask(
            "filter", self.viewing.filter, hint, self._wrong, (), self._ways, self.viewing.filters
        )

    def _ways(self, text: str) -> list[Completion]:
        return completions(text, self.store.dissector, self.viewing.counts, point_names(self.store.devices))

    def action_saved(self) -> None:
        """Ask for a filter of the configuration by its name."""
        try:
            self._saved = dict(load().filters)
        except ConfigError as error:
            self.notify(str(error), severity="error", markup=False)
            return
        if not self._saved:
            self.notify(f"no filter has a name: write [filters] into {FILE}", timeout=4, markup=False)
            return
        hint = "   ".join(f"{name}: {text}" for name, text in self._saved.items())
        self.query_one(Prompt).ask("saved filter", "", hint, self._not_saved, tuple(self._saved))

    def _not_saved(self, text: str) -> str:
        if not text.strip() or text.strip() in self._saved:
            return ""
        return f"no filter of that name: {', '.join(self._saved)}"

    def action_columns(self) -> None:
        """Ask for the columns."""
        lines = self.query_one("#main", StoreList)
        usual = tuple(column.name for column in lines.COLUMNS)
        shown = " ".join(self.viewing.columns.get(lines.NAME, usual))
        check = lambda text: wrong_columns(lines.NAME, text.split())  # noqa: E731
        self.query_one(Prompt).ask("columns", shown, f"empty: the usual ones: {' '.join(usual)}", check, usual)

    def action_view(self) -> None:
        """Ask for a view by its name; a new name saves what is shown."""
        try:
            self._views = dict(load().views)
        except ConfigError as error:
            self.notify(str(error), severity="error", markup=False)
            return
        there = f"{', '.join(self._views)}; a new name saves what is shown" if self._views else "a name for this view"
        self.query_one(Prompt).ask("view", "", there, lambda text: "", tuple(self._views))

    def _view(self, name: str) -> None:
        try:
            if name in self._views:
                use(self.viewing, name, self._views[name])
                self.query_one("#main", LineList).refresh(layout=True)
            elif is_guest():
                self.notify("who looks from another machine saves no views here", severity="warning", timeout=4)
            else:
                path = save_view(name, view_of(self.viewing))
                self.notify(f"view {name} saved in {sanitized(path)}", timeout=4, markup=False)
        except (ConfigError, FilterError, OSError) as error:
            self.notify(sanitized(str(error)), severity="error", markup=False)
        analyzer(self).draw_screen()

    def on_prompt_answered(self, message: Prompt.Answered) -> None:
        """Set the filter of that name, columns, or a view."""
        if message.purpose == "columns":
            message.stop()
            name = self.query_one("#main", StoreList).NAME
            self.viewing.columns.pop(name, None)
            if message.text.split():
                self.viewing.columns[name] = tuple(message.text.split())
            self.draw()
        elif message.purpose == "view" and message.text.strip():
            message.stop()
            self._view(message.text.strip())
        if message.purpose == "saved filter":
            message.stop()
            if message.text.strip():
                analyzer(self).filter(self._saved[message.text.strip()])

    def find_on(self, wanted: str, step: int) -> None:
        """Go to the next or previous line whose frames hold a text or octets."""
        lines = self.lines
        number, found = find(self.viewing, lines.index, wanted, lines.index.position(lines.cursor), step, self.rows_of)
        if number is None:
            self.say_not_found(wanted, step)
            return
        lines.go_to(number)
        if not found:
            self.notify(f"{wanted!r} not found up to number {number}; the same key goes on", timeout=3, markup=False)

    def say_none(self, words: str, is_hidden: bool) -> None:
        """Say that there is none further on, or where some are hidden, none that passes the filter."""
        self.notify(f"{words} passes the filter" if is_hidden and self.viewing.filter else words, timeout=2)

    def action_data(self) -> None:
        """Hide what only keeps a token-passing bus going, or show it again."""
        analyzer(self).filter("" if self.viewing.filter == DATA_ONLY else DATA_ONLY)

    def _wrong(self, text: str) -> str:
        try:
            self.viewing.compiled(text)
        except FilterError as error:
            return str(error)
        return ""

    def action_leave(self) -> None:
        """Back to the list; there: remove the filter."""
        if self.focused is not self.lines:
            self.lines.focus()
        elif self.viewing.filter:
            analyzer(self).filter("")
