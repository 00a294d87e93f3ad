"""Several stations that stop answering at one moment: they share what failed. Pure, bounded."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING

from dissectors.findings import Finding, Severity, Tally, counted, times
from dissectors.line import NS_PER_S
from dissectors.tracker import PASSING, Transaction, Verdict
from dissectors.words import duration, elapsed
from sniff.analysis.line_rules import LINE_RULES as RULES

if TYPE_CHECKING:
    from dissectors.columns import TransactionColumns

LOST_IN_A_ROW = 3
ANSWERED_BEFORE = 5
MOST_STATIONS = 300
MOMENT = 30 * NS_PER_S
"""From the first of their last answers to the last of the first misses; over longer, a hole, nobody saw what stopped
when."""

ABSENT_LEAST = 10 * NS_PER_S
"""For so long none of a station's first requests was answered; sooner it may just have been started."""

BY_CHANCE = 0.1
"""Chance below which losses in one part of a capture are no chance: each falls anywhere in it."""


LOSSES_KEPT = 16
SHOWN = 3
OFTEN = 3
"""So many times the same ones is no single event that is over."""


@dataclass(frozen=True, slots=True)
class _Loss:
    """`together`: last answer, first miss, back or 0, station, of each; `moment`: when they were missed; ns."""

    together: list[tuple[int, int, int, int]]
    moment: int

    @property
    def back(self) -> int | None:
        """When all were there again, ns; None where one is not."""
        backs = [one[2] for one in self.together]
        return max(backs) if all(backs) else None


@dataclass(slots=True)
class _Station:
    """How a station answers. `came`: when it answered first, ns, where it had left all before without answer."""

    answered: int = 0
    last_answer: int = 0
    missed: int = 0
    first_missed: int = 0
    rows: list[int] = field(default_factory=list)
    came: int | None = None
    losses: deque[tuple[int, int, int]] = field(
        default_factory=lambda: deque(maxlen=LOSSES_KEPT)
    )  # last answer, miss, back (0)


