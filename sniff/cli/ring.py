"""`stats FILE ring`: the token ring."""

from __future__ import annotations

import argparse
from typing import Any

from dissectors.token_ring import StationTable, TokenRing
from sniff.bus.offline import survey
from sniff.bus.watched_ring import WatchedRing
from sniff.cli import tables
from sniff.engine.read_source import ReadSource
from sniff.engine.session import Session


def ring_of(source: ReadSource, session: Session, shown: TokenRing, reference: bool = False) -> Any:
    """The ring that a capture shows. `reference`: row by row, for comparison."""
    watched = WatchedRing(shown.observer(session.timing))
    survey(source, session, watched, reference=reference)
    return watched.observer.ring()


def show_stations(
    source: ReadSource, session: Session, shown: TokenRing, table: StationTable, args: argparse.Namespace
) -> None:
    """Print the stations that do not pass the token. Raises CaptureError as the source does."""
    ring = ring_of(source, session, shown, args.reference)
    tables.write(table.headings, table.rows(ring), args.style)


def show(source: ReadSource, session: Session, shown: TokenRing, style: str, reference: bool) -> None:
    """Print the ring; the sentences only as text. `reference`: see `survey`. Raises CaptureError as the source does."""
    write(ring_of(source, session, shown, reference), shown, style)


def write(ring: Any, shown: TokenRing, style: str) -> None:
    """Print a ring."""
    tables.write(shown.headings, shown.rows(ring), style)
    if style == "text":
        print()
        for sentence in shown.sentences(ring):
            print(sentence)
