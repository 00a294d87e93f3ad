"""The rules of a PROFIBUS line over many rows at once: stretches of regular units by columns, all else row by row."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dissectors import stretches
from dissectors.columns import NONE, VERDICTS
from dissectors.profibus.bulk_watch import BulkBusWatch, grouped, octets_of
from dissectors.profibus.findings import ProfibusFindings
from dissectors.profibus.regular_columns import Units
from dissectors.row_columns import in_turn
from dissectors.tracker import Verdict

if TYPE_CHECKING:
    from dissectors.columns import Masks, Times
    from dissectors.row_columns import RowColumns

_ANSWERED, _DATA, _BROADCAST = (
    VERDICTS.index(verdict) for verdict in (Verdict.ANSWERED, Verdict.DATA, Verdict.BROADCAST)
)


class BulkProfibusFindings(ProfibusFindings):
    """The same from many rows at once (`dissectors.row_columns.JudgesColumns`)."""

    watches = BulkBusWatch
    watch: BulkBusWatch

    def take(self, rows: RowColumns) -> None:
        """Take many rows; few go one by one."""
        if len(rows) < stretches.LEAST:
            in_turn(self, rows)
            return
        judging = _Judging(self, rows)
        stretches.take(self, rows, judging.stretches, judging.is_at_rest, judging.pass_by)


class _Judging:
    """One judge and the stretches of some rows."""

    def __init__(self, judge: BulkProfibusFindings, rows: RowColumns) -> None:
        self._judge, self._rows = judge, rows
        units = Units.of(rows)
        transaction, closed = _closing(units, rows)
        self._units = units.take(closed)
        self._closed = rows.transactions.take(transaction)
        at_once = ~self._units.answered & ~self._units.poll
        self.stretches = stretches.Stretches.of(transaction, self._units.request, self._units.answered, at_once, rows)

    def is_at_rest(self, begin: int, end: int) -> bool:
        """Whether the watch knows nothing that makes more of these units."""
        return self._judge.watch.is_calm(self._rows, self._units, begin)

    def pass_by(self, begin: int, end: int) -> None:
        """Put the judge behind units [begin, end)."""
        units, which = self._units, slice(begin, end)
        count = int(units.last[end - 1]) + 1 - int(units.request[begin])
        token = units.token[which]
        passed = np.bincount(units.destination[which][token], minlength=1)
        told = np.bincount(units.source[which], minlength=1)
        self._judge.count_rows(count, _counts(passed), _counts(told))
        self._count_octets(which)
        self._judge.watch.pass_by(self._rows, units, begin, end)
        self._settle(begin + np.flatnonzero(units.exchange[which]))

    def _count_octets(self, which: slice) -> None:
        units, lengths = self._units, self._rows.frames.length
        request, last, answered = units.request[which], units.last[which], units.answered[which]
        tokens = lengths[request[units.token[which]]]
        total = int(lengths[request[0] : last[-1] + 1].sum()) - int(tokens.sum())
        answers = np.bincount(units.destination[which][answered], lengths[last[answered]], minlength=1)
        self._judge.sent.count(total, _counts(answers))

    def _settle(self, asked: Times) -> None:
        """What became of data exchange, by station; polls only pass by."""
        judge, units, closed = self._judge, self._units, self._closed
        for address, places in grouped(units.destination[asked]):
            mine = asked[places]
            least = closed.least[mine]
            record, limit = judge.records[address], judge.slow_of(address)
            record.requests += len(mine)
            record.exchanged += len(mine)
            record.answers += len(mine)
            record.before = Verdict.ANSWERED
            record.silence.heard()
            told = mine[-2:] if record.is_clear else np.append(mine[:1], mine[1:][-2:])
            for place in units.request[told].tolist():
                record.ask(self._rows.first + place, octets_of(self._rows, place))
            for at in mine[least > limit].tolist():
                rows = (int(closed.request[at]), int(closed.response[at]))
                record.is_slow(int(closed.least[at]), int(closed.start[at]), *rows)


def _closing(units: Units, rows: RowColumns) -> tuple[Times, Masks]:
    """The transaction that each unit is, as it should be for regular ones, and which units have one."""
    closed, count = rows.transactions, len(rows)
    request = closed.request - rows.first
    inside = (closed.request != NONE) & (request >= 0) & (request < count)
    of_row = np.full(count, NONE, np.int64)
    of_row[request[inside]] = np.flatnonzero(inside)
    which = of_row[units.request]
    has = which >= 0
    which = np.maximum(which, 0)
    if not len(closed):
        return np.zeros(0, np.int64), np.zeros(len(units), bool)
    asked = units.exchange | units.poll
    behind = np.where(asked, units.request + 1, units.request)
    has &= (rows.closed_by[which] == behind) & (closed.attempt[which] == 1) & (closed.error[which] == 0)
    response = np.where(units.answered, rows.first + units.last, NONE)
    has &= closed.response[which] == response
    verdict = np.where(units.answered, _ANSWERED, np.where(units.token | units.poll, _DATA, _BROADCAST))
    has &= closed.verdict[which] == verdict
    has &= (closed.latency[which] != NONE) == units.answered
    has &= closed.station[which] == np.where(asked | units.token, units.destination, NONE)
    return which[has], has


def _counts(counts: Times) -> dict[int, int]:
    """Places of what is more than nothing, and how often."""
    return {int(address): int(counts[address]) for address in np.flatnonzero(counts)}
