"""An observer that keeps of a bus what is held against others on the same clock: its first frames, and the losses of
its port. Bounded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from dissectors.columns import NONE, ROLES, VERDICTS, Masks, Small, Times
from dissectors.fingerprints import LONGEST, fingerprints, gathered
from dissectors.frame import Role
from dissectors.tracker import Verdict
from sniff.engine.engine import Output
from sniff.engine.session import LineEvent, LineEventKind
from sniff.engine.table import Table

T = TypeVar("T")
Keys = npt.NDArray[np.uint64]

MOST_FRAMES = 200_000
MOST_EVENTS = 1000
_RECENT = 64
"""Rows within which a request is answered, and an answered one closes: what takes longer is not kept, however many
rows come at a time."""
_KEPT = 2 * _RECENT

_REQUEST, _RESPONSE = ROLES.index(Role.REQUEST), ROLES.index(Role.RESPONSE)
_ANSWERED = VERDICTS.index(Verdict.ANSWERED)


@dataclass(frozen=True, slots=True)
class HeardFrames:
    """Good frames that ask or answer, in the order of the wire. `start`, `end`: ns. `key`: equal for equal octets.
    `asks`: a request, else an answer."""

    start: Times
    end: Times
    key: Keys
    asks: Masks

    def __len__(self) -> int:
        return len(self.start)


@dataclass(frozen=True, slots=True)
class AnsweredExchanges:
    """Answered requests, in the order of closing. `asked`, `answered`: ns, ends of the request and of the answer;
    `start`, `back`: their begins. `wanted`: equal for requests of one kind, address and number, whomever they ask.
    """

    station: Small
    start: Times
    asked: Times
    back: Times
    answered: Times
    wanted: Keys

    def __len__(self) -> int:
        return len(self.start)


class SiteEar:
    """`unplugged`: when the port went, ns; not that it was never there."""

    def __init__(self) -> None:
        self.unplugged: list[int] = []
        self._frames = 0
        self._was_there = False
        self._heard: list[HeardFrames] = []
        self._exchanges: list[AnsweredExchanges] = []
        self._open: dict[int, tuple[int, int, int]] = {}  # row of a request: start, end, what it wants
        self._rows: dict[int, tuple[int, int]] = {}  # the newest, one of which may be an answer: start, end

    def add(self, output: Output) -> None:
        """Take rows one by one."""
        if output.rows or output.transactions:
            first = output.rows[0].no if output.rows else 0
            self.add_table(Table.of_outputs("", first, [output]))

    def add_line_event(self, event: LineEvent) -> None:
        """Take something that happened to the line."""
        if event.kind is LineEventKind.UNPLUGGED and self._was_there and len(self.unplugged) < MOST_EVENTS:
            self.unplugged.append(event.time)
        self._was_there |= event.kind is LineEventKind.REPLUGGED

    def add_table(self, table: Table) -> None:
        """Take rows that follow."""
        self._was_there |= len(table) > 0
        if self._frames >= MOST_FRAMES or not (len(table) or len(table.transactions)):
            return
        frames = table.frames
        role = table.shown("role")
        lengths = frames.length.astype(np.int64)
        told = table.heard & table.good & table.is_frame & (lengths > 0) & (lengths <= LONGEST)
        told &= (role == _REQUEST) | (role == _RESPONSE)
        places = np.flatnonzero(told)
        if len(places) > MOST_FRAMES - self._frames:  # as far as if its rows came one by one
            self.add_table(table.part(0, int(places[MOST_FRAMES - self._frames - 1]) + 1))
            return
        self._frames += len(places)
        if len(places):
            octets, edges = gathered(table.octets, frames.offset[places], lengths[places])
            key = fingerprints(octets, edges, lengths[places])
            self._heard.append(HeardFrames(frames.start[places], frames.end[places], key, role[places] == _REQUEST))
        self._exchange(table, places[role[places] == _REQUEST])
        self._keep_recent(table)

    def _exchange(self, table: Table, requests: Times) -> None:
        """Keep what was answered; a request, and its answer, may be in a table before."""
        frames, closed = table.frames, table.transactions
        wanted = _wanted(table, requests)
        for place, want in zip(requests.tolist(), wanted.tolist(), strict=True):
            self._open[table.first + place] = (int(frames.start[place]), int(frames.end[place]), want)
        good = (closed.verdict == _ANSWERED) & (closed.request != NONE) & (closed.response != NONE)
        good &= closed.response - closed.request <= _RECENT
        rows = []
        for place in np.flatnonzero(good).tolist():
            asked = self._open.get(int(closed.request[place]))
            back = int(closed.response[place]) - table.first
            answer = self._rows.get(int(closed.response[place]))
            if 0 <= back < len(table):
                answer = int(frames.start[back]), int(frames.end[back])
            if asked is not None and answer is not None:
                rows.append((int(closed.station[place]), *asked, *answer))
        if rows:
            station, start, end, want, back_at, done = zip(*rows, strict=True)
            self._exchanges.append(
                AnsweredExchanges(
                    np.array(station, np.int16),
                    np.array(start, np.int64),
                    np.array(end, np.int64),
                    np.array(back_at, np.int64),
                    np.array(done, np.int64),
                    np.array(want, np.uint64),
                )
            )

    def _keep_recent(self, table: Table) -> None:
        """Keep of a table, and of those before it, what exchanges may close with that have not."""
        frames, begin = table.frames, max(0, len(table) - _KEPT)
        ends = zip(frames.start[begin:].tolist(), frames.end[begin:].tolist(), strict=True)
        self._rows.update(enumerate(ends, table.first + begin))
        least = table.first + len(table) - _KEPT
        if len(self._rows) > 2 * _KEPT:
            self._rows = {row: one for row, one in self._rows.items() if row >= least}
        if len(self._open) > _KEPT:
            self._open = {row: one for row, one in self._open.items() if row >= least}

    def heard(self) -> HeardFrames:
        """The first frames."""
        return _joined(HeardFrames, self._heard)

    def exchanges(self) -> AnsweredExchanges:
        """The first answered requests."""
        return _joined(AnsweredExchanges, self._exchanges)


def _wanted(table: Table, places: Times) -> Keys:
    """What requests want: kind, address and number, as one number each."""
    frames = table.frames
    parts = (frames.function, frames.address, frames.count, frames.length)
    key = np.zeros(len(places), np.uint64)
    for part in parts:
        key = key * np.uint64(0x9E3779B97F4A7C15) + (part[places].astype(np.int64) + 2).astype(np.uint64)
    return key


def _joined(kind: type[T], parts: Sequence[T]) -> T:
    types = {"key": np.uint64, "wanted": np.uint64, "asks": bool, "station": np.int16}
    columns = {}
    for one in fields(kind):  # type: ignore[arg-type]
        nothing = np.zeros(0, types.get(one.name, np.int64))
        columns[one.name] = np.concatenate([nothing, *(getattr(part, one.name) for part in parts)])
    return kind(**columns)
