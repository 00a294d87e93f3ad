"""Screen 5: what is wrong, in words, the gravest first; enter goes to the frames that show it."""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import ClassVar

from rich.text import Text
from textual import events
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.widgets import DataTable, Static

from dissectors.findings import Finding, Severity, counted, under_causes
from sniff.analysis.judging import rules_over
from sniff.analysis.sanitizing import sanitized
from sniff.analysis.site_rules import SITE_RULES
from sniff.tui.analyzer import analyzer
from sniff.tui.columns import fit
from sniff.tui.hanging import hanging
from sniff.tui.screens.searching import SearchScreen
from sniff.tui.still_judging import still_judging
from sniff.tui.tables import StationTable
from sniff.tui.times import between, clock

EVIDENCE = 6
"""Frames that are named at least."""
PERIOD = 1.0
"""Seconds between two looks at the findings while rows keep coming."""

COLUMNS = ("how grave", "about", "what was seen", "times", "last", "code")
_WORDS = {Severity.ERROR: "ERROR", Severity.WARNING: "warning", Severity.NOTE: "note", Severity.INFO: "info"}
_STYLES = {Severity.ERROR: "bold red", Severity.WARNING: "yellow", Severity.NOTE: "", Severity.INFO: "dim"}
OTHERS = 32
"""Cells that the columns take whose width does not change, those between them too; what was seen has the rest."""
LEAST_SEEN = 30
ROOMY = 110
"""Width from which there is a column for when it was seen last."""
LABEL, SIDES = 7, 3
"""Cells of a label below the table, and of what stands at both sides of its lines."""
ABOVE_FRAMES = 12
"""Lines of the lower half that are not theirs: what the finding says, header and keys."""
TALL = 40
"""Height from which frames that show a finding stand below each other, with what they say."""


