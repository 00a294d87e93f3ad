"""State of the view, shared by all screens: how the user looks at the rows. Touches the store's rows, no capture."""

from __future__ import annotations

from bisect import bisect_right
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

from dissectors.findings import Finding
from dissectors.tracker import Transaction
from sniff.bus.foreign_rows import ForeignRows
from sniff.bus.row_masks import RowMasks
from sniff.bus.rows import Store
from sniff.engine.engine import Row
from sniff.engine.session import LineEvent, LineEventKind
from sniff.filter import Filter, FilterError, Scope, compile_filter
from sniff.filter.compiling import field_of
from sniff.filter.completion import shown_value
from sniff.filter.errors import OfOthers, OfTimes
from sniff.filter.told import told
from sniff.tui.times import TimeMode, ahead_of_utc

COUNTED = 2000
"""Rows around the cursor whose values are counted."""
MOST_FILTERS = 50
"""Filters that are remembered."""


@dataclass(slots=True)
class Viewing:
    """Freeze, follow, filter, marks, time mode and the row under the cursor."""

    store: Store
    follow: bool = False
    time_mode: TimeMode = TimeMode.ABSOLUTE
    row: int = 0  # number of the row under the cursor, 0 before there is one
    row_from: object = None  # the list whose cursor it is; other lists go there when they are shown
    filter: str = ""
    accepts: Filter | None = None
    masks: RowMasks | None = None  # the same for many rows at once, where columns say something of it
    filter_version: int = 0  # changes with the filter, so that lists know when to begin anew
    foreign: ForeignRows | None = None  # frames of a second protocol in what the first leaves
    columns: dict[str, tuple[str, ...]] = field(default_factory=dict)  # chosen, by list
    marks: dict[int, str] = field(default_factory=dict)  # what was written, by row number
    _events_seen: int = 0  # of the store
    _unplaced: list[LineEvent] = field(default_factory=list)  # marks whose row has not come yet
    filters: list[str] = field(default_factory=list)  # that were set, the latest last
    search: str = ""  # what was looked for last
    colours: list[tuple[str, Filter]] = field(default_factory=list)  # rows that a filter accepts have its colour
    _frozen: tuple[int, int] | None = None  # last row and last closed transaction that are shown
    _found: tuple[Finding, ...] = ()  # when it was frozen
    is_small: bool = False  # the screen has no room for much; it was said

    @property
    def frozen(self) -> bool:
        """Whether the view stands still."""
        return self._frozen is not None

    def freeze(self, on: bool) -> None:
        """Stand still at what is there now, or go on."""
        self._frozen = (self.store.last_no, self.store.last_closed) if on else None
        self._found = self.store.findings() if on else ()

    def findings(self) -> tuple[Finding, ...]:
        """What was found in the rows to show."""
        return self._found if self.frozen else self.store.findings()

    @property
    def came_since(self) -> int:
        """Rows that came since the view was frozen."""
        return 0 if self._frozen is None else self.store.last_no - self._frozen[0]

    @property
    def last_row(self) -> int:
        """Number of the last row to show."""
        return self.store.last_no if self._frozen is None else self._frozen[0]

    @property
    def last_closed(self) -> int:
        """Number of the last closed transaction to show."""
        return self.store.last_closed if self._frozen is None else self._frozen[1]

    def set_filter(self, text: str) -> None:
        """Show only what `text` accepts; an empty text shows everything. Raises FilterError."""
        text = text.strip()
        accepts = self.compiled(text) if text else None
        self.accepts = accepts
        self.masks = RowMasks(self.store.kept, accepts) if accepts is not None and accepts.in_columns else None
        self.filter = text
        self.filter_version += 1
        if text:
            self.filters = [*(one for one in self.filters if one != text), text][-MOST_FILTERS:]

    def compiled(self, text: str, others: bool = False) -> Filter:
        """A filter for these rows. `others`: what other protocols have is no mistake in it. Raises FilterError."""
        try:
            return compile_filter(text, self.store.dissector, self._scope(text), others)
        except OfOthers as error:
            if self.foreign is None or isinstance(error, OfTimes):
                raise
            first, second = self.store.dissector.title, self.foreign.second.title
            said = f"filters here ask frames of {first}; `sniff485 show -Y` asks those of {second} too"
            raise FilterError(said, error.column) from None

    def colour_rules(self, colours: Mapping[str, str]) -> None:
        """Take the filters by colour. Raises FilterError."""
        self.colours = [(colour, self.compiled(text, others=True)) for colour, text in colours.items()]

    def colour_of(self, row: Row, transaction: Transaction | None) -> str:
        """The colour of a row; "" for none."""
        return next((colour for colour, accepts in self.colours if accepts(row, transaction)), "")

    def counts(self, name: str) -> list[tuple[str, int]]:
        """Values of a field and how many of the rows around the cursor have each, the most frequent first."""
        try:
            field_ = field_of(name, self.store.dissector, self._scope(name))
        except FilterError:
            return []
        first = max(self.store.first_no, self.row - COUNTED // 2)
        counted: Counter[str] = Counter()
        for no in range(first, min(first + COUNTED, self.last_row + 1)):
            row = self.store.by_no(no)
            if row is not None:
                values = field_.get(row, self.store.transaction(row))
                counted.update({shown_value(value, field_, ahead_of_utc) for value in values})
        return counted.most_common(MOST_FILTERS)

    def _scope(self, text: str) -> Scope:
        store = self.store
        findings: dict[int, frozenset[str]] | None = None
        if "finding" in text:
            findings = {}
            for one in store.findings():
                for no in one.evidence:
                    findings[no] = findings.get(no, frozenset()) | {one.code}
        return Scope(
            store.session.started,
            store.devices,
            {},
            findings,
            self._begin_of,
            told=lambda no: [told(value) for value in store.told(no)],
            says=store.text,
            answered=store.answered,
            has_times=store.session.has_times,
            zone=ahead_of_utc,  # as the lists show times
        )

    def _begin_of(self, no: int) -> int | None:
        row = self.store.by_no(no)
        return None if row is None else row.event.start

    def accepts_row(self, no: int) -> bool:
        """Whether the filter lets a row through."""
        row = self.store.by_no(no)
        return row is not None and (self.accepts is None or self.accepts(row, self.store.transaction(row)))

    def accepts_closed(self, no: int) -> bool:
        """Whether the filter lets a closed transaction through: one of its frames passes."""
        transaction = self.store.closed_by_no(no)
        if transaction is None:
            return False
        return any(self.accepts_row(row) for row in (transaction.request, transaction.response) if row is not None)

    def take_marks(self) -> bool:
        """Take the marks that came among the events of the line since; whether there were any."""
        events = self.store.line_events
        came = [one for one in events[self._events_seen :] if one.is_mark]
        self._events_seen = len(events)
        waiting, self._unplaced = [*self._unplaced, *came], []
        for event in waiting:
            no = self.store.row_marked(event.moment)
            if no is None:
                self._unplaced.append(event)
            elif event.kind is LineEventKind.MARK:
                self.marks[no] = event.text
            else:
                self.marks.pop(no, None)
        return len(self._unplaced) < len(waiting)

    def next_mark(self) -> int | None:
        """The marked row after the cursor, round to the first; None without marks."""
        kept = [no for no in sorted(self.marks) if self.store.by_no(no) is not None]
        if not kept:
            return None
        position = bisect_right(kept, self.row)
        return kept[position % len(kept)]
