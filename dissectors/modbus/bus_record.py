"""The record of a Modbus line as a whole: what `observer.py` gathers and `rules_bus.py` judges."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from dissectors import busiest
from dissectors.chances import is_rare
from dissectors.findings import Tally, together
from dissectors.frame import Flaw
from dissectors.late_speakers import LateSpeakers
from dissectors.line import MS, Timing
from dissectors.modbus.carried_over import CarriedOver
from dissectors.modbus.poll_order import Neighbours
from dissectors.modbus.station_record import Cycles, StationRecord
from dissectors.modbus.text_changes import TextDamage
from dissectors.rhythm import Rhythm
from dissectors.strikes import Strikes
from dissectors.wrong_checks import Habit, WrongChecks

if TYPE_CHECKING:
    from dissectors.modbus.odd_ends import OddEnd

_SENDERS_KEPT = 300
_SCAN_LEAST = 4
_SEARCHES = 3  # times that a search goes through all addresses, and different requests that it makes
_SCAN_AGAIN, _SCAN_ALONE = 8, 20  # addresses of a search that goes on, beside polling and by itself
_CUT_LEAST, _CUT_OFTEN = 3, 6  # stations, and their answers, without their first octet
_AGAIN_KEPT, _AGAIN_LEAST = 256, 8
_AGAIN_SOON = 150 * MS  # hardly a master repeats sooner
_UNHEARD_LEAST = 3
_CLOSE_KEPT = 4096
_HASTY_KEPT = 256
_CROSSED_KEPT = 256
_ELSEWHERE = 10  # of so many answers of its own one by another: what is rarer answered a request that was lost
_LATE_KEPT = 4096

PAUSE_MARGIN = 5
"""So many times the adapter's delay must fit into 1.5 characters before pauses inside frames are judged."""


Hasty = tuple[int, int, int, int, int, tuple[Neighbours, ...]]
"""A request after another that nothing had followed: the longest reading of the silence between (ns), the unit asked
before, time, frame before, frame; where it has the shape of an answer, too, the order in which that was a late one."""


def _no_words(unit: int, code: int) -> str:
    return ""


def _unknown(unit: int) -> bool:
    return False


@dataclass(slots=True)
class Again:
    """Requests that were answered when they came a second time. `further`: those of which that was not enough; `after`:
    ns from the first time to the second, of some; `units`: who answered."""

    tally: Tally = field(default_factory=Tally)
    further: int = 0
    after: list[int] = field(default_factory=list)
    units: set[int] = field(default_factory=set)

    def add(self, unit: int, time: int, after: int, *frames: int | None) -> None:
        """Take the next one."""
        self.tally.add(time, *frames)
        self.units.add(unit)
        if len(self.after) < _AGAIN_KEPT:
            self.after.append(after)


