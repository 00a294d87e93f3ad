"""What a kernel says held against the reference framer and peek, frame by frame."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dissectors.columns import FrameColumns, Octets, Reads
from dissectors.frame import Chunk, Event, Frame, Header
from dissectors.line import Timing
from dissectors.manifest import Dissector


def reads_of(chunks: Sequence[Chunk]) -> Reads:
    """Chunks as columns; empty ones say nothing."""
    chunks = [chunk for chunk in chunks if chunk.octets]
    return Reads(
        np.frombuffer(b"".join(chunk.octets for chunk in chunks), np.uint8),
        np.array([chunk.time for chunk in chunks], np.int64),
        np.array([len(chunk.octets) for chunk in chunks], np.int64),
        np.array([bool(chunk.marks) for chunk in chunks], bool),
    )


def cut_anyhow(octets: bytes, timing: Timing, cuts: Sequence[int], pauses: Sequence[int]) -> list[Chunk]:
    """Octets in reads of the lengths `cuts`, each `pauses` ns after the one before ended, over and over."""
    now, at = 10**9, 0
    chunks: list[Chunk] = []
    while at < len(octets):
        part = octets[at : at + cuts[len(chunks) % len(cuts)]]
        now += len(part) * timing.char + pauses[len(chunks) % len(pauses)]
        chunks.append(Chunk(now, part))
        at += len(part)
    return chunks


def events_of(dissector: Dissector, chunks: Sequence[Chunk], timing: Timing) -> list[tuple[int, Event]]:
    """(place of the first octet, event) as the reference gives them."""
    framer = dissector.framer(timing)
    events = [event for chunk in chunks if chunk.octets for event in framer.feed(chunk)] + framer.close()
    placed, at = [], 0
    for event in events:
        placed.append((at, event))
        at += len(event.octets)
    return placed


def frame_at(
    columns: FrameColumns, row: int, octets: bytes | Octets, protocol: str, latency: int
) -> tuple[Frame, Header]:
    """A row of columns as the values it stands for."""

    held = np.frombuffer(octets, np.uint8)
    return columns.frame(row, held, protocol, latency), columns.header(row, protocol)


def assert_equal(dissector: Dissector, chunks: Sequence[Chunk], timing: Timing) -> tuple[int, int]:
    """Every frame of every chain that the reference takes up is the reference's own; (frames by columns, in all).

    A chain is taken up at its first frame that the reference gives too, if the event before it was a good frame.
    """
    assert dissector.kernel is not None
    octets = b"".join(chunk.octets for chunk in chunks)
    events = events_of(dissector, chunks, timing)
    at = {offset: row for row, (offset, _) in enumerate(events)}
    columns = dissector.kernel(reads_of(chunks), timing) if octets else None
    total = sum(isinstance(event, Frame) for _, event in events)
    if columns is None:
        return 0, total
    ends = columns.offset + columns.length
    assert (ends[:-1] <= columns.offset[1:]).all(), "chains overlap"
    chained, taken_up, by_columns = columns.chained, False, 0
    for row in range(len(columns)):
        offset = int(columns.offset[row])
        if not chained[row]:
            taken_up = False
        if not taken_up:
            place = at.get(offset)
            before = events[place - 1][1] if place else None
            taken_up = isinstance(before, Frame) and before.ok
        if not taken_up:
            continue
        frame, header = frame_at(columns, row, octets, dissector.name, timing.latency)
        assert offset in at, f"no event of the reference begins at octet {offset}, but {frame}"
        reference = events[at[offset]][1]
        assert isinstance(reference, Frame), f"{frame} is {reference}"
        assert frame == reference
        assert header == dissector.peek(reference)
        by_columns += 1
    return by_columns, total