class LostTogether:
    """Fed the transactions of one bus; `findings` may be asked at any time. `has_times`: false of a log without them,
    of which no moment is told."""

    def __init__(self, *, has_times: bool = True) -> None:
        self._has_times = has_times
        self._stations: dict[int, _Station] = {}

    def settle(self, transaction: Transaction) -> None:
        """Take a transaction that closed."""
        number = transaction.station
        if number is None or transaction.is_passing or transaction.request is None:
            return
        station = self._stations.get(number)
        if station is None:
            if len(self._stations) >= MOST_STATIONS:
                return
            station = self._stations[number] = _Station()
        if transaction.verdict is Verdict.NO_RESPONSE:
            if not station.missed:
                station.first_missed, station.rows = transaction.start, []
            station.missed += 1
            station.rows = [*station.rows[:3], transaction.request]
        elif transaction.response is not None:
            self._back(station, transaction.start)
            station.answered += 1
            station.last_answer = transaction.end

    def settle_many(self, closed: TransactionColumns) -> None:
        """Take transactions that closed; those of stations that all answer as columns."""
        import numpy as np

        from dissectors.columns import NONE, VERDICTS

        passing = [code for code, name in enumerate(closed.names) if name in PASSING]
        asked = (closed.station != NONE) & (closed.request != NONE) & ~np.isin(closed.kind, passing)
        missed = asked & (closed.verdict == VERDICTS.index(Verdict.NO_RESPONSE))
        stations, firsts = np.unique(closed.station[asked], return_index=True)
        one_by_one = set(closed.station[missed].tolist())
        one_by_one |= {number for number, station in self._stations.items() if station.missed}
        for number in stations[np.argsort(firsts)].tolist():  # in the order of first sight
            if number not in self._stations and len(self._stations) < MOST_STATIONS:
                self._stations[number] = _Station()
        answered = asked & (closed.response != NONE)
        places = np.flatnonzero(answered)
        numbers, lasts, counts = np.unique(closed.station[places][::-1], return_index=True, return_counts=True)
        for number, last, count in zip(numbers.tolist(), lasts.tolist(), counts.tolist(), strict=True):
            station = self._stations.get(number)
            if station is not None and number not in one_by_one:
                station.answered += count
                station.last_answer = int(closed.end[places[len(places) - 1 - last]])
        told = missed | answered
        places = np.flatnonzero(told & np.isin(closed.station, sorted(one_by_one)))
        places = places[np.argsort(closed.station[places], kind="stable")]
        again = ~missed[places]  # answers directly behind another answer of their station: only counted
        again[1:] &= ~missed[places[:-1]] & (closed.station[places[1:]] == closed.station[places[:-1]])
        again[:1] = False
        for head, end in pairwise([*np.flatnonzero(~again).tolist(), len(places)]):
            self.settle(closed.transaction(int(places[head])))
            station = self._stations.get(int(closed.station[places[head]]))
            if station is not None and end - head > 1:
                station.answered += end - head - 1
                station.last_answer = int(closed.end[places[end - 1]])

    def _back(self, station: _Station, time: int) -> None:
        if station.missed >= LOST_IN_A_ROW and station.answered >= ANSWERED_BEFORE:
            station.losses.append((station.last_answer, station.first_missed, time))
        elif station.missed >= LOST_IN_A_ROW and not station.answered and time - station.first_missed >= ABSENT_LEAST:
            station.came = time
        station.missed = 0

    def findings(self, first: int, now: int) -> Iterator[Finding]:
        """What there is to say so far. `first`, `now`: ns, of the first octet of the capture and the newest."""
        by_names: dict[tuple[int, ...], list[_Loss]] = {}
        for together, names, moment in self.losses(first, now):
            by_names.setdefault(tuple(names), []).append(_Loss(together, moment))
        for stations, losses in by_names.items():
            yield self._lost(losses[0], stations, first) if len(losses) == 1 else self._often(losses, stations, first)

        yield from self._came(first, now)

    def _came(self, first: int, now: int) -> Iterator[Finding]:
        """Stations that answered nothing at first, and all from one moment on."""
        came = sorted((one.came, number) for number, one in self._stations.items() if one.came is not None)
        while came and self._has_times:
            begin = came[0][0]
            together = [one for one in came if one[0] - begin <= MOMENT]
            came = came[len(together) :]
            window, names = together[-1][0] - begin, tuple(sorted(number for _, number in together))
            if len(names) < 2 or window >= now - first or (window / (now - first)) ** (len(names) - 1) > BY_CHANCE:
                continue
            tally = Tally()
            for number in names:
                tally.add(first)
                tally.add(begin, *self._stations[number].rows[:2])
            seen = f"{len(names)} stations ({', '.join(map(str, names))}) answered nothing at first, and together "
            seen += f"from {elapsed(begin - first)} after the begin on: {self._others(names, first)}"
            finding = tally.found(RULES["LN305"], "bus", seen, Severity.WARNING)
            yield replace(finding, count=len(names), stations=names)

    def losses(self, first: int, now: int) -> Iterator[tuple[list[tuple[int, int, int, int]], list[int], int]]:
        """The same as values: losses (last answer, first miss, back or 0: ns; station), stations, the moment."""
        losses: list[tuple[int, int, int, int]] = []  # last answer, first miss, back, station
        for number, station in self._stations.items():
            losses += [(*loss, number) for loss in station.losses]
            if station.missed >= LOST_IN_A_ROW and station.answered >= ANSWERED_BEFORE:
                losses.append((station.last_answer, station.first_missed, 0, number))
        losses.sort(key=lambda loss: loss[1])
        span = now - first
        while losses:
            moment = losses[0][1]  # the first miss: who answered after it was not lost then
            together = [loss for loss in losses if loss is losses[0] or loss[0] <= moment]
            names = sorted({loss[3] for loss in together})
            window = max(loss[1] for loss in together) - min(loss[0] for loss in together)
            losses = [loss for loss in losses if loss not in together]
            if len(names) >= 2 and window < span and (window / span) ** (len(names) - 1) <= BY_CHANCE:
                yield together, names, moment

    @property
    def present(self) -> int:
        """Stations that answered now and then."""
        return sum(station.answered >= ANSWERED_BEFORE for station in self._stations.values())

    def _lost(self, loss: _Loss, names: tuple[int, ...], first: int) -> Finding:
        window = max(one[1] for one in loss.together) - min(one[0] for one in loss.together)
        is_one = window < MOMENT or not self._has_times
        when = "at the same moment" if is_one else f"within {duration(window)}"
        when += f", {elapsed(loss.moment - first)} after the begin" if self._has_times else ""
        back = loss.back
        after = f" after {elapsed(back - loss.moment)}" if back is not None and self._has_times else ""
        came = "" if back is None else f"; they were back{after}"
        return self._found([loss], names, f"{when}: {self._others(names, loss.moment)}{came}")

    def _often(self, losses: list[_Loss], names: tuple[int, ...], first: int) -> Finding:
        """The same stations again and again, of which the last losses of each are known."""
        least = "at least " if any(len(self._stations[name].losses) == LOSSES_KEPT for name in names) else ""
        said = [elapsed(loss.moment - first) for loss in losses[:SHOWN]]
        more = " …" if len(losses) > SHOWN else ""
        when = f", {', '.join(said)}{more} after the begin" if self._has_times else ""
        away = [loss.back - loss.moment for loss in losses if loss.back is not None]
        came = f"; they were back after {elapsed(max(away))} at most" if away and self._has_times else ""
        came += "; they are not back from the last time" if losses[-1].back is None else ""
        others = self._others(names, losses[-1].moment)
        finding = self._found(losses, names, f"together {least}{times(len(losses))}{when}: {others}{came}")
        return replace(finding, count=len(losses))

    def _others(self, names: tuple[int, ...], moment: int) -> str:
        others = [one for number, one in self._stations.items() if number not in names and one.last_answer > moment]
        return "all of them" if not others else f"{counted(len(others), 'other station')} went on"

    def _found(self, losses: list[_Loss], names: tuple[int, ...], words: str) -> Finding:
        """A warning where they came back each time, and that was seldom."""
        tally = Tally()
        for loss in losses:
            for number in names:
                tally.add(loss.moment, *(self._stations[number].rows[:2] if loss is losses[-1] else ()))
        is_back = any(one[2] for one in losses[-1].together)
        severity = Severity.WARNING if is_back and len(losses) < OFTEN else Severity.ERROR
        seen = f"{len(names)} stations ({', '.join(map(str, names))}) stopped answering {words}"
        finding = tally.found(RULES["LN305"], "bus", seen, severity)
        return replace(finding, count=len(names), stations=names, lasts=losses[-1].back is None)