@dataclass(slots=True)
class BusRecord:
    """What was seen on the bus. Times are ns.

    `unlistened`: how long nobody listened between `first` and `now`.
    `hasty`: requests after another that nothing had followed. `broken_in`: the same of damaged frames that begin as a
    request to another station. `too_many`: whether there were more such than are kept. `close`, `paused`: by sender; of
    the first the first ones, (time, frame before, frame), `close_ever`: all. `odd_ends`: ASCII frames that do not end
    with CR LF, by how they end and by sender.
    `held_back`: of the paused frames, those that an adapter may have made so that nobody named.
    `damaged_here`: damaged requests that were answered all the same. `text_damage`: of damaged requests, and of what
    came unasked and may be one.
    `again`: requests that were answered when they came a second time.
    `crossed`: answers to the request before the newest, which came sooner than a turn takes; by what may follow what.
    `asked_twice`: second answers to requests that were heard twice, one directly behind the other.
    `to_nobody`: reads of address 0, and who answered. `cut_echoes`: requests given back in part.
    `newest_answer`: row and unit of the newest good one; `behind_answers`: damaged requests directly behind one, by
    unit.
    `octets`, `frames`: of each sender ("master", "station 3").
    `late_frames`: answers that came too late. `broadcast_answers`: who answered broadcasts. `pairs`: (unit asked, unit
    that answered); `repeated_elsewhere`: repeats of requests that such a pair is about, by unit asked.
    `maker_words`: unit and exception code → what the maker of the device says of it, empty where not known;
    `has_numbers`: unit → whether its manual says which numbers it can be given.
    """

    timing: Timing
    first: int | None = None
    now: int = 0
    unlistened: int = 0
    rhythm: Rhythm = field(default_factory=Rhythm)
    requests: int = 0
    answers: int = 0
    echoes: int = 0
    stations: dict[int, StationRecord] = field(default_factory=dict)
    damaged_here: Tally = field(default_factory=Tally)
    damaged_requests: Tally = field(default_factory=Tally)
    text_damage: TextDamage = field(default_factory=TextDamage)
    carried_over: CarriedOver = field(default_factory=CarriedOver)
    newest_answer: tuple[int, int] = (0, 0)
    behind_answers: dict[int, Tally] = field(default_factory=dict)
    strikes: Strikes = field(default_factory=Strikes)  # "master", "station 3" …
    late_speakers: LateSpeakers = field(default_factory=LateSpeakers)
    unasked: Tally = field(default_factory=Tally)
    unasked_behind_noise: int = 0
    again: Again = field(default_factory=Again)
    crossed: dict[tuple[Neighbours, ...], Tally] = field(default_factory=dict)
    asked_twice: Tally = field(default_factory=Tally)
    answers_to_broadcast: Tally = field(default_factory=Tally)
    noise_after_broadcast: Tally = field(default_factory=Tally)
    hasty: list[Hasty] = field(default_factory=list)
    broken_in: list[Hasty] = field(default_factory=list)
    too_many: bool = False
    close: dict[str, list[tuple[int, int, int]]] = field(default_factory=dict)
    close_ever: dict[str, Tally] = field(default_factory=dict)
    paused: dict[str, Tally] = field(default_factory=dict)
    held_back: Counter[str] = field(default_factory=Counter)
    odd_ends: dict[tuple[OddEnd, str], Tally] = field(default_factory=dict)
    pairs: dict[tuple[int, int], Tally] = field(default_factory=dict)
    repeated_elsewhere: Counter[int] = field(default_factory=Counter)
    to_nobody: Tally = field(default_factory=Tally)
    for_nobody: Counter[int] = field(default_factory=Counter)
    cut_echoes: Tally = field(default_factory=Tally)
    requests_damaged_by: dict[Flaw, Tally] = field(default_factory=dict)
    checks_of_requests: WrongChecks = field(default_factory=WrongChecks)  # of the damaged ones
    octets: Counter[str] = field(default_factory=Counter)
    frames: Counter[str] = field(default_factory=Counter)
    late_frames: set[int] = field(default_factory=set)
    broadcast_answers: Counter[int] = field(default_factory=Counter)
    cycles: Cycles = field(default_factory=Cycles)
    maker_words: Callable[[int, int], str] = _no_words
    has_numbers: Callable[[int], bool] = _unknown

    def begin_anew(self, missed: int) -> None:
        """Nobody listened for so many ns: what comes next is measured against nothing before."""
        self.unlistened += missed
        self.cycles.begin_anew()
        for station in self.stations.values():
            station.last_start = None

    def see_behind(self, time: int, row: int | None) -> None:
        """A damaged request, in that row, ns: behind whose answer it stands directly; where a late one is due, that may
        have struck it."""
        newest, unit = self.newest_answer
        if newest and row == newest + 1 and time >= self.late_speakers.until:
            self.behind_answers.setdefault(unit, Tally()).add(time, row)

    @property
    def span(self) -> int:
        """From the first octet to the last, without what nobody heard, ns; at least 1."""
        return max(1, self.now - (self.first or 0) - self.unlistened)

    @property
    def judges_pauses(self) -> bool:
        """Whether a pause inside a frame is the sender's: a busy computer goes well over what its adapter may add."""
        return PAUSE_MARGIN * self.timing.latency <= self.timing.t15

    @property
    def repeated_after(self) -> int | None:
        """After how long, ns, each request comes a second time and is answered then: a relay's doing.

        None where a master may repeat, which asks some things only once, others three times, and waits longer.
        """
        again, answered = self.again, sum(station.answered for station in self.stations.values())
        if len(again.units) < 2 or 10 * again.tally.count < 9 * max(answered, _AGAIN_LEAST):
            return None
        if _AGAIN_LEAST * again.further > again.tally.count:
            return None
        after = sorted(again.after)
        low, usual, high = (after[len(after) * part // 10] for part in (1, 5, 9))
        steady = high - low <= usual // 10 + self.timing.latency + 2 * MS
        return usual if steady and usual < _AGAIN_SOON else None

    @property
    def cut_by_master(self) -> list[int]:
        """Stations whose first octet is lost as a rule, where these are several and all that answer so soon."""
        cut = [unit for unit, one in self.stations.items() if 2 * one.first_lost.count >= max(one.asked, _CUT_OFTEN)]
        latest = max((self.stations[unit].first_lost.last for unit in cut), default=0)
        others = [one for unit, one in self.stations.items() if unit not in cut and one.times.count]
        return sorted(cut) if len(cut) >= _CUT_LEAST and all(_usual(one) > latest for one in others) else []

    def unheard(self) -> list[int]:
        """Stations whose answers this tap missed, by what the master did: all, where none is heard of any. Of addresses
        that it was only searching, nothing tells that somebody is there."""
        asked = {unit: one for unit, one in self.stations.items() if one.missing.count >= _UNHEARD_LEAST}
        if len(asked) > 1 and not any(one.repeats.count for one in asked.values()) and self.hears_nobody:
            return sorted(asked)
        if self.rhythm.is_by_the_clock:
            return []
        searched = self.scanned()
        return sorted(unit for unit, one in self.stations.items() if one.is_unheard and unit not in searched)

    @property
    def hears_nobody(self) -> bool:
        """Whether nothing was heard that a station may have sent."""
        heard = any(one.is_heard for one in self.stations.values())
        return not (heard or self.answers or self.echoes)

    def scanned(self) -> list[int]:
        """Addresses that were tried seldom and are nobody's, where the master tried so many that it was searching.

        Once each, or again and again: then beside others that it asks far more often, or so many that nobody has them.
        """
        silent = {
            unit: station.turns
            for unit, station in self.stations.items()
            if not station.answered and 0 < station.turns <= _SEARCHES and station.missing.count == station.asked
        }
        once = sorted(unit for unit, turns in silent.items() if turns == 1)
        most = max(silent.values(), default=0)
        busiest = max((station.turns for station in self.stations.values() if station.answered), default=0)
        least = _SCAN_AGAIN if busiest >= _SEARCHES * most else _SCAN_ALONE
        if len(silent) >= least and len({key for unit in silent for key in self.stations[unit].requests}) <= _SEARCHES:
            return sorted(silent)
        return once if len(once) >= _SCAN_LEAST else []

    def too_close(self, sender: str, time: int, before: int, no: int) -> None:
        """Note a frame that began too soon after the one before."""
        calls = self.close.setdefault(sender, [])
        if len(calls) < _CLOSE_KEPT:
            calls.append((time, before, no))
        self.close_ever.setdefault(sender, Tally()).add(time)

    def close_frames(self, sender: str) -> Tally:
        """Frames of a sender that began too soon, but for late answers; of many what holds for the first ones."""
        tally, every = Tally(), self.close_ever[sender]
        for time, before, no in self.close[sender]:
            if before not in self.late_frames and no not in self.late_frames:
                tally.add(time, before, no)
        if every.count > len(self.close[sender]) and tally.count:
            tally.count, tally.last = tally.count * every.count // len(self.close[sender]), every.last
        return tally

    def broke_in(self, rows: list[Hasty], row: Hasty) -> None:
        """Note one more of `hasty` or `broken_in`; where they are many, those that tell something stay."""
        if len(rows) >= _HASTY_KEPT:
            rows[:] = self.too_hasty(rows)
        if len(rows) < _HASTY_KEPT:
            rows.append(row)
        else:
            self.too_many |= bool(self.too_hasty([row]))

    def too_hasty(self, rows: list[Hasty]) -> list[Hasty]:
        """Those that came sooner than the station asked before has ever answered, which is there; no late answers, and
        not what has the shape of one to what is asked before that station as a rule."""
        units = {row[1]: self.stations[row[1]] for row in rows if row[1] in self.stations}
        soonest = {u: s.times.soonest() for u, s in units.items() if s.answered >= 3 and 2 * s.answered > s.asked}
        soon = [row for row in rows if 10 * row[0] < 9 * soonest.get(row[1], 0) and row[4] not in self.late_frames]
        return [row for row in soon if not any(self.cycles.order.is_usual(*two) for two in row[5])]

    def cross(self, neighbours: tuple[Neighbours, ...], time: int, *frames: int | None) -> None:
        """Note one more of `crossed`."""
        if neighbours in self.crossed or len(self.crossed) < _CROSSED_KEPT:
            self.crossed.setdefault(neighbours, Tally()).add(time, *frames)

    @property
    def crossed_by_another(self) -> Tally:
        """Those of `crossed` that are not in the order in which one master asks, which may not have waited. None where
        these are no more than twice the rest: damage hides requests, and what is beside what, too."""
        order, every = self.cycles.order, together(self.crossed.values())
        by_others = together(one for two, one in self.crossed.items() if not any(order.is_usual(*pair) for pair in two))
        return by_others if 3 * by_others.count > 2 * every.count else Tally()

    def late(self, no: int | None) -> None:
        """Note an answer that came too late."""
        if no is not None and len(self.late_frames) < _LATE_KEPT:
            self.late_frames.add(no)

    def pair(self, pair: tuple[int, int]) -> Tally:
        """The record of one unit that answers for another."""
        is_kept = pair in self.pairs or len(self.pairs) < _SENDERS_KEPT
        return self.pairs.setdefault(pair, Tally()) if is_kept else self.unasked

    def is_answered_elsewhere(self, asked: int, answered: int) -> bool:
        """Whether one unit answers for another as a rule, and not where a request to itself was lost."""
        tally, own = self.pairs.get((asked, answered)), self.stations.get(asked)
        return tally is not None and (own is None or _ELSEWHERE * tally.count >= own.answered)

    def ended_oddly(self, sender: str) -> int:
        """Frames of a sender that are damaged by their end alone."""
        return sum(tally.count for (end, who), tally in self.odd_ends.items() if who == sender and end.is_damage)

    @property
    def miscounted_requests(self) -> Habit | None:
        """What the damaged requests have in common that are right but for the check."""
        damaged = self.damaged_requests.count
        return self.checks_of_requests.habit(damaged, self.requests - damaged)

    def gap_tally(self, by_sender: dict[str, Tally], sender: str) -> Tally:
        """The record of one sender's gaps."""
        return by_sender.setdefault(sender, Tally())

    def rare(self, count: int, of: int, when: Tally | None = None) -> bool:
        """Whether so few are not worth a warning. `when`: they themselves, where it is known when they came."""
        return is_rare(count, of, self.span, None if when is None else when.quarters)

    def when(self, tally: Tally, of: int, count: int | None = None) -> str:
        """How many of them, or of `count` of them, came within a quarter of an hour, where that was a fault; or ""."""
        return busiest.words(tally.quarters, tally.count if count is None else count, of, self.span)


def _usual(station: StationRecord) -> int:
    """The median response time of a station that has answered, ns."""
    median = station.times.median()
    return 0 if median is None else median.nominal
