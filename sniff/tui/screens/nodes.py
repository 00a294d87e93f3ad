"""Screen 3: who is on the bus, and who fails: the worst first."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from rich.text import Text
from textual import events
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.widgets import DataTable, Static

from dissectors.findings import Finding, counted
from dissectors.tracker import Verdict
from dissectors.words import milliseconds
from sniff.analysis.health import Health, station_of
from sniff.analysis.nodes import Node
from sniff.analysis.poll_words import asked
from sniff.analysis.sanitizing import sanitized
from sniff.tui.analyzer import analyzer
from sniff.tui.charts import spread
from sniff.tui.columns import fit
from sniff.tui.hanging import hanging
from sniff.tui.screens.searching import SearchScreen
from sniff.tui.still_judging import still_judging
from sniff.tui.tables import StationTable, count_cell
from sniff.tui.times import interval, latency

ANSWERS = (Verdict.ANSWERED, Verdict.RETRY, Verdict.EXCEPTION)
FEW, SOME = 3, 8
"""Frame types in the table, and below it."""
BEFORE_KINDS = 128
"""Cells of all other columns and of " and 9 more": so many less than the screen has are theirs in the table."""
LEAST_ASKED = 4
"""Lines that what a station is asked for takes at least, where it is that much."""


def answered(node: Node) -> float | None:
    """Share of the requests to a station that it answered in time, exceptions included; None when never asked."""
    return sum(node.verdicts[verdict] for verdict in ANSWERS) / node.asked if node.asked else None


def _percent(share: float | None) -> str:
    if share is None:
        return "–"
    text = f"{share:.1%}"
    return "99.9%" if text == "100.0%" and share < 1 else text  # one failure in ten thousand is still a failure


def _time(value: int | None) -> str:
    return "–" if value is None else latency(value)


LABEL, SIDES = 8, 3
"""Cells of a label in the details, and of what stands at both sides of them."""


@dataclass(frozen=True, slots=True)
class Station:
    """What a line shows. `device`: name of its profile; `identity`: the numbers by which it calls itself. `room`: cells
    for its frame types."""

    node: Node
    health: Health | None = None
    device: str = ""
    identity: tuple[int, ...] = ()
    room: int = 0
    findings: tuple[Finding, ...] = field(default=(), compare=False)

    @property
    def score(self) -> float:
        """Health to sort by; those without one stand last."""
        return 101 if self.health is None else self.health.score


def kinds(node: Node, most: int, room: int | None = None) -> str:
    """Frame types of the exchanges with a station, the most frequent first, as many as have `room` (cells)."""
    named = [f"{kind} {count}" for kind, count in node.kinds.most_common(most)]
    while room is not None and len(named) > 1 and len(", ".join(named)) > room:
        named.pop()
    more = len(node.kinds) - len(named)
    return ", ".join(named) + (f" and {more} more" if more > 0 else "")


COLUMNS: tuple[tuple[str, int, Callable[[Station], str]], ...] = (
    ("stn", 0, lambda one: str(one.node.address)),
    ("health", 0, lambda one: "–" if one.health is None else str(one.health.score)),
    ("device", 72, lambda one: one.device),
    ("id", 72, lambda one: "/".join(map(str, one.identity))),
    ("asked", 0, lambda one: str(one.node.asked)),
    ("answ.", 0, lambda one: _percent(answered(one.node))),
    ("none", 0, lambda one: str(one.node.unanswered)),
    ("exc.", 56, lambda one: str(one.node.verdicts[Verdict.EXCEPTION])),
    ("dam.", 56, lambda one: str(one.node.damaged)),
    ("p50 ms", 110, lambda one: _time(one.node.latency.quantile(0.5))),
    ("p95 ms", 64, lambda one: _time(one.node.latency.quantile(0.95))),
    ("max ms", 95, lambda one: _time(one.node.latency.most)),
    ("sent", 110, lambda one: str(one.node.sent)),
    ("recv", 110, lambda one: str(one.node.received)),
    ("passed", 110, lambda one: str(one.node.passed)),
    ("frame types", 150, lambda one: kinds(one.node, FEW, one.room)),
)
"""Title, width of the screen from which it is shown, text."""
ROOMY = 150
IN_FULL = {"answ.": "answered", "none": "no answer", "exc.": "exceptions", "dam.": "damaged", "recv": "received"}
"""Titles from that width on."""
SELDOM = {"device", "id", "passed"}
"""Columns that are left out where no station has anything there."""
LEFT = {"device", "id", "frame types"}
COUNTS = {"asked", "none", "exc.", "dam.", "sent", "recv", "passed"}
TROUBLE = {"none", "exc.", "dam."}
"""Columns where anything but 0 is worth a look: such cells get a "!"."""
POOR = 50
"""A health below this gets one too."""


def _least_answered(one: Station) -> tuple[float, ...]:
    share = answered(one.node)
    return 2.0 if share is None else share, -one.node.damaged, one.node.address


Order = Callable[[Station], tuple[float, ...]]
ORDERS: tuple[tuple[str, Order], ...] = (
    ("worst health", lambda one: (one.score, *_least_answered(one))),
    ("address", lambda one: (one.node.address,)),
    ("least answered", lambda one: _least_answered(one)),
    ("slowest", lambda one: (-(one.node.latency.quantile(0.95) or 0), one.node.address)),
    ("most damaged", lambda one: (-one.node.damaged, one.node.address)),
)


class NodesScreen(SearchScreen):
    """One line a station, and the one under the cursor in full; enter shows its frames."""

    TITLE = "Nodes"
    CSS_PATH = "nodes.tcss"
    LEGEND = (
        ("health", "0 to 100; below the table stands what it is made of"),
        ("device id", "profile (-d), and the number by which the station calls itself on the bus"),
        ("answ.", "share of its requests that were answered in time, exceptions too"),
        ("none", "requests without answer"),
        ("exc.  dam.", "exceptions; damaged frames"),
        ("p50 p95 max", "ms; time to its answers: half are shorter, 95 of 100 are, the longest"),
        ("sent recv", "frames from it and to it"),
        ("passed", "tokens and polls for masters that it got"),
    )
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("s", "sort", "sort", tooltip="sort by worst health, address, least answered, slowest, most damaged"),
    ]

    def __init__(self) -> None:
        super().__init__()
        self._order = 0
        self._drawn: tuple[object, ...] | None = None
        self._columns: tuple[str, ...] = ()
        self._is_roomy = False
        self._stations: dict[str, Station] = {}

    def compose_view(self) -> ComposeResult:
        """The table, how it is sorted, and the station under the cursor."""
        yield StationTable(id="main", cursor_type="row", zebra_stripes=True)
        yield Static(id="legend", markup=False)
        with VerticalScroll(id="detail", can_focus=False):
            yield Static(id="words", markup=False)

    def on_mount(self) -> None:
        """Close together."""
        self.query_one(StationTable).cell_padding = 1

    def on_resize(self, event: events.Resize) -> None:
        """Columns that fit."""
        self._drawn = None
        self.call_after_refresh(self.draw)

    def draw(self) -> None:
        """Bring the table up to date, unless frozen."""
        report = analyzer(self).health.report
        state = (self.store.heard, id(report), self._order)
        if self._drawn == state or (self.viewing.frozen and self._drawn and self._drawn[2] == self._order):
            return
        self._drawn = state
        title, order = ORDERS[self._order]
        stations = sorted(self._present(), key=order)
        self._stations = {str(one.node.address): one for one in stations}
        table = self.query_one(StationTable)
        self._lay_out(table, stations)
        table.fill((key, self._cells(one)) for key, one in self._stations.items())
        latency = self.store.session.adapter.latency
        doubt = f" · times ±{milliseconds(latency)}" if latency and self.store.session.has_times else ""
        said = still_judging(analyzer(self).status, self.store)
        legend = f"{counted(len(stations), 'station')}, sorted by {title}{doubt}" + (f" · {said}" if said else "")
        self.query_one("#legend", Static).update(legend)
        self._describe()

    def _present(self) -> Iterable[Station]:
        report, devices, ring = analyzer(self).health.report, self.store.devices, self.store.dissector.ring
        scores: Mapping[int, Health] = {} if report is None else report.stations
        identities = {} if ring is None else ring.identities(self.store.model.ring())
        about: dict[int | None, list[Finding]] = {}
        for finding in self.viewing.findings():
            about.setdefault(station_of(finding), []).append(finding)
        room = self.app.size.width - BEFORE_KINDS
        for node in self.store.nodes.present():
            at = node.address
            profile = devices.at(at)
            name = "" if profile is None or not node.asked else profile.name
            yield Station(node, scores.get(at), name, identities.get(at, ()), room, tuple(about.get(at, ())))

    def _lay_out(self, table: StationTable, stations: list[Station]) -> None:
        width = self.app.size.width
        columns = tuple(
            title
            for title, needs, text in COLUMNS
            if needs <= width and (title not in SELDOM or any(text(one) not in ("", "0") for one in stations))
        )
        is_roomy = width >= ROOMY
        if (columns, is_roomy) != (self._columns, self._is_roomy):
            self._columns, self._is_roomy = columns, is_roomy
            table.clear(columns=True)
            for title in columns:
                said = IN_FULL.get(title, title) if is_roomy else title
                table.add_column(Text(said, justify="left" if title in LEFT else "right"), key=title)

    def _cells(self, one: Station) -> list[Text]:
        return [_cell(title, text(one), one) for title, _, text in COLUMNS if title in self._columns]

    # -- the station under the cursor --------------------------------------------------------------------------

    def _describe(self) -> None:
        key = self.query_one(StationTable).key_here()
        one = self._stations.get(key or "")
        self.query_one("#words", Static).update("" if one is None else self._words(one))

    def _words(self, one: Station) -> Text:
        node, profile = one.node, self.store.devices.at(one.node.address)
        text = Text()
        text.append(f"{self.store.dissector.noun} {node.address}", style="bold")
        if one.device and profile is not None:
            text.append(sanitized(f" · {profile.title}"))
        if one.identity:
            text.append(f" · calls itself device {' and '.join(map(str, one.identity))}")
        score = "not known yet" if one.health is None else f"{one.health.score} of 100"
        text.append("\nhealth  ", style="dim").append(score, style="bold")
        if one.health is not None and one.health.reasons:
            text.append(sanitized(": " + "; ".join(one.health.reasons)))
        for finding in one.findings[:SOME]:
            text.append(f"\n{finding.severity.label:<8}", style="dim").append(sanitized(finding.seen))
        if node.kinds:
            text.append("\nframes  ", style="dim").append(sanitized(kinds(node, SOME)))
        spoilt = Counter({verdict.words: count for verdict, count in node.verdicts.items()})
        if spoilt:
            text.append("\noutcome ", style="dim").append(
                ", ".join(f"{words} {count}" for words, count in spoilt.most_common())
            )
        if node.errors:
            named = (f"{count} × {error}" for error, count in node.errors.most_common(SOME))
            text.append("\nerrors  ", style="dim").append(sanitized("; ".join(named)))
        if node.passed:
            text.append("\ntokens  ", style="dim").append(
                f"{counted(node.passed, 'token or poll', 'tokens and polls')} for masters came to it"
                + (f"; {counted(node.unused, 'token')} of those it did not use" if node.unused else "")
            )
        if node.latency.count:
            text.append("\nanswers after\n", style="dim")
            text.append("\n".join(spread(node.latency, max(10, self.size.width - 34))))
        text = hanging(text, self.size.width - SIDES, LABEL)
        return text.append_text(self._asked(node, self.query_one("#detail").size.height - text.plain.count("\n") - 3))

    def _asked(self, node: Node, room: int) -> Text:
        """What it is asked for, the most frequent first, in so many lines; nothing where they are too few."""
        polls = [poll for poll in self.store.polls if poll.key.station == node.address]
        if not polls or room < min(len(polls), LEAST_ASKED):
            return Text()
        polls.sort(key=lambda poll: -poll.asked - poll.repeats)
        shown = polls if len(polls) <= room else polls[: room - 1]
        text = Text().append("\nis asked for", style="dim")
        for poll in shown:
            often = "once" if poll.asked + poll.repeats == 1 else f"{poll.asked + poll.repeats} times"
            is_timed = poll.interval is not None and self.store.session.has_times
            every = "" if not is_timed else f" every {interval(poll.interval)} ms"
            said = asked(poll, self.store.devices, self.size.width - 40) or poll.key.kind
            bad = f", {poll.unanswered} without answer" if poll.unanswered else ""
            line = fit(sanitized(f"{often + every:>25}  {said}{bad}"), self.size.width - SIDES)
            text.append("\n" + line.rstrip())
        left = len(polls) - len(shown)
        return text.append(f"\n{'':25}  and {left} more: Polls (8)" if left else "", style="dim")

    # -- keys --------------------------------------------------------------------------------------------------

    def action_sort(self) -> None:
        """Next order."""
        self._order = (self._order + 1) % len(ORDERS)
        self.draw()

    def on_data_table_row_highlighted(self, event: DataTable.RowHighlighted) -> None:
        """The cursor went to another station."""
        event.stop()
        self._describe()

    def on_data_table_row_selected(self, event: DataTable.RowSelected) -> None:
        """Enter or click on a station."""
        event.stop()
        self.action_choose()

    def action_choose(self) -> None:
        """Show the frames of the station under the cursor."""
        key = self.query_one(StationTable).key_here()
        if key is not None:
            analyzer(self).filter(f"addr == {key}")
            analyzer(self).action_switch("frames")


def _cell(title: str, text: str, one: Station) -> Text:
    if title in COUNTS:
        return count_cell(text, title in TROUBLE)
    if title == "health" and one.health is not None and one.health.score < POOR:
        return Text(f"!{text}", style="bold", justify="right")
    return Text(sanitized(text), justify="left" if title in LEFT else "right")
