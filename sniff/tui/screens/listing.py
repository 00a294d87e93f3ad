"""What the two long lists share: the filter, pending search, following, the cursor's row."""

from __future__ import annotations

import time
from typing import ClassVar

from textual.binding import Binding, BindingType

from sniff.analysis.filtering import FIELDS, FilterError, compile_filter
from sniff.tui.analyzer import analyzer
from sniff.tui.filter_line import FilterLine
from sniff.tui.index import Index
from sniff.tui.linelist import LineList
from sniff.tui.prompt import Prompt
from sniff.tui.screens.base import ViewScreen

SLICE_SECONDS = 0.012
"""How long one piece of searching may take: short enough that a key never waits for it."""
SLICE_ROWS = 128
DATA_ONLY = "!(role in {token, poll})"
"""On an idle token ring more than nine rows of ten are tokens."""


class ListingScreen(ViewScreen):
    """A screen around one `LineList` with the id "main"; `THINGS` is what it lists."""

    THINGS: ClassVar[str] = "rows"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("slash", "filter", "filter", tooltip="filter: show only what an expression accepts"),
        Binding("f", "app.follow", "follow", tooltip="follow the newest row, or stay"),
        Binding("t", "app.time", "time", tooltip="time of day, since the first row, or since the row before"),
        Binding("d", "data", "data", tooltip="data only: hide tokens and polls, or show them again", show=False),
        Binding("escape", "leave", "clear", tooltip="back to the list; there: remove the filter", show=False),
        Binding("e", "error(1)", "error", tooltip="next error"),
        Binding("E", "error(-1)", "error", tooltip="error before"),
    ]

    def __init__(self) -> None:
        super().__init__()
        self._filter_version = 0
        self._closed_seen = 0  # closed transactions that the index took into account

    @property
    def lines(self) -> LineList:
        """The list."""
        return self.query_one("#main", LineList)

    def test(self, number: int) -> bool:
        """Whether the filter lets a line through."""
        raise NotImplementedError

    def bounds(self) -> tuple[int, int]:
        """First and last number there is to show."""
        raise NotImplementedError

    def place(self) -> int | None:
        """The number for the row under the shared cursor; None when this list has none for it."""
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
            index = Index(self.test if viewing.filter else None, anchor)
            index.bound(first, last)
            index.step(SLICE_ROWS)
            lines.use_index(index)
        lines.bring_up(first, last)
        if place is not None:
            lines.go_to(place, by_user=False)
        self._retest_closed()
        self.query_one(FilterLine).show(viewing, lines.index, self.THINGS)

    def _retest_closed(self) -> None:
        """Rows whose transaction closed since may pass the filter now, or no longer."""
        last = self.viewing.last_closed
        seen = max(self._closed_seen, last - 5000)
        self._closed_seen = last
        if self.lines.index.test is not None and seen < last:
            self.lines.retest(number for no in range(seen + 1, last + 1) for number in self.touched(no))

    def touched(self, closed: int) -> tuple[int, ...]:
        """Lines about which a transaction that closed says something."""
        return ()

    def work_left(self) -> bool:
        """Whether the filter has not seen everything yet."""
        return self.lines.index.pending > 0

    def work(self) -> bool:
        """Search for some milliseconds."""
        index = self.lines.index
        end = time.perf_counter() + SLICE_SECONDS
        found = len(index)
        self.lines.search(SLICE_ROWS)
        while index.pending and time.perf_counter() < end:
            self.lines.search(SLICE_ROWS)
        self.query_one(FilterLine).show(self.viewing, index, self.THINGS)
        if len(index) != found:
            self.draw()
        return index.pending > 0

    # -- keys --------------------------------------------------------------------------------------------------

    def action_filter(self) -> None:
        """Ask for a filter."""
        hint = 'addr == 3 && verdict == no-response      kind contains "write"'
        self.query_one(Prompt).ask("filter", self.viewing.filter, hint, self._wrong, FIELDS)

    def action_data(self) -> None:
        """Hide what only keeps a token-passing bus going, or show it again."""
        analyzer(self).filter("" if self.viewing.filter == DATA_ONLY else DATA_ONLY)

    def _wrong(self, text: str) -> str:
        try:
            compile_filter(text, self.store.dissector)
        except FilterError as error:
            return str(error)
        return ""

    def action_leave(self) -> None:
        """Back to the list; there: remove the filter."""
        if self.focused is not self.lines:
            self.lines.focus()
        elif self.viewing.filter:
            analyzer(self).filter("")
