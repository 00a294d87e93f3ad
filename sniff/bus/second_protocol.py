"""Two protocols on one bus: what the first calls noise, or a damaged frame, and the second makes good frames of. Pure.

A stretch of such octets, between two good frames of the first protocol, is read by the second on its own; so no frame
of it spans one of the first, and each octet stays in one row. Frames of the second take the numbers of the rows in
which they begin. They belong to no exchange: who asked whom cannot be told where others spoke between.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import accumulate

from dissectors import registry
from dissectors.frame import Chunk, Frame, Noise, Place, Reason
from dissectors.line import NS_PER_S, Timing
from dissectors.manifest import Dissector
from sniff.engine.engine import Engine, Row
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Session
from sniff.engine.verdict_join import JudgedRow, Wanted

MOST = 1 << 16
"""Octets of a stretch that are held."""

Judged = tuple[JudgedRow, Dissector]


def of_both(
    items: Iterator[JudgedRow], session: Session, second: str, wanted: Wanted, of_second: Wanted | None
) -> Iterator[Judged]:
    """All rows with the dissector of each, as far as they are wanted; `of_second` None: none of the second protocol."""
    first, other = dissector_for(session), registry.get(second)
    for item, dissector in _rows(items, session, first, other):
        accepts = wanted if dissector is first else of_second
        if accepts is not None and accepts(item.row, item.transaction):
            yield item, dissector


def _rows(items: Iterator[JudgedRow], session: Session, first: Dissector, second: Dissector) -> Iterator[Judged]:
    held: list[JudgedRow] = []
    octets = 0
    for item in items:
        if _is_left(item):
            held.append(item)
            octets += len(item.row.event.octets)
            if octets < MOST:
                continue
            item_after = None
        else:
            item_after = item
        yield from _told(held, session, first, second)
        held, octets = [], 0
        if item_after is not None:
            yield item_after, first
    yield from _told(held, session, first, second)


def _is_left(item: JudgedRow) -> bool:
    """Whether the first protocol makes nothing good of a row."""
    event = item.row.event
    return item.row.searched is None and (isinstance(event, Noise) or not event.ok)


def _told(held: list[JudgedRow], session: Session, first: Dissector, second: Dissector) -> Iterator[Judged]:
    """The rows of a stretch, good frames of the second protocol in place of what they cover."""
    frames = _frames(held, session, second) if held else []
    at = 0
    for begin, row in frames:
        yield from ((item, first) for item in _between(held, at, begin))
        number = next(item.row.no for item, end in zip(held, _ends(held), strict=True) if begin < end)
        yield JudgedRow(replace(row, no=number), None), second
        at = begin + len(row.event.octets)
    yield from ((item, first) for item in _between(held, at, 1 << 62))


def _frames(held: list[JudgedRow], session: Session, second: Dissector) -> list[tuple[int, Row]]:
    """Good frames of the second protocol, and where in the stretch each begins."""
    engine = Engine(second, Timing(session.line, session.adapter.latency), pairing=False)
    outputs = [engine.feed(Chunk(item.row.event.end, item.row.event.octets)) for item in held]
    outputs.append(engine.advance(held[-1].row.event.end + 10 * NS_PER_S))
    outputs.append(engine.close())
    rows = [row for output in outputs for row in output.rows]
    begins = accumulate((len(row.event.octets) for row in rows), initial=0)
    return [
        (begin, row) for begin, row in zip(begins, rows, strict=False) if isinstance(row.event, Frame) and row.event.ok
    ]


def _ends(held: list[JudgedRow]) -> Iterator[int]:
    """Where in the stretch each row ends."""
    return accumulate(len(item.row.event.octets) for item in held)


def _between(held: list[JudgedRow], begin: int, end: int) -> Iterator[JudgedRow]:
    """The rows of a part of the stretch; of one that is only partly in it what is left, as noise."""
    for item, upto in zip(held, _ends(held), strict=True):
        event = item.row.event
        since = upto - len(event.octets)
        low, high = max(begin, since), min(end, upto)
        if low >= high:
            continue
        if (low, high) == (since, upto):
            yield item
            continue
        octets = event.octets[low - since : high - since]
        place, reason = (event.place, event.reason) if isinstance(event, Noise) else (Place.BETWEEN, Reason.NO_FRAME)
        rest = Noise(octets, event.start, event.end, place, reason)
        yield JudgedRow(Row(item.row.no, rest), None)