class FindingsScreen(SearchScreen):
    """A line a finding; below it what it means, what to do next, and where to see it."""

    TITLE = "Findings"
    CSS_PATH = "findings.tcss"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("s", "order", "order", tooltip="order by severity, or by subject"),
        Binding("i", "infos", "infos", tooltip="show or hide notes and infos"),
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
        self._hidden = 0  # findings that are left out
        self._found: dict[str, Finding] = {}
        self._under: set[str] = set()  # keys of those that one above explains
        self._evidence: dict[str, int] = {}  # place in the evidence of each finding that was shown last
        self._titles: dict[str, str] = {}
        self._width = 0

    def compose_view(self) -> ComposeResult:
        """The table, and the finding under the cursor in full."""
        yield StationTable(id="main", cursor_type="row", zebra_stripes=True)
        with VerticalScroll(id="detail"):
            yield Static(id="words", markup=False)
            yield Static(id="advice", markup=False)  # what to do is what one came for: the brightest text
            yield Static(id="places", markup=False)

    def on_mount(self) -> None:
        """Columns."""
        table = self.query_one(StationTable)
        table.cell_padding = 1
        self._lay_out(self.app.size.width)
        if analyzer(self).buses:
            self.set_interval(PERIOD, self._look_beyond)

    def on_resize(self, event: events.Resize) -> None:
        """Other width, more or less of what was seen."""
        self._lay_out(event.size.width)

    def _lay_out(self, width: int) -> None:
        if width == self._width:
            return
        self._width = width
        table = self.query_one(StationTable)
        table.clear(columns=True)
        for name in self._columns():
            table.add_column(Text(name, justify="right" if name == "times" else "left"), key=name)
        if self._found:
            self._look()

    def _columns(self) -> tuple[str, ...]:
        return COLUMNS if self._width >= ROOMY else tuple(name for name in COLUMNS if name != "last")

    # -- keeping up --------------------------------------------------------------------------------------------

    def draw(self) -> None:
        """Look again, at most once a second, and when all has been judged."""
        open_end = bool(still_judging(analyzer(self).status, self.store))
        if open_end != self._open_end or time.monotonic() - self._looked >= PERIOD:
            self._open_end = open_end
            self._look()

    def _look_beyond(self) -> None:
        """The other buses may have been read to their end meanwhile."""
        if self.is_current and analyzer(self).site_is_due():
            self._look()

    def _look(self) -> None:
        self._looked = time.monotonic()
        rules = {**rules_over(self.store.dissector), **SITE_RULES}
        self._titles = {code: rule.title for code, rule in rules.items()}
        known = analyzer(self).findings()
        found = [f for f in known if self._all or f.severity >= Severity.WARNING or f.cause is not None]
        self._hidden = len(known) - len(found)
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
        """Those under a cause begin with "└"."""
        room = max(LEAST_SEEN, self._width - self._others())
        cells = {
            "how grave": Text(("└ " if under else "") + _WORDS[finding.severity], style=_STYLES[finding.severity]),
            "about": Text(sanitized(finding.subject)),
            "what was seen": Text(fit(sanitized(finding.seen), room).rstrip()),
            "times": Text("" if finding.is_once else str(finding.count), justify="right"),
            "last": Text(clock(finding.last) if self.store.session.has_times else "–"),
            "code": Text(finding.code, style="dim"),
        }
        return [cells[name] for name in self._columns()]

    def _others(self) -> int:
        """Cells that the other columns take, those between them too."""
        longest = max((len(one.subject) for one in self._found.values()), default=0)
        return OTHERS + max(len("about"), longest) + (14 if self._width >= ROOMY else 0)

    def _describe(self) -> None:
        words, advice, places = (self.query_one(name, Static) for name in ("#words", "#advice", "#places"))
        finding = self._here()
        open_end = still_judging(analyzer(self).status, self.store)
        text = Text()
        if open_end:
            text.append(f"{open_end}; more may be found, or found to be otherwise\n", style="yellow")
        if finding is None:
            nothing = f"no error and no warning; i shows {counted(self._hidden, 'finding')} of less weight"
            words.update(text if open_end else nothing if self._hidden else "nothing was found")
            advice.display = False
            places.update("")
            return
        text.append(f"{_WORDS[finding.severity]} ", style=_STYLES[finding.severity])
        title = self._titles.get(finding.code, "")
        text.append(sanitized(f"{finding.subject}: {title}" if title else finding.subject), style="bold")
        text.append(f"  {finding.code}\n", style="dim")
        text.append("seen   ", style="dim").append(sanitized(finding.seen) + "\n")
        if finding.means:
            text.append("means  ", style="dim").append(sanitized(finding.means) + "\n")
        text.rstrip()
        words.update(self._hanging(text))
        advice.update(self._hanging(Text(f"next   {sanitized(finding.next)}" if finding.next else "")))
        advice.display = bool(finding.next)
        places.update(self._hanging(self._places(finding)))

    def _hanging(self, text: Text) -> Text:
        return hanging(text, self._width - SIDES, LABEL)

    def _places(self, finding: Finding) -> Text:
        text = Text()
        if finding.cause is not None:
            text.append("from   ", style="dim").append(sanitized(" ".join(reversed(finding.cause))) + "\n")
        if self.store.session.has_times:
            text.append("when   ", style="dim").append(f"{between(finding.first, finding.last)}\n")
        if finding.evidence:
            text.append("frames ", style="dim").append_text(self._frames(finding.evidence))
        text.rstrip()
        return text

    def _frames(self, evidence: tuple[int, ...]) -> Text:
        most = EVIDENCE if self.size.height < TALL else max(EVIDENCE, self.size.height // 2 - ABOVE_FRAMES)
        more = " …" if len(evidence) > most else ""
        if self.size.height < TALL:
            said = Text(", ".join(self._place(no) for no in evidence[:most]) + more)
            return said.append("  enter, e, E go there", style="dim")
        said = Text().append("enter, e, E go there", style="dim")
        for no in evidence[:most]:
            row = self.store.by_no(no)
            what = "" if row is None else f"  {sanitized(self.store.text(row))}"
            said.append("\n" + " " * LABEL + fit(self._place(no) + what, self._width - SIDES - LABEL).rstrip())
        return said.append(f"\n{' ' * LABEL}and {len(evidence) - most} more" if more else "")

    def _place(self, no: int) -> str:
        row = self.store.by_no(no)
        return f"{no} at {clock(row.event.start)}" if row is not None and self.store.session.has_times else f"{no}"

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
        """With notes and infos, or without."""
        self._all = not self._all
        self._look()
        if self._hidden:
            self.notify("notes and infos are hidden: i shows them", timeout=2)


def _keyed(found: Iterable[Finding]) -> dict[str, Finding]:
    """By what they are about, in their order; two of the same code about the same subject keep a line each."""
    keyed: dict[str, Finding] = {}
    for finding in found:
        key, again = f"{finding.code} {finding.subject}", 1
        while (name := key if again == 1 else f"{key} {again}") in keyed:
            again += 1
        keyed[name] = finding
    return keyed
