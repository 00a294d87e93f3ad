"""Screen 5: what is wrong, in words, the gravest first; enter goes to the frames that show it."""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.widgets import DataTable, Static

from dissectors.findings import Finding, Severity, under_causes
from sniff.analysis.judging import rules_over
from sniff.tui.analyzer import analyzer
from sniff.tui.plain import plain
from sniff.tui.screens.base import ViewScreen
from sniff.tui.still_judging import still_judging
from sniff.tui.tables import StationTable
from sniff.tui.times import clock

PERIOD = 1.0
"""Seconds between two looks at the findings while rows keep coming."""

COLUMNS = ("severity", "code", "subject", "n", "what")
_SIGNS = {Severity.ERROR: "E!", Severity.WARNING: "W", Severity.NOTE: "n", Severity.INFO: "i"}
_STYLES = {Severity.ERROR: "bold red", Severity.WARNING: "yellow", Severity.NOTE: "", Severity.INFO: "dim"}


class FindingsScreen(ViewScreen):
    """A line a finding; below it what it means, what to do next, and where to see it."""

    TITLE = "Findings"
    CSS_PATH = "findings.tcss"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("s", "order", "order", tooltip="order by severity, or by subject"),
        Binding("i", "infos", "facts", tooltip="show or hide facts and notes"),
        Binding("e", "evidence(1)", "next", tooltip="next frame that shows the finding under the cursor"),
        Binding("E", "evidence(-1)", "before", tooltip="frame before that shows it", show=False),
    ]

    def __init__(self) -> None:
        super().__init__()
        self._looked = -PERIOD
        self._first_look = True
        self._open_end = False
        self._by_subject = False
        self._all = True
        self._found: dict[str, Finding] = {}
        self._under: set[str] = set()  # keys of those that one above explains
        self._evidence: dict[str, int] = {}  # place in the evidence of each finding that was shown last
        self._titles: dict[str, str] = {}

    def compose_view(self) -> ComposeResult:
        """The table, and the finding under the cursor in full."""
        yield StationTable(id="main", cursor_type="row", zebra_stripes=True)
        with VerticalScroll(id="detail"):
            yield Static(id="words", markup=False)

    def on_mount(self) -> None:
        """Columns."""
        table = self.query_one(StationTable)
        for name in COLUMNS:
            table.add_column(Text("" if name == "severity" else name), key=name)
        table.cell_padding = 1

    # -- keeping up --------------------------------------------------------------------------------------------

    def draw(self) -> None:
        """Look again, at most once a second, and when all has been judged."""
        open_end = bool(still_judging(analyzer(self).status, self.store))
        if open_end != self._open_end or time.monotonic() - self._looked >= PERIOD:
            self._open_end = open_end
            self._look()

    def _look(self) -> None:
        self._looked = time.monotonic()
        self._titles = {code: rule.title for code, rule in rules_over(self.store.dissector).items()}
        found = [
            f for f in self.viewing.findings() if self._all or f.severity >= Severity.WARNING or f.cause is not None
        ]
        if self._by_subject:
            found.sort(key=lambda f: (f.subject, -f.severity, f.code))
        ordered = under_causes(found)
        self._found = _keyed(one for one, _ in ordered)
        self._under = {key for key, (_, under) in zip(self._found, ordered, strict=True) if under}
        table = self.query_one(StationTable)
        table.fill((key, self._cells(f, key in self._under)) for key, f in self._found.items())
        if self._first_look:  # the cursor stays on the gravest one until all was read once
            table.move_cursor(row=0, animate=False)
            self._first_look = bool(still_judging(analyzer(self).status, self.store))
        self._describe()

    # -- showing -----------------------------------------------------------------------------------------------

    def _cells(self, finding: Finding, under: bool) -> list[Text]:
        style = _STYLES[finding.severity]
        title = self._titles.get(finding.code, "")
        subject = f"└ {finding.subject}" if under else finding.subject
        cells = (_SIGNS[finding.severity], finding.code, subject, str(finding.count), title)
        return [Text(plain(cell), style=style if at in (0, 1) else "") for at, cell in enumerate(cells)]

    def _describe(self) -> None:
        words = self.query_one("#words", Static)
        finding = self._here()
        open_end = still_judging(analyzer(self).status, self.store)
        text = Text()
        if open_end:
            text.append(f"{open_end}; more may be found, or found to be otherwise\n", style="yellow")
        if finding is None:
            words.update(text if open_end else "nothing was found")
            return
        text.append(f"{finding.severity.label} {finding.code} ", style=_STYLES[finding.severity])
        text.append(plain(f"{finding.subject}: {finding.seen}") + "\n")
        for word, said in (("means", finding.means), ("next", finding.next)):
            if said:
                text.append(f"{word}: ", style="bold")
                text.append(plain(said) + "\n")
        if finding.evidence:
            text.append("frames: ", style="bold")
            text.append(", ".join(self._place(no) for no in finding.evidence[:8]) + " (enter, e, E)\n")
        span = (
            clock(finding.first) if finding.first == finding.last else f"{clock(finding.first)} … {clock(finding.last)}"
        )
        text.append(f"seen: {span}", style="dim")
        words.update(text)

    def _place(self, no: int) -> str:
        row = self.store.by_no(no)
        return f"{no}" if row is None else f"{no} at {clock(row.event.start)}"

    def _here(self) -> Finding | None:
        key = self.query_one(StationTable).key_here()
        return self._found.get(key) if key is not None else None

    # -- keys --------------------------------------------------------------------------------------------------

    def on_data_table_row_highlighted(self, event: DataTable.RowHighlighted) -> None:
        """The cursor moved."""
        event.stop()
        self._describe()

    def on_data_table_row_selected(self, event: DataTable.RowSelected) -> None:
        """Enter or click: the first frame that shows it."""
        event.stop()
        self._go(0)

    def action_evidence(self, step: int) -> None:
        """The next frame that shows the finding under the cursor, or the one before."""
        key = self.query_one(StationTable).key_here()
        self._go(self._evidence.get(key or "", -1 if step > 0 else 0) + step)

    def _go(self, place: int) -> None:
        finding, key = self._here(), self.query_one(StationTable).key_here()
        if finding is None or key is None:
            return
        kept = [no for no in finding.evidence if self.store.by_no(no) is not None]
        if not kept:
            self.app.notify("no frame of it is kept" if finding.evidence else "it is about no single frame", timeout=3)
            return
        self._evidence[key] = place % len(kept)
        analyzer(self).show_row(kept[place % len(kept)])

    def action_order(self) -> None:
        """By severity, or by subject."""
        self._by_subject = not self._by_subject
        self.app.notify(f"ordered by {'subject' if self._by_subject else 'severity'}", timeout=2)
        self._look()

    def action_infos(self) -> None:
        """With facts and notes, or without."""
        self._all = not self._all
        self._look()


def _keyed(found: Iterable[Finding]) -> dict[str, Finding]:
    """By what they are about, in their order; two of the same code about the same subject keep a line each."""
    keyed: dict[str, Finding] = {}
    for finding in found:
        key, again = f"{finding.code} {finding.subject}", 1
        while (name := key if again == 1 else f"{key} {again}") in keyed:
            again += 1
        keyed[name] = finding
    return keyed
