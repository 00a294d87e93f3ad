"""The two lines at the top: what the bus and the capture do, and which screen this is."""

from __future__ import annotations

from enum import Enum
from typing import ClassVar

from rich.cells import cell_len
from rich.style import Style
from rich.text import Text
from textual.widget import Widget

from sniff.analysis.health import Health
from sniff.analysis.sanitizing import sanitized
from sniff.bus.feed import FeedStatus
from sniff.bus.rows import Store
from sniff.engine.event_texts import gone_why
from sniff.engine.session import LineEventKind
from sniff.tui.analyzer import analyzer
from sniff.tui.columns import fit
from sniff.tui.times import size
from sniff.tui.view_state import Viewing

ROOMY = 100
"""Width from which two spaces stand between the pieces; by the width alone, so that nothing jumps."""
POOR, FAIR = 50, 80
"""Below these a health stands out."""
SHORT_TITLES = {"Transactions": "Trans."}
"""Titles that a narrow screen has no room for."""
REASON = 20
"""Cells for why the capture has ended."""
SHORTEST = 6
"""Characters of a tab, its number among them, below which the numbers stand alone."""

DOWN = "DOWN"
"""What is said of a bus whose port is gone for now."""

PORT_EVENTS = (LineEventKind.UNPLUGGED, LineEventKind.REPLUGGED)


class RecordState(Enum):
    """What happens to what comes in; the value is what people read."""

    ENDED = "ENDED"
    FILE = "FILE"
    FAILS = "REC FAILS"
    BEHIND = "REC BEHIND"
    RECORDED = "REC"
    NOT_RECORDED = "NOT REC"


STATE_STYLES = {
    RecordState.RECORDED: "bad",
    RecordState.FAILS: "bad",
    RecordState.BEHIND: "bad",
    RecordState.NOT_RECORDED: "doubt",
    RecordState.ENDED: "doubt",
}


def record_state(status: FeedStatus) -> RecordState:
    """Whether what comes in is recorded, and how well."""
    if status.ended:
        return RecordState.ENDED
    if not status.live or status.follows:
        return RecordState.FILE
    if status.trouble:
        return RecordState.FAILS
    if status.recording and status.behind:
        return RecordState.BEHIND
    return RecordState.RECORDED if status.recording else RecordState.NOT_RECORDED


def state_words(status: FeedStatus) -> str:
    """The same in a word or two, with how far the recording is behind."""
    state = record_state(status)
    return f"REC {status.behind:.0f} s BEHIND" if state is RecordState.BEHIND else state.value


def progress_of(status: FeedStatus) -> str:
    """How far a file has been read, then how far its rows have been judged; empty when all is done."""
    if status.reading:
        return "reading" if status.read is None else f"{int(status.read * 100)} % read"
    return f"{int(status.judged * 100)} % judged" if status.judged < 1 else ""


def why_ended(status: FeedStatus, store: Store) -> tuple[str, str]:
    """Why nothing more comes, in two or three words and in full; empty while it does.

    Where the port went before, that is the cause, and what the capture says only follows from it.
    """
    if not status.ended:
        return "", ""
    of_port = [event for event in store.line_events if event.kind in PORT_EVENTS]
    if not of_port or of_port[-1].kind is not LineEventKind.UNPLUGGED:
        return status.ended, status.ended
    said = of_port[-1].text or "unplugged"
    return gone_why(of_port[-1]) or said, f"{said}; {status.ended}"


def protocols(status: FeedStatus) -> str:
    """The protocol of the bus, and a second one that is heard between."""
    return sanitized(f"{status.protocol}+{status.second}" if status.second else status.protocol)


