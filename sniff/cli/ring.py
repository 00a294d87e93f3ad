"""`stats FILE ring`: the token ring."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from dissectors.token_ring import RingObserver, TokenRing, WatchesColumns
from sniff.bus.offline import Source, survey
from sniff.cli import tables
from sniff.engine.engine import Output
from sniff.engine.session import LineEvent, Session

if TYPE_CHECKING:
    from sniff.engine.table import Table


def ring_of(source: Source, session: Session, shown: TokenRing, reference: bool = False) -> Any:
    """The ring that a capture shows. `reference`: row by row, for comparison."""
    watched = _Watched(shown.observer(session.timing))
    survey(source, session, watched, reference=reference)
    return watched.observer.ring()


class _Watched:
    """The ring's observer, handed rows without their transactions."""

    def __init__(self, observer: RingObserver) -> None:
        self.observer = observer

    def add(self, output: Output) -> None:
        """Take rows but those of a search for settings."""
        for row in output.rows:
            if row.searched is None:
                self.observer.see(row.no, row.event, row.header)

    def add_table(self, table: Table) -> None:
        """The same of many rows."""
        if isinstance(self.observer, WatchesColumns) and table.heard.all():
            self.observer.take(table)
        else:
            for output in table.outputs():
                self.add(output)

    def add_line_event(self, event: LineEvent) -> None:
        """Where octets were lost, what is missing says nothing."""
        if event.kind.is_hole:
            self.observer.miss(event.time)


def show(source: Source, session: Session, shown: TokenRing, style: str, reference: bool) -> int:
    """Print the ring; the sentences only as text. `reference`: see `survey`. Raises CaptureError as the source does."""
    ring = ring_of(source, session, shown, reference)
    tables.write(shown.headings, shown.rows(ring), style)
    if style == "text":
        print()
        for sentence in shown.sentences(ring):
            print(sentence)
    return 0
