"""`stats FILE ring`: the MS/TP token ring."""

from __future__ import annotations

from dissectors.bacnet import RingObserver
from dissectors.bacnet.ring import Ring
from sniff.analysis import ring_words
from sniff.cli import tables
from sniff.engine import Output
from sniff.formats import Capture
from sniff.reading import outputs
from sniff.session import Session


def ring_of(capture: Capture, session: Session) -> Ring:
    """The ring of a whole capture."""
    observer = RingObserver(session.timing)
    for output in outputs(capture.items(), session):
        if isinstance(output, Output):
            for row in output.rows:
                observer.see(row.no, row.event, row.header)
    return observer.ring()


def show(capture: Capture, session: Session, style: str) -> int:
    """Print the ring; the sentences only as text."""
    ring = ring_of(capture, session)
    tables.write(ring_words.HEADINGS, ring_words.rows(ring), style)
    if style == "text":
        print()
        for sentence in ring_words.sentences(ring):
            print(sentence)
    return 0
