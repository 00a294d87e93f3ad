"""What the lists of frames and of transactions share: the store, the layout of columns, and how time is counted."""

from __future__ import annotations

from typing import ClassVar

from sniff.store import Store
from sniff.tui.columns import Column, lay_out
from sniff.tui.linelist import LineList
from sniff.tui.times import TimeMode, clock, seconds
from sniff.tui.verdicts import latency_width
from sniff.tui.viewing import Viewing

WIDE = 110
"""From this width on the verdict is written in full."""
DAY = 10**14
"""About a day, ns: from then on relative times are written in milliseconds, or the column would not hold them."""


class StoreList(LineList):
    """A list of what a store holds; the first of `COLUMNS` holds the numbers."""

    COLUMNS: ClassVar[tuple[Column, ...]]

    def __init__(self, store: Store, viewing: Viewing, *, id: str | None = None) -> None:
        super().__init__(viewing, id=id)
        self.store = store

    def lay_out_columns(self, width: int) -> list[Column]:
        """What is needed least gives way first; the one column without a width takes what is left."""
        return lay_out(
            self.COLUMNS,
            width,
            verdict=15 if width >= WIDE else 9,
            latency=max(10, latency_width(self.store.session.adapter.latency)),
            **{self.COLUMNS[0].name: max(4, len(str(self.index.last)))},
        )

    def width_of(self, name: str) -> int:
        """Cells that a column has now."""
        return next(column.width for column in self.columns if column.name == name)

    def time_text(self, start: int, before: int | None) -> str:
        """A time in the way the user counts; `before`: when the line above began, None at the top."""
        mode = self.viewing.time_mode
        if mode is TimeMode.ABSOLUTE:
            return clock(start)
        if mode is TimeMode.RELATIVE:
            passed = start - (self.store.load.first or start)
            return seconds(passed, 6 if passed < DAY else 3)
        return seconds(0 if before is None else start - before)
