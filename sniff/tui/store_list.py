"""Base of the lists of frames and of transactions: the store, the layout of columns, and how time is counted."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from sniff.bus.rows import Store
from sniff.engine.engine import Row
from sniff.tui.columns import Column, chosen, lay_out
from sniff.tui.linelist import LineList
from sniff.tui.times import TimeMode, clock, seconds
from sniff.tui.verdicts import latency_title
from sniff.tui.view_state import Viewing

WIDE = 110
"""From this width on the verdict is written in full."""
NO_LATENCY, NO_TIME = 70, 56
"""Below these widths latency, then time, gives way to what a row says."""
LATENCY = len("99999.0?")
DAY = 10**14
"""About a day, ns: from then on relative times are written in milliseconds, or the column would not hold them."""


class StoreList(LineList):
    """A list of what a store holds; the first of `COLUMNS` holds the numbers. `NAME`: of the list in a view."""

    COLUMNS: ClassVar[tuple[Column, ...]]
    NAME: ClassVar[str] = ""

    def __init__(self, store: Store, viewing: Viewing, *, id: str | None = None) -> None:
        super().__init__(viewing, id=id)
        self.store = store

    def lay_out_columns(self, width: int) -> list[Column]:
        """What is needed least gives way first; the one column without a width takes what is left."""
        latency = latency_title(self.store.session.adapter.latency, roomy=width >= WIDE)
        titles = {"time": self.viewing.time_mode.title, "latency": latency}
        names = self.viewing.columns.get(self.NAME, ())
        shown = lay_out(
            chosen(self.COLUMNS, names),
            width,
            verdict=15 if width >= WIDE else 9,
            latency=0 if width < NO_LATENCY and not names else max(LATENCY, len(latency)),
            time=0 if (width < NO_TIME and not names) or not self.store.session.has_times else 12,
            **{self.COLUMNS[0].name: max(4, len(str(self.index.last)) + 1)},  # the signs at the edge stand apart
        )
        return [replace(column, title=titles.get(column.name, column.title)) for column in shown]

    def width_of(self, name: str) -> int:
        """Cells that a column has now."""
        return next((column.width for column in self.columns if column.name == name), 0)

    def brief_text(self, row: Row, room: int) -> str:
        """What a row says and means, with less of it where `room` cells are too few; all of it once it is scrolled."""
        return self.store.text(row) if self.shifted else self.store.brief_text(row, room)

    def time_text(self, start: int, before: int | None) -> str:
        """A time in the way the user counts; `before`: when the line above began, None at the top."""
        mode = self.viewing.time_mode
        if mode is TimeMode.ABSOLUTE:
            return clock(start)
        if mode is TimeMode.RELATIVE:
            passed = start - self.store.session.started  # as every command counts
            return seconds(passed, 6 if passed < DAY else 3)
        return seconds(0 if before is None else start - before)
