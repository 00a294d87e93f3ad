"""Screen 9: the line, what the adapter can know of it, and what happened to it."""

from __future__ import annotations

from collections import Counter
from typing import ClassVar

from rich.table import Table
from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Container, VerticalScroll
from textual.events import Resize
from textual.widgets import Static

from dissectors import registry
from dissectors.findings import counted
from dissectors.frame import LineError
from dissectors.line import NS_PER_S
from dissectors.words import milliseconds, percent
from sniff.analysis.sanitizing import sanitized
from sniff.bus.feed import FeedStatus
from sniff.bus.rows import Store
from sniff.engine.session import LineEvent, Session
from sniff.tui.analyzer import analyzer
from sniff.tui.charts import spread
from sniff.tui.key_names import named
from sniff.tui.plot import LEAST, HistoryPlot
from sniff.tui.screens.base import ViewScreen
from sniff.tui.times import UNTIMED, clock, date_and_clock, size

EVENTS_SHOWN = 200
STEPS = 240
"""Values of a curve at most."""
BESIDE = 120
"""Width from which on two curves stand beside each other."""
LABEL = 7
REPORTABLE = (
    ("parity", LineError.PARITY),
    ("framing", LineError.FRAMING),
    ("break", LineError.BREAK),
    ("overrun", LineError.OVERRUN),
)

NO_EVENTS = "none: not unplugged, nothing lost on the way, no settings changed"
"""What the list of events says that has none; line errors are counted above and are no events."""
EITHER = LineError.PARITY | LineError.FRAMING


Part = tuple[str, Text]
"""A label and what it says; several lines stand below each other."""


def settings(store: Store, status: FeedStatus) -> list[Part]:
    """Line settings, adapter, capture."""
    session = store.session
    timing, adapter = session.timing, session.adapter
    names = ", ".join(sanitized(part) for part in (adapter.name, adapter.driver, adapter.serial_number) if part)
    line = f"{session.line} · one character {milliseconds(timing.char)}, 3.5 of them {milliseconds(timing.t35)}"
    return [
        ("line", Text(session.line_words if session.protocol in registry.RELATIVES else sanitized(line))),
        (
            "adapter",
            Text(f"{names} · {sanitized(adapter.delay_words)}" if session.has_times else names),
        ),
        ("reports", Text(reports(store))),
        ("started", Text(_started(session))),
        ("capture", Text(capture(status))),
        *([("memory", Text(kept(store, status)))] if store.dropped_rows else []),
    ]


def _started(session: Session) -> str:
    if not session.has_times:
        return UNTIMED
    return date_and_clock(session.started) if session.started else "unknown"


def reports(store: Store) -> str:
    """Which line errors the adapter can report, in words."""
    adapter = store.session.adapter
    if adapter.reports is None:
        said = "nobody knows which line errors this adapter reports: 0 means unknown"
    elif not adapter.reports:
        said = "no line errors at all: 0 means unknown"
    else:
        said = ", ".join(sanitized(name) for name in adapter.reports)
    return said + (f" ({sanitized(adapter.detail)})" if adapter.detail else "")


def capture(status: FeedStatus) -> str:
    """What happens to what comes in."""
    parts = [
        f"recorded to {sanitized(status.recording)}, {size(status.file_size)}" if status.recording else "not recorded"
    ]
    if not status.live:
        parts = [f"from {sanitized(status.port)}, {size(status.file_size)}"]
    if status.follows:
        parts = [f"from {sanitized(status.follows)}, {size(status.file_size)}, which another process goes on to write"]
    if status.priority:
        parts.append(f"priority {sanitized(status.priority)}")
    parts.append(f"{status.dropped} lost" if status.dropped else "nothing lost")
    if status.ended:
        parts.append(f"ended: {sanitized(status.ended)}")
    return " · ".join(parts)


def kept(store: Store, status: FeedStatus) -> str:
    """Which rows can be looked at, once the oldest had to go."""
    file = "the file has them" if status.in_file else "nothing was recorded"
    return f"rows {store.first_no} to {store.last_no}; {store.dropped_rows} older ones had to go, {file}"


def also(store: Store, status: FeedStatus) -> str:
    """A second protocol on the bus."""
    frames = counted(status.foreign, "frame")
    second, first = registry.get(status.second).title, store.dissector.title
    return f"{frames} of {second} among what is none of {first}; in Frames {status.second!r} stands before them"


def errors(store: Store, status: FeedStatus) -> list[Part]:
    """Counts, each said to be unknown where the adapter cannot report it."""
    total = store.load.total
    share = f" ({percent(total.damaged / total.frames, 2)})" if total.frames else ""
    noise = f" ({percent(total.noise / total.octets, 2)})" if total.octets else ""
    words = [_count(store, name, flag) for name, flag in REPORTABLE]
    both = sum(number for error, number in store.marks.items() if EITHER in error)
    if both:
        words.insert(0, f"parity or framing {both}")
    return [
        ("frames", Text(f"{total.frames} · damaged {total.damaged}{share}")),
        ("octets", Text(f"{total.octets} · noise {total.noise}{noise}")),
        *([("also", Text(also(store, status)))] if status.second else []),
        ("errors", Text(" · ".join(words))),
    ]


def _count(store: Store, name: str, flag: LineError) -> str:
    count = sum(
        number for error, number in store.marks.items() if flag in error and not (flag in EITHER and EITHER in error)
    )
    able = store.session.adapter.reports
    if not count and (able is None or name not in able):
        return f"{name} unknown"
    return f"{name} {count}"


