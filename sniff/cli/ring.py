"""`stats FILE ring`: the MS/TP token ring."""

from __future__ import annotations

from collections.abc import Iterable

from dissectors.bacnet import RingObserver
from dissectors.bacnet.ring import Ring
from sniff.analysis import ring_words
from sniff.cli import tables
from sniff.engine import Output
from sniff.reading import outputs
from sniff.session import Item, Session


def ring_of(items: Iterable[Item], session: Session) -> Ring:
    """The ring that items show."""
    observer = RingObserver(session.timing)
    for output in outputs(items, session, pairing=False):
        if isinstance(output, Output):
            for row in output.rows:
                if row.searched is None:
                    observer.see(row.no, row.event, row.header)
        elif output.kind.is_hole:
            observer.miss(output.time)
    return observer.ring()


def show(items: Iterable[Item], session: Session, style: str) -> int:
    """Print the ring; the sentences only as text."""
    ring = ring_of(items, session)
    tables.write(ring_words.HEADINGS, ring_words.rows(ring), style)
    if style == "text":
        print()
        for sentence in ring_words.sentences(ring):
            print(sentence)
    return 0
