"""The watch of a bus over many rows at once: stretches of regular units by columns, all else row by row."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from dissectors.histogram import Histogram, add_grouped
from dissectors.profibus.regular_columns import Units
from dissectors.profibus.slave_watch import SlaveView
from dissectors.profibus.watch import BusWatch
from dissectors.stretches import FEW, LEAST

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dissectors.columns import Masks, Times
    from dissectors.row_columns import RowColumns


class BulkBusWatch(BusWatch):
    """The same bus, from single rows and from tables in any order of both (`dissectors.token_ring.WatchesColumns`)."""

    def take(self, rows: RowColumns) -> None:
        """Take many rows."""
        place = 0
        if len(rows) >= LEAST:
            units = Units.of(rows)
            for begin, end in _stretches(units):
                place = self._see_until(rows, place, int(units.request[begin]))
                while end - begin >= FEW and not self.is_calm(rows, units, begin):
                    place = self._see_until(rows, place, int(units.last[begin]) + 1)
                    begin += 1
                if end - begin >= FEW:
                    self.pass_by(rows, units, begin, end)
                    place = int(units.last[end - 1]) + 1
        self._see_until(rows, place, len(rows))

    def _see_until(self, rows: RowColumns, place: int, end: int) -> int:
        for at in range(place, end):
            row = rows.row(at)
            self.see(row.no, row.event, row.header)
        return max(place, end)

    def is_calm(self, rows: RowColumns, units: Units, begin: int) -> bool:
        """Whether nothing is known that makes more of regular units from `begin` on than they say themselves."""
        if (
            self._missed is not None
            or self._asked is not None
            or self._robbed is not None
            or self._interruption is not None
        ):
            return False
        if self._holder not in (None, int(units.source[begin])):
            return False
        if any(master.clear is not None for master in self._masters.values()):
            return False
        if units.token[begin]:
            return self._token is None
        return not self._newest or self._newest != octets_of(rows, int(units.request[begin]))

    def pass_by(self, rows: RowColumns, units: Units, begin: int, end: int) -> None:
        """Stand behind regular units [begin, end), the last of which is answered."""
        which, frames = slice(begin, end), rows.frames
        request, last = units.request[which], int(units.last[end - 1])
        first = int(request[0])
        self._first = int(frames.start[first]) if self._first is None else self._first
        self._last = max(self._last, int(frames.end[first : last + 1].max()))
        self._heard, self._slack = int(frames.end[last]), int(rows.slack[last])
        silent = request[units.poll[which] & ~units.answered[which]]
        self._wasted += int(np.clip(frames.start[silent + 1] - frames.end[silent], 0, self._slot).sum())
        self._gone.difference_update(np.unique(units.source[which]).tolist())
        self._count(units, which)
        self._pass_tokens(rows, units, which)
        self._exchange(rows, units, which)
        self._token, self._newest = None, octets_of(rows, int(request[-1]))

    def _count(self, units: Units, which: slice) -> None:
        """Tokens, requests and polls of each master."""
        source, token, poll = units.source[which], units.token[which], units.poll[which]
        counts = [
            np.bincount(source[some], minlength=128).tolist()
            for some in (token, ~token & ~poll, poll, poll & units.answered[which])
        ]
        for address in np.unique(source).tolist():
            master = self._master(address)
            tokens, requests, polls, answered = (count[address] for count in counts)
            view = master.view
            master.view = replace(
                view,
                tokens=view.tokens + tokens,
                requests=view.requests + requests,
                polls=view.polls + polls,
                answered=view.answered + answered,
            )

    def _pass_tokens(self, rows: RowColumns, units: Units, which: slice) -> None:
        at = np.flatnonzero(units.token[which])
        if not len(at):
            return
        source, to = units.source[which][at], units.destination[which][at]
        ends = rows.frames.end[units.request[which][at]]
        pairs, counts = np.unique(source << 7 | to, return_counts=True)
        for pair, count in zip(pairs.tolist(), counts.tolist(), strict=True):
            following = self._master(pair >> 7).following
            following[pair & 127] = following.get(pair & 127, 0) + count
        rotations: list[tuple[int, Times]] = []
        for address, mine in grouped(to):
            master, got = self._master(address), ends[mine]
            rotations.append((address, np.diff(got) if master.got is None else np.diff(got, prepend=master.got)))
            master.got = int(got[-1])
        _add(rotations, {address: self._master(address).rotation for address, _ in rotations})
        self._holder = int(to[-1])

    def _exchange(self, rows: RowColumns, units: Units, which: slice) -> None:
        """Data exchange of each slave."""
        at = np.flatnonzero(units.exchange[which])
        if not len(at):
            return
        order = at[np.argsort(units.destination[which][at], kind="stable")]
        slave_of, source = units.destination[which][order], units.source[which][order]
        times, urgent = rows.frames.start[units.request[which][order]], units.urgent[which][order]
        begins = np.flatnonzero(np.append(True, slave_of[1:] != slave_of[:-1]))
        cycles = np.append(np.int64(0), times[1:] - times[:-1])
        pauses, is_cycle, any_urgent = cycles.copy(), np.ones(len(cycles), bool), bool(urgent.any())
        slaves = [self.slaves[address] for address in slave_of[begins].tolist()]
        bounds = list(zip(begins.tolist(), [*begins[1:].tolist(), len(order)], strict=True))
        for slave, (begin, end) in zip(slaves, bounds, strict=True):
            first = int(times[begin])
            is_cycle[begin] = slave.begun is not None
            cycles[begin] = 0 if slave.begun is None else first - slave.begun
            pauses[begin] = 0 if slave.asked is None else first - slave.asked
            slave.begun = int(times[end - 1])
        longest = np.maximum.reduceat(pauses, begins).tolist()
        for slave, (begin, end), pause in zip(slaves, bounds, longest, strict=True):
            if slave.owner is None or (source[begin:end] == slave.owner).all():
                slave.silence, slave.asked = max(slave.silence, pause), int(times[end - 1])
            else:
                _serve(slave, times[begin:end][source[begin:end] == slave.owner])
            slave.heard(True)
            slave.exchanges += end - begin
            slave.serve()
            slave.urgent = _trailing(urgent[begin:end], slave.urgent) if any_urgent else 0
            slave.unanswered = slave.run = 0
        histograms = {address: self.slaves[address].cycle for address in slave_of[begins].tolist()}
        add_grouped(histograms.__getitem__, slave_of[is_cycle], cycles[is_cycle])


def _serve(slave: SlaveView, times: Times) -> None:
    """Requests of its master among those of others."""
    for time in times.tolist():
        slave.silence = max(slave.silence, 0 if slave.asked is None else time - slave.asked)
        slave.asked = time


def _stretches(units: Units) -> Iterator[tuple[int, int]]:
    """Units directly behind one another, up to one that is answered: the first of them, and the one behind the last."""
    if not len(units):
        return
    follows = np.append(False, units.request[1:] == units.last[:-1] + 1)
    begins = np.flatnonzero(~follows)
    ends = np.append(begins[1:], len(units))
    newest = np.maximum.accumulate(np.where(units.answered, np.arange(len(units)), -1))[ends - 1] + 1
    for begin, end in zip(begins.tolist(), newest.tolist(), strict=True):
        if end - begin >= FEW:
            yield begin, end


def grouped(keys: Times) -> Iterator[tuple[int, Times]]:
    """Each distinct key with its places, in their order."""
    if not len(keys):
        return
    order = np.argsort(keys, kind="stable")
    begins = np.flatnonzero(np.append(True, keys[order][1:] != keys[order][:-1]))
    for begin, end in zip(begins.tolist(), [*begins[1:].tolist(), len(order)], strict=True):
        yield int(keys[order[begin]]), order[begin:end]


def _add(groups: list[tuple[int, Times]], histograms: dict[int, Histogram]) -> None:
    """Durations to the histogram of each key."""
    if groups:
        keys = np.repeat([key for key, _ in groups], [len(values) for _, values in groups])
        add_grouped(histograms.__getitem__, keys, np.concatenate([values for _, values in groups]))


def _trailing(urgent: Masks, before: int) -> int:
    """How many of the last are urgent, those before included where all are."""
    calm = np.flatnonzero(~urgent)
    return len(urgent) - 1 - int(calm[-1]) if len(calm) else before + len(urgent)


def octets_of(rows: RowColumns, place: int) -> bytes:
    """The octets of a row."""
    begin = int(rows.frames.offset[place])
    return rows.octets[begin : begin + int(rows.frames.length[place])].tobytes()
