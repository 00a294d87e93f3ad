"""Findings about devices by their profiles, of many rows at once: what the same exchange said before, it says again.

A poll list asks the same again and again, and most answers were heard before, octet for octet. What such an exchange
says is worked out once, by going through it as if it were alone (`_Rehearsal`), and told with each one that follows;
all others are judged row by row, in their order. Pure.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from dissectors.columns import NONE, VERDICTS
from dissectors.fingerprints import LONGEST, fingerprints, gathered
from dissectors.line import Timing
from dissectors.manifest import Dissector
from dissectors.profiles import Devices
from dissectors.row_columns import RowColumns, in_turn
from dissectors.subject import Subject
from sniff.analysis.device_remarks import DeviceRemarks, Remark
from sniff.analysis.point_reader import WHOLE
from sniff.analysis.profile_findings import ProfileFindings

if TYPE_CHECKING:
    import numpy.typing as npt

    from dissectors.columns import Masks, Times

MOST_KNOWN = 1 << 13
"""Different exchanges of which it is remembered what they say."""

_WHOLE = np.array([verdict in WHOLE for verdict in VERDICTS])
_ODD = np.uint64(0x9E3779B97F4A7C15)  # of splitmix64


@dataclass(frozen=True, slots=True)
class Outcome:
    """What an answer says of its device, whenever it is. `states`: how stations say that they run. `of`: whose answer
    it is, None without a profile."""

    remarks: tuple[Remark, ...]
    states: tuple[tuple[int, str], ...]
    of: Subject | None


class BulkProfileFindings(ProfileFindings):
    """The same, which also takes rows as columns (`dissectors.row_columns.JudgesColumns`)."""

    def __init__(self, timing: Timing, dissector: Dissector, devices: Devices) -> None:
        super().__init__(timing, dissector, devices)
        self._timing, self._dissector = timing, dissector
        self._known: dict[int, Outcome | None] = {}  # None: not to be told by itself

    def take(self, rows: RowColumns) -> None:
        """Take rows and what they closed."""
        if self._readings is None or not len(rows) or not len(rows.transactions):
            in_turn(self, rows)
            return
        exchanges = _Exchanges.of(rows)
        prompt = exchanges.take(~self._are_slow(rows, exchanges))
        outcomes = self._outcomes(rows, prompt)
        done = np.zeros(len(rows), bool)
        for place in outcomes:
            done[prompt.request[place]] = done[prompt.answer[place]] = True
        self._go_through(rows, prompt, outcomes, done)

    def _are_slow(self, rows: RowColumns, exchanges: _Exchanges) -> Masks:
        """Whose answers took longer than their profiles allow: how long is told of each."""
        closed = rows.transactions
        station, least = closed.station[exchanges.place], closed.least[exchanges.place]
        slow: Masks = np.zeros(len(exchanges), bool)
        for one in np.unique(station).tolist():
            profile = self._devices.at(None if one == NONE else one)
            limit = profile.limits_on(self._family).response if profile is not None else None
            if limit is not None:
                slow |= (station == one) & (least > limit)
        slow &= closed.latency[exchanges.place] != NONE
        return slow

    def _outcomes(self, rows: RowColumns, exchanges: _Exchanges) -> dict[int, Outcome]:
        """Of each exchange, by place, that says what it says by itself."""
        keys, first, which = np.unique(exchanges.key, return_index=True, return_inverse=True)
        if len(self._known) + len(keys) > MOST_KNOWN:
            self._known.clear()
        outcomes: list[Outcome | None] = []
        for key, place in zip(keys.tolist(), first.tolist(), strict=True):
            if key not in self._known:
                self._known[key] = self._rehearse(rows, exchanges, place)
            outcomes.append(self._known[key])
        found = ((place, outcomes[at]) for place, at in enumerate(which.tolist()))
        return {place: outcome for place, outcome in found if outcome is not None}

    def _rehearse(self, rows: RowColumns, exchanges: _Exchanges, place: int) -> Outcome | None:
        """What an answer says; None where that hangs on what was before, or something is said of the request, too."""
        told = _Rehearsal()
        alone = ProfileFindings(self._timing, self._dissector, self._devices, told)
        asked, answered = (rows.row(int(of[place])) for of in (exchanges.request, exchanges.answer))
        for row in (asked, answered):
            alone.see(row.no, row.event, row.header, row.placement)
        transaction = rows.transaction(int(exchanges.place[place]))
        alone.settle(replace(transaction, latency=None))
        if told.hangs_on_others or any(no != answered.no for _, no in told.remarks):
            return None
        return Outcome(
            tuple(remark for remark, _ in told.remarks), tuple(told.states), self.subject_at(transaction.station)
        )

    def _go_through(self, rows: RowColumns, exchanges: _Exchanges, outcomes: dict[int, Outcome], done: Masks) -> None:
        """Tell outcomes and judge all other rows, in the order of all of them."""
        closed, known = rows.transactions, {int(exchanges.place[at]): at for at in outcomes}
        others, begin = np.flatnonzero(~done).tolist(), 0
        closed_by = np.where(rows.closed_by < 0, len(rows), rows.closed_by).tolist()
        for place, row in enumerate(closed_by):
            while begin < len(others) and others[begin] <= row:
                self._see_at(rows, others[begin])
                begin += 1
            at = known.get(place)
            if at is None:
                self.settle(rows.transaction(place))
            else:
                self._tell(rows, int(exchanges.answer[at]), outcomes[at], is_timed=closed.latency[place] != NONE)
        for row in others[begin:]:
            self._see_at(rows, row)

    def _see_at(self, rows: RowColumns, place: int) -> None:
        row = rows.row(place)
        self.see(row.no, row.event, row.header, row.placement)

    def _tell(self, rows: RowColumns, answer: int, outcome: Outcome, *, is_timed: bool) -> None:
        """What the answer at a place says."""
        end = int(rows.frames.end[answer])
        for remark in outcome.remarks:
            self._remarks.tell(remark, end, rows.first + answer)
        for station, state in outcome.states:
            self._remarks.note_state(station, end, state)
        if outcome.of is not None and is_timed:
            self._count_answer(outcome.of)


class _Rehearsal(DeviceRemarks):
    """Remarks of one exchange, written down. `remarks`: each with the number of the frame that it is about; `states`:
    what stations said of how they run, in order. `hangs_on_others`: what was said before counts, or is forgotten."""

    def __init__(self) -> None:
        super().__init__()
        self.remarks: list[tuple[Remark, int]] = []
        self.states: list[tuple[int, str]] = []
        self.hangs_on_others = False

    def tell(self, remark: Remark, time: int, no: int, took: int = 0) -> None:
        """Write it down."""
        self.remarks.append((remark, no))

    def state_at(self, station: int | None, time: int) -> str:
        """Nobody knows here."""
        self.hangs_on_others = True
        return ""

    def note_state(self, station: int, time: int, state: str) -> None:
        """Write it down."""
        self.states.append((station, state))

    def forget_state(self, station: int | None) -> None:
        """Of what was said before."""
        self.hangs_on_others = True


@dataclass(frozen=True, slots=True)
class _Exchanges:
    """Exchanges of which the columns of some rows say all, one entry each: its place among the transactions, those of
    its frames among the rows. `key`: the same for those that say the same, but for times and numbers."""

    place: Times
    request: Times
    answer: Times
    key: npt.NDArray[np.uint64]

    def __len__(self) -> int:
        return len(self.place)

    def take(self, which: Masks) -> _Exchanges:
        """Some of them."""
        return _Exchanges(self.place[which], self.request[which], self.answer[which], self.key[which])

    @classmethod
    def of(cls, rows: RowColumns) -> _Exchanges:
        """All in these rows that their answers closed."""
        closed, placed = rows.transactions, rows.placed
        plain = rows.good & (placed.tx > 0) & (rows.frames.length > 0) & (rows.frames.length <= LONGEST)
        plain[list(rows.odd)] = False
        request, answer = closed.request - rows.first, closed.response - rows.first
        here = (closed.request != NONE) & (closed.response != NONE) & _WHOLE[closed.verdict]
        here &= (request >= 0) & (request < answer) & (answer < len(rows))
        place = np.flatnonzero(here & (rows.closed_by == answer))
        place = place[plain[request[place]] & plain[answer[place]]]
        request, answer = request[place], answer[place]
        if not len(place):
            return cls(place, request, answer, np.zeros(0, np.uint64))
        key = _mixed(_prints(rows, request), _prints(rows, answer))
        for one in (closed.verdict[place], closed.station[place]):
            key = _mixed(key, one)
        for column in (placed.role, placed.source, placed.destination):
            key = _mixed(_mixed(key, column[request]), column[answer])
        return cls(place, request, answer, key)


def _prints(rows: RowColumns, places: Times) -> npt.NDArray[np.uint64]:
    lengths = rows.frames.length[places].astype(np.int64)
    octets, edges = gathered(rows.octets, rows.frames.offset[places], lengths)
    return fingerprints(octets, edges, lengths)


def _mixed(key: npt.NDArray[np.uint64], other: npt.NDArray[np.integer]) -> npt.NDArray[np.uint64]:
    """One number of two."""
    both: npt.NDArray[np.uint64] = (key ^ (key >> np.uint64(29))) * _ODD + other.astype(np.uint64)
    return both
