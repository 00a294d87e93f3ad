"""The programme out of tables: requests are told apart by the octets that say what they ask, and become an object once
for each that is new. Pure.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from dissectors.columns import NONE, ROLES, VERDICTS, Masks, Times, counted, some
from dissectors.frame import Frame, Role
from dissectors.histogram import add_grouped
from dissectors.questions import Question, Stems
from dissectors.tracker import PASSING, Verdict
from sniff.analysis.holes import Holes
from sniff.analysis.poll import TIMED, UNASKED, Poll, PollKey
from sniff.analysis.polls import Asked, asks, closed_of, counts
from sniff.engine.table import Table, rows_at

if TYPE_CHECKING:
    from sniff.analysis.polls import Polls

Marks = npt.NDArray[np.uint64]

LONGEST = 2048
"""Octets of a stem that are compared; a frame of our protocols is shorter."""

_RESPONSE = ROLES.index(Role.RESPONSE)
_LATE, _MISSED = VERDICTS.index(Verdict.LATE), VERDICTS.index(Verdict.NO_RESPONSE)
_BROADCAST = VERDICTS.index(Verdict.BROADCAST)
_UNASKED = np.array([verdict in UNASKED for verdict in VERDICTS])
_TIMED = np.array([verdict in TIMED for verdict in VERDICTS])


def add_table(polls: Polls, table: Table) -> None:
    """Give a programme the table that follows."""
    closed, heard = table.transactions, table.heard
    if heard.any():
        polls.holes.take(table.frames.start[heard], table.frames.end[heard])
    passing = np.array([name in PASSING for name in closed.names])
    counted_ones = ~passing[closed.kind] & ~_UNASKED[closed.verdict] & (closed.request != NONE)
    place = closed.request - table.first
    inside = counted_ones & (place >= 0) & (place < len(table))
    there = inside.copy()
    there[inside] = _may_ask(table)[place[inside]]
    plain = there.copy()
    if table.odd:
        plain &= ~np.isin(place, list(table.odd))
    single = (counted_ones & ~plain) | (closed.verdict == _LATE)
    _remember(polls, table, place[there & ~plain])
    for begin, end in _between(np.flatnonzero(single), len(closed)):
        chosen = begin + np.flatnonzero(plain[begin:end])
        _add(polls, table, chosen, place[chosen])
        if end < len(closed):
            one = closed.transaction(end)
            if counts(one.kind, one.verdict, one.request):
                polls.take(closed_of(one))
    for no in closed.request[~counted_ones & (closed.request != NONE)].tolist():
        if polls.open:
            polls.open.pop(no, None)
    tx = table.placed.tx
    still = _may_ask(table) & ~np.isin(tx, closed.id)
    _remember(polls, table, np.flatnonzero(still)[-_MOST_STILL:])


_MOST_STILL = 4096


def _between(singles: Times, length: int) -> list[tuple[int, int]]:
    """Stretches of transactions [begin, end), each ended by one that is taken by itself, or by the end."""
    begins, ends = [0, *(singles + 1).tolist()], [*singles.tolist(), length]
    return list(zip(begins, ends, strict=True))


def _may_ask(table: Table) -> Masks:
    """Rows that may be requests, as `polls.asks`."""
    passing = np.array([name in PASSING for name in table.frames.names])
    placed = table.placed
    asking: Masks = table.good & (placed.tx > 0) & (placed.role != _RESPONSE) & ~passing[table.frames.kind]
    return asking


def _remember(polls: Polls, table: Table, places: Times) -> None:
    for row in rows_at(table, places.tolist()):
        if asks(row):
            assert isinstance(row.event, Frame)
            assert row.placement is not None
            polls.remember(row.no, row.event, row.placement.source)


def _add(polls: Polls, table: Table, chosen: Times, rows: Times) -> None:
    """Count transactions whose requests are rows of the table."""
    if not len(chosen):
        return
    closed = table.transactions.take(chosen)
    polls.version += len(chosen)
    stations = np.where(closed.verdict == _BROADCAST, NONE, closed.station).astype(np.int64)
    which, held = _polls(polls, table, stations, closed.kind.astype(np.int64), closed.names, rows)
    kept = which >= 0
    if not kept.all():
        polls.dropped += int((~kept).sum())
        closed, which, rows = closed.take(kept), which[kept], rows[kept]
    order = np.argsort(which, kind="stable")
    closed, which = closed.take(order), which[order]
    begins, ends = _stretches(which)
    firsts = closed.attempt <= 1
    numbers = np.cumsum(np.append(0, firsts))
    for number, begin, end in zip(which[begins].tolist(), begins.tolist(), ends.tolist(), strict=True):
        poll, asked = held[number], int(numbers[end] - numbers[begin])
        poll.asked += asked
        poll.repeats += end - begin - asked
        poll.request = int(closed.request[end - 1])
    for (number, verdict), count in counted(which, closed.verdict) if len(which) else ():
        held[number].verdicts[VERDICTS[verdict]] += count
    _between_all(held, which, closed.start, polls.holes)
    _between_firsts(held, which[firsts], closed.start[firsts], polls.holes)
    timed = (closed.latency != NONE) & _TIMED[closed.verdict]
    add_grouped(lambda number: held[number].latency, which[timed], closed.latency[timed])
    missed = np.flatnonzero(closed.verdict == _MISSED)
    for at in missed[np.argsort(order[missed])].tolist():
        polls.miss(int(closed.id[at]), held[which[at]].key)


def _stretches(which: Times) -> tuple[Times, Times]:
    """Where each entry begins and ends in columns that are by entry."""
    if not len(which):
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    begins = np.flatnonzero(np.append(True, which[1:] != which[:-1]))
    return begins, np.append(begins[1:], len(which))


def _between_all(held: list[Poll], which: Times, starts: Times, holes: Holes) -> None:
    """From each request to the next of its entry."""
    begins, ends = _stretches(which)
    befores: list[int | None] = []
    for number, begin, end in zip(which[begins].tolist(), begins.tolist(), ends.tolist(), strict=True):
        poll = held[number]
        befores.append(poll.last)
        poll.first = int(starts[begin]) if poll.first is None else poll.first
        poll.last = int(starts[end - 1])
    add_grouped(lambda number: held[number].between, *_steps(which, starts, begins, befores, holes))


def _between_firsts(held: list[Poll], which: Times, starts: Times, holes: Holes) -> None:
    """The same without repeats."""
    begins, ends = _stretches(which)
    befores: list[int | None] = []
    for number, begin, end in zip(which[begins].tolist(), begins.tolist(), ends.tolist(), strict=True):
        poll = held[number]
        befores.append(poll.newest)
        poll.begun = int(starts[begin]) if poll.begun is None else poll.begun
        poll.newest = int(starts[end - 1])
        _slice(poll, starts[begin:end])
    add_grouped(lambda number: held[number].every, *_steps(which, starts, begins, befores, holes))


def _steps(which: Times, starts: Times, begins: Times, befores: list[int | None], holes: Holes) -> tuple[Times, Times]:
    """Entry and time since the request before it, of all that have one and no hole between. `befores`: that of the
    first of each entry."""
    steps, known = np.diff(starts, prepend=starts[:1]), np.ones(len(which), bool)
    known[begins] = [before is not None for before in befores]
    steps[begins] = starts[begins] - np.array([before or 0 for before in befores], np.int64)
    known &= ~holes.are_between(starts - steps, starts)
    return which[known], steps[known]


def _slice(poll: Poll, times: Times) -> None:
    slices = poll.slices
    slices.reach(int(times.min()), int(times.max()))
    places, numbers = np.unique(times // slices.width, return_counts=True)
    for place, count in zip(places.tolist(), numbers.tolist(), strict=True):
        slices.counts[place] = slices.counts.get(place, 0) + count


# --- telling requests apart ---


def _polls(
    polls: Polls, table: Table, stations: Times, kinds: Times, names: tuple[str, ...], rows: Times
) -> tuple[Times, list[Poll]]:
    """Of each request its entry, as a place in a list of them; -1 where there are too many entries."""
    frames = table.frames.take(rows)
    questions = polls.dissector.questions
    whole = Stems(frames.offset, frames.offset + frames.length, np.full(len(rows), -1, np.int64))
    make = questions.stems if questions is not None else None
    stems = make(frames, table.octets) if make is not None else whole
    sources = table.placed.source[rows].astype(np.int64)
    marks = _marks(stems, table.octets)
    for column in (stations + 1, kinds, sources + 1, stems.end - stems.begin):
        marks = marks * np.uint64(0x9E3779B97F4A7C15) + column.astype(np.uint64)
    distinct, first, which = np.unique(marks, return_index=True, return_inverse=True)
    in_order = np.argsort(first)  # new entries in the order of the wire
    held: list[Poll] = []
    place_of: dict[PollKey, int] = {}
    places = np.full(len(distinct), -1, np.int64)
    seen = rows_at(table, rows[first[in_order]].tolist())
    for number, row in zip(in_order.tolist(), seen, strict=True):
        assert isinstance(row.event, Frame)
        at = first[number]
        question = polls.question(row.event) if questions is not None else Question()
        asked = Asked(some(sources[at]), question)
        key = PollKey(asked.source, some(stations[at]), names[kinds[at]], asked.question)
        place = place_of.get(key)
        if place is None:
            poll = polls.of(key)
            if poll is None:
                continue
            place = place_of[key] = len(held)
            held.append(poll)
        places[number] = place
    return places[which], held


def _marks(stems: Stems, octets: npt.NDArray[np.uint8]) -> Marks:
    """A number for each stem; the same for the same octets, and hardly ever for others."""
    lengths = np.minimum(stems.end - stems.begin, LONGEST)
    marks = np.zeros(len(lengths), np.uint64)
    for length in np.unique(lengths).tolist():
        rows = np.flatnonzero(lengths == length)
        steps = np.arange(length)
        for part in np.array_split(rows, max(1, len(rows) * max(length, 1) >> 22)):
            at = stems.begin[part, None] + steps
            values = octets.take(at, mode="clip").astype(np.uint64)
            values[at == stems.hole[part, None]] = 0
            marks[part] = (values * _weights(LONGEST)[:length]).sum(axis=1, dtype=np.uint64)
    return marks


@cache
def _weights(length: int) -> Marks:
    weights: Marks = np.random.default_rng(485).integers(1, 1 << 64, length, np.uint64, endpoint=False) | np.uint64(1)
    return weights