Curve = list[tuple[int, float]]
"""Times, ns, and values."""


def load(store: Store, status: FeedStatus) -> list[Part]:
    """How busy the bus is."""
    known = store.load
    if not store.session.has_times:
        return []
    return [("load", Text(f"{known.share(now=status.now):.0%} now, {known.overall():.0%} overall"))]


def curves(store: Store, most: int) -> tuple[Curve, Curve]:
    """The load, %, and errors a second, of all seconds that are known, in `most` steps at most; the last step is left
    out where it is not over."""
    seconds = store.load.seconds
    if not seconds or not store.session.has_times:
        return [], []
    first, last = min(seconds), max(seconds)
    step = -(-(last - first + 1) // most)
    busy, failed = Counter[int](), Counter[int]()  # of those that are there: a clock that jumps leaves out years
    for at, second in seconds.items():
        busy[(at - first) // step] += second.busy
    for at, count in store.failed.items():
        failed[(at - first) // step] += count
    shares, errors = [], []
    for place, begin in enumerate(range(first, max(first + 1, last + 1 - step), step)):
        shares.append((begin * NS_PER_S, min(100.0, 100 * busy[place] / (step * NS_PER_S))))
        errors.append((begin * NS_PER_S, failed[place] / step))
    return shares, errors


def gaps(store: Store, width: int) -> list[Part]:
    """How long the line was silent between frames, from first to last range that occurred."""
    if not store.session.has_times:
        return []
    held = store.session.adapter.latency
    doubt = f", right to ±{milliseconds(held)}" if held else ""
    text = Text(f"between frames, {store.gaps.count} times{doubt}")
    for line in spread(store.gaps, max(8, width - 31)):
        text.append(f"\n{line}")
    return [("silence", text)]


def events(happened: list[LineEvent], has_times: bool = True) -> list[Part]:
    """What happened to the line, the newest first; when, where that is known."""
    lines = []
    for event in reversed(happened[-EVENTS_SHOWN:]):
        count = f" {event.number}" if event.number > 0 else " (how many is unknown)" if event.number < 0 else ""
        words = f": {sanitized(event.text)}" if event.text else ""
        when = f"{clock(event.moment)}  " if has_times else ""
        lines.append(f"{when}{event.kind.value}{count}{words}")
    if len(happened) > EVENTS_SHOWN:
        lines.append(f"and {len(happened) - EVENTS_SHOWN} earlier ones")
    return [("events", Text("\n".join(lines or [NO_EVENTS])))]


def _table(parts: list[Part]) -> Table:
    table = Table.grid(padding=(0, 2, 0, 0))
    table.add_column(width=LABEL, no_wrap=True)
    table.add_column(ratio=1)
    for label, text in parts:
        table.add_row(Text(label, style="bold"), text)
    return table


class Page(VerticalScroll, can_focus=True, inherit_bindings=False):
    """Scrolls with the keys of the lists."""

    BINDINGS: ClassVar[list[BindingType]] = named(
        [
            Binding("up,k", "scroll_up", "line up", show=False),
            Binding("down,j", "scroll_down", "line down", show=False),
            Binding("pageup", "page_up", "page up", show=False),
            Binding("pagedown", "page_down", "page down", show=False),
            Binding("home,g", "scroll_home", "first line", show=False),
            Binding("end,G", "scroll_end", "last line", show=False),
        ]
    )


class LineScreen(ViewScreen):
    """One scrolling page."""

    TITLE = "Line"
    CSS_PATH = "line.tcss"

    def __init__(self) -> None:
        super().__init__()
        self._drawn: tuple[int, int, tuple[str, ...]] | None = None

    def compose_view(self) -> ComposeResult:
        """The sections."""
        with Page(id="main"):
            for name in ("settings", "errors", "load", "gaps"):
                yield Static(id=name)
            with Container(id="curves"):
                yield HistoryPlot(id="load-curve")
                yield HistoryPlot(id="error-curve")
            yield Static(id="events")

    def draw(self) -> None:
        """Bring the page up to date, unless frozen."""
        page = self.query_one(Page)
        width = page.scrollable_content_region.width - LABEL - 4
        busy = load(self.store, analyzer(self).status)  # which goes down where nothing more is heard
        state = (self.store.heard, width, tuple(words.plain for _, words in busy))
        if self._drawn == state or (self.viewing.frozen and self._drawn and self._drawn[1] == width) or width < 1:
            return
        self._drawn = state
        store = self.store
        sections = {
            "settings": settings(store, analyzer(self).status),
            "errors": errors(store, analyzer(self).status),
            "load": busy,
            "gaps": gaps(store, width),
            "events": events(store.line_events, store.session.has_times),
        }
        for name, parts in sections.items():
            self.query_one(f"#{name}", Static).update(_table(parts))
        shares, failed = curves(store, STEPS)
        self._plot("load-curve", "load, %", shares, len(shares) >= LEAST)
        went_wrong = any(value for _, value in failed) and len(failed) >= LEAST
        self._plot("error-curve", "errors a second (damaged, noise, went wrong)", failed, went_wrong)

    def _plot(self, name: str, title: str, curve: Curve, shown: bool) -> None:
        """A curve, where it says something."""
        plot = self.query_one(f"#{name}", HistoryPlot)
        plot.display = shown
        if shown:
            plot.show(title, curve, least=0)

    def on_resize(self, event: Resize) -> None:
        """Charts take the new width, and stand beside each other where there is room."""
        self.set_class(event.size.width >= BESIDE, "-beside")
        self._drawn = None
