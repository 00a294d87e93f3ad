"""`stats FILE ring`: the token ring."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from dissectors.token_ring import TokenRing
from sniff.bus.offline import outputs
from sniff.cli import tables
from sniff.engine.engine import Output
from sniff.engine.session import Item, Session


def ring_of(items: Iterable[Item], session: Session, shown: TokenRing) -> Any:
    """The ring that items show."""
    observer = shown.observer(session.timing)
    for output in outputs(items, session, pairing=False):
        if isinstance(output, Output):
            for row in output.rows:
                if row.searched is None:
                    observer.see(row.no, row.event, row.header)
        elif output.kind.is_hole:
            observer.miss(output.time)
    return observer.ring()


def show(items: Iterable[Item], session: Session, shown: TokenRing, style: str) -> int:
    """Print the ring; the sentences only as text."""
    ring = ring_of(items, session, shown)
    tables.write(shown.headings, shown.rows(ring), style)
    if style == "text":
        print()
        for sentence in shown.sentences(ring):
            print(sentence)
    return 0