def status_line(
    status: FeedStatus, store: Store, viewing: Viewing, width: int, health: Health | None = None, is_down: bool = False
) -> list[tuple[str, str]]:
    """Pieces of text with a style name each, together at most `width` cells: the port gives way first. `is_down`: the
    port is gone for now, and so there is no load."""
    state, words = record_state(status), state_words(status)
    reason = sanitized(why_ended(status, store)[0])
    shown_state = f"{words}: {fit(reason, min(cell_len(reason), REASON))}" if reason else words
    pieces = [
        *([(f"searching {sanitized(status.searching)} …", "doubt")] if status.searching else []),
        *([] if status.searching else [(sanitized(status.line), ""), (protocols(status), "")]),
        *([(DOWN, "bad")] if is_down else []),
        *([(f"load {store.load.share(now=status.now):.0%}", "")] if store.session.has_times and not is_down else []),
        *([] if health is None else [(f"health {health.score}", _health_style(health.score))]),
        (f"err {store.error_total}", "bad" if store.error_total else ""),
        (shown_state, STATE_STYLES.get(state, "")),
        *([(progress, "")] if (progress := progress_of(status)) else []),
        *(
            [(size(status.file_size), "")]
            if status.recording or status.follows or not (status.live or progress)
            else []
        ),
    ]
    if status.dropped:
        pieces.append((f"LOST {status.dropped}", "bad"))
    if viewing.frozen:
        pieces.append((f"FROZEN +{viewing.came_since}", "frozen"))
    elif viewing.follow:
        pieces.append(("FOLLOW", ""))
    elif status.live and not status.ended:
        pieces.append(("FOLLOW OFF", "dim"))
    gap = "  " if width >= ROOMY else " "
    room = width - sum(cell_len(text) + len(gap) for text, _ in pieces)
    port = sanitized(status.port)
    if cell_len(port) > room:  # the end of a path says more than its beginning
        port = port.rsplit("/", 1)[-1] if cell_len(port.rsplit("/", 1)[-1]) <= room else fit(port, max(0, room))
    line: list[tuple[str, str]] = [(port, "port")] if port else []
    for piece in pieces:
        line.extend([(gap, ""), piece] if line else [piece])
    return line


def _health_style(score: int) -> str:
    return "bad" if score < POOR else "doubt" if score < FAIR else ""


class StatusHeader(Widget):
    """Port, line, protocol, load, health, errors, record state, file size; below it the screens and what is shown."""

    COMPONENT_CLASSES: ClassVar[set[str]] = {
        "status-header--port",
        "status-header--bad",
        "status-header--doubt",
        "status-header--frozen",
        "status-header--here",
        "status-header--dim",
    }

    def __init__(self, here: str) -> None:
        super().__init__()
        self.here = here  # name of the screen it stands on
        self._pieces: list[tuple[str, str]] = []

    def bring_up(self) -> None:
        """Draw again if anything changed."""
        app = analyzer(self)
        pieces = status_line(app.status, app.store, app.viewing, self.size.width, app.health.bus, app.is_down)
        if pieces != self._pieces:
            self._pieces = pieces
            self.refresh()

    def on_resize(self) -> None:
        """Other width, other words."""
        self.bring_up()

    def render(self) -> Text:
        """Both lines."""
        width = self.size.width
        text = Text(no_wrap=True, overflow="crop", end="")
        for piece, style in self._pieces:
            text.append(piece, self._style(style) if style else "")
        text.truncate(width, overflow="ellipsis")
        tabs = self._tabs(width)
        tabs.truncate(width, overflow="ellipsis")
        return text.append("\n").append_text(tabs)

    def _tabs(self, width: int) -> Text:
        tabs = [(f"{key} {title}", title == self.here) for key, title in analyzer(self).tabs]
        short = [(f"{key} {SHORT_TITLES.get(title, title)}", title == self.here) for key, title in analyzer(self).tabs]
        if sum(len(label) + 2 for label, _ in tabs) <= width:
            labels = [f"[{label}]" if here else f" {label} " for label, here in tabs]
        elif sum(len(label) + 1 for label, _ in short) + 1 <= width:
            labels = [f"[{label}]" if here else label for label, here in short]
            labels = [*(label + " " for label in labels[:-1]), labels[-1]]
        else:  # closer together, then as much of each as fits, then the numbers alone
            for most in range(max(len(label) for label, _ in tabs), SHORTEST, -1):
                labels = [f"[{label}]" if here else label[:most] for label, here in tabs]
                if sum(map(len, labels)) + len(labels) <= width:
                    break
            if sum(map(len, labels)) + len(labels) > width:
                labels = [f"[{label}]" if here else label.split()[0] for label, here in tabs]
            labels = [label + " " for label in labels]
        text = Text(end="")
        for label, (_, here) in zip(labels, tabs, strict=True):
            text.append(label, self._style("here" if here else "dim"))
        return text

    def _style(self, name: str) -> Style:
        return self.get_component_rich_style(f"status-header--{name}", partial=True)
