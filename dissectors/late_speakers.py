"""Late speakers: damage that stands where the late answer of a station is due. Pure, bounded.

A station that answers when its master has given up answers into what the master sends next, or into the answer of
another station. Two senders at once are no frame, so nobody sees who was late: what was hit seems damaged by its own
sender, who is innocent. Three things tell:

- where the damage stands: while the answer to a request may still come that was waited for in vain (a *window*), and
  not elsewhere; each sender is compared with itself;
- what is damaged begins as the answer of the station that is waited for, or with its address where others answer;
- or it begins as the answer that was asked for and is longer than that can be.

A station that never answers anything is most likely absent, and speaks into nothing: of it only what is sure is said.
A sender that is hardly ever heard but in such windows may be damaged by itself, or hit: both are said.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Final

from dissectors.chances import at_least
from dissectors.findings import Finding, Tally, counted, times
from dissectors.line import NS_PER_S

MASTER: Final = "master"
NOBODY: Final = "nobody"
"""Whose octets that are no frame are, where nobody was asked; compared with all whole requests."""

PATIENCE: Final = NS_PER_S
"""ns; how long a master waits while that is not known."""

NOISE: Final = 2 * NS_PER_S
"""ns behind a damaged frame in which another one needs no cause of its own: contactors and motors disturb so long."""

LASTS: Final = 3
"""Times the master's patience that a late answer may take."""

_IN_A_ROW = 3  # requests to a station in its own window that open it anew: their answers may be those to earlier ones
_LEAST = 3  # damaged frames in windows of one station, before anything is said
_SHOWN = 2  # of them such that show who spoke, and at least half of all
_CUT = 3  # octets that a collision may swallow
_ELSEWHERE, _SHARE = 5, 10  # frames of a sender elsewhere with which those in windows are compared; one in so many
_SELDOM = 0.002
_SELDOM_OF_ANY = 0.01  # the chance that so much damage stands in the windows of any that is waited for
_OPEN_KEPT = 8  # windows that are open at once
_KEPT = 256  # stations that are waited for, and senders in their windows


@dataclass(slots=True)
class Window:
    """What came while the late answer of one station was due.

    `opened`: how often it was waited for; `waits_struck`: of them those into which something damaged came, not in the
    middle of noise; `struck`, `whole`: frames by sender; `shown`: damaged ones that show that it spoke; `silenced`:
    requests to others that nothing followed; `behind`: damaged requests directly behind the wait; `own`: damaged
    answers of its own, as of one that answers into the repeat of what it was asked; `own_behind`: those of them
    directly behind the wait.
    """

    opened: int = 0
    waits_struck: int = 0
    own: int = 0
    own_behind: Tally = field(default_factory=Tally)
    behind: Tally = field(default_factory=Tally)
    damage: Tally = field(default_factory=Tally)
    struck: Counter[str] = field(default_factory=Counter)
    whole: Counter[str] = field(default_factory=Counter)
    shown: Counter[str] = field(default_factory=Counter)
    silenced: Counter[int] = field(default_factory=Counter)


@dataclass(frozen=True, slots=True)
class Due:
    """The answer that is due, on the line. `address`: its first octets, empty where answers have none; `begin`: all
    that are known, empty where a request may begin so too; `length`: octets, 0 where a request may be as long or nobody
    knows."""

    address: bytes = b""
    begin: bytes = b""
    length: int = 0

    def is_shown_by(self, octets: bytes, is_answer: bool) -> bool:
        """Whether octets that are no good frame show it. `is_answer`: they stand where another station answers."""
        if not self.address or not octets.startswith(self.address):
            return False
        return (
            is_answer or (self.begin != b"" and octets.startswith(self.begin)) or 0 < self.length <= len(octets) + _CUT
        )


@dataclass(slots=True)
class _Open:
    """A window that is open. `in_a_row`: how often it was opened anew. `tells`: whether damage in it says something
    of a station: one wait has one late answer, and noise that was there before it strikes what comes in it, too."""

    until: int
    lasts: int
    due: Due
    tells: bool
    in_a_row: int = 0


class LateSpeakers:
    """Fed what became of requests, in their order; times are ns."""

    def __init__(self) -> None:
        self.windows: dict[int, Window] = {}  # by the station that was waited for
        self.damaged: Counter[str] = Counter()  # everywhere, by sender
        self.overdue = 0  # damaged frames while any answer was
        self.until = 0  # when all windows are closed again
        self._open: dict[int, _Open] = {}
        self._noise_until = 0  # damage where no answer was due makes more of it likely up to then
        self._newest: int | None = None  # who was waited for in vain, while no other request has come

    def unanswered(self, station: int, due: Due, start: int, end: int, patience: int | None) -> None:
        """A whole request that nothing followed. `patience`: the master's, where it is known."""
        for other in self._due(start):
            self._window(other).whole[MASTER] += 1
            if other != station:
                self._window(other).silenced[station] += 1
        lasts = LASTS * (PATIENCE if patience is None else min(patience, PATIENCE))
        self._window(station).opened += 1
        self._newest = station
        self._open.pop(station, None)  # the one that was not waited for the longest is the first to go
        self._open[station] = _Open(end + lasts, lasts, due, start >= self._noise_until)
        if len(self._open) > _OPEN_KEPT:
            del self._open[next(iter(self._open))]
        self.until = max(self.until, end + lasts)

    def answered(self, station: int, sender: str, start: int) -> None:
        """A whole request and a whole answer to it."""
        if start < self.until:
            self._newest = None
        for other in self._due(start):
            window = self._window(other)
            window.whole[MASTER] += 1
            if sender in window.whole or len(window.whole) < _KEPT:
                window.whole[sender] += 1
            if other == station:
                self._go_on(other, start)

    def damaged_request(self, octets: bytes, start: int, *rows: int | None) -> None:
        """A damaged request."""
        self.damaged[MASTER] += 1
        if self._newest is not None and start < self.until:
            self._window(self._newest).behind.add(start, *rows)
            self._newest = None
        due = self._struck_while_due(start)
        for other in due:
            self._strike(other, MASTER, start, rows, self._open[other].due.is_shown_by(octets, is_answer=False))

    def damaged_answer(
        self, station: int, sender: str, octets: bytes, start: int, *rows: int | None, is_longer: bool
    ) -> None:
        """A whole request, and something damaged in answer. `start`: of the request. `is_longer`: it begins as the
        answer that was asked for, and is longer than that can be."""
        self.damaged[sender] += 1
        if start < self.until:
            if self._newest == station:
                self._window(station).own_behind.add(start, *rows)
            self._newest = None
        due = self._struck_while_due(start)
        for other in due:
            self._window(other).whole[MASTER] += 1
            if other != station:
                is_shown = is_longer or self._open[other].due.is_shown_by(octets, is_answer=True)
                self._strike(other, sender, start, rows, is_shown)
            else:
                self._window(other).own += 1
                self._go_on(other, start)

    def noise(self, start: int, *rows: int | None) -> None:
        """Octets that are no frame, where nobody was asked for an answer."""
        self.damaged[NOBODY] += 1
        due = self._struck_while_due(start)
        for other in due:
            self._strike(other, NOBODY, start, rows, is_shown=False)

    @property
    def struck(self) -> int:
        """Damaged frames of all senders."""
        return sum(self.damaged.values())

    def is_due_from_another(self, station: int, start: int) -> bool:
        """Whether the late answer of another station is due."""
        return any(other != station for other in self._due(start))

    def shows(self, octets: bytes, start: int) -> bool:
        """Whether these octets, that are no good frame, are a late answer that is due."""
        return any(self._open[other].due.is_shown_by(octets, is_answer=False) for other in self._due(start))

    def _due(self, start: int) -> list[int]:
        if start >= self.until:
            return []
        return [station for station, one in self._open.items() if start < one.until]

    def _struck_while_due(self, start: int) -> list[int]:
        """Whose late answers are due where something is damaged."""
        due = self._due(start)
        self.overdue += bool(due)
        if not due:
            self._noise_until = start + NOISE
        return due

    def _go_on(self, station: int, start: int) -> None:
        """It was asked in its own window: what came may be its answer to an earlier request."""
        one = self._open[station]
        if one.in_a_row < _IN_A_ROW:
            one.in_a_row += 1
            one.until = start + one.lasts
            self.until = max(self.until, one.until)

    def _strike(self, station: int, sender: str, start: int, rows: tuple[int | None, ...], is_shown: bool) -> None:
        window, one = self._window(station), self._open[station]
        window.damage.add(start, *rows)
        window.waits_struck += one.tells
        one.tells = False
        if sender in window.struck or len(window.struck) < _KEPT:
            window.struck[sender] += 1
            window.shown[sender] += is_shown

    def _window(self, station: int) -> Window:
        if station not in self.windows and len(self.windows) >= _KEPT:
            station = next(iter(self.windows))
        return self.windows.setdefault(station, Window())


@dataclass(frozen=True, slots=True)
class Heard:
    """What is known of a station besides. `answers`, `late`: good answers, and those of them that came late; `missing`:
    requests that nothing followed."""

    answers: int
    late: int
    missing: int


@dataclass(frozen=True, slots=True)
class LateSpeaker:
    """A station that most likely speaks into what others send.

    `struck`, `of`: damaged frames in its windows and all of them; `elsewhere`, `of_elsewhere`: of the same senders
    elsewhere. `hit`: whose damage is most likely its doing; `silenced`: who most likely was not heard for it.
    `is_sure`: not only where the damage stands says so.
    """

    station: int
    window: Window
    struck: int
    of: int
    elsewhere: int
    of_elsewhere: int
    hit: frozenset[str]
    silenced: frozenset[int]
    is_sure: bool

    @property
    def stations_hit(self) -> set[int]:
        """The stations among those that are hit."""
        return {int(sender.split()[1]) for sender in self.hit if sender not in (MASTER, NOBODY)}


def told(one: LateSpeaker) -> str:
    """What is seen of a late speaker, in words."""
    words = f"{counted(one.window.damage.count, 'damaged frame')} while its answer was overdue"
    if one.of_elsewhere and one.struck:  # else those that are hit are heard too seldom to be compared
        words += f": {one.struck} of {one.of} then, of the same senders {one.elsewhere} of {one.of_elsewhere} elsewhere"
    hits = ["requests"] if not one.hit.isdisjoint((MASTER, NOBODY)) else []
    hit = sorted(one.stations_hit)
    hits += [f"answers of station{'s' * (len(hit) > 1)} {', '.join(map(str, hit))}"] if hit else []
    words += f"; hit: {' and '.join(hits)}" if hits else ""
    shown = one.window.shown.total()
    words += f"; {times(shown)} the octets show that two spoke at once" if shown else ""
    return words if one.is_sure else f"{words}; those that are hit were hardly heard elsewhere, to compare"


def reaching(finding: Finding, late: LateSpeakers) -> Finding:
    """What is said of late answers of a station: often enough, it explains what is said of the line at all that were
    heard while they were due."""
    station = finding.about.station
    if station is None or station not in late.windows or finding.count < _LEAST:
        return finding
    beside = {int(sender.split()[1]) for sender in late.windows[station].whole if sender != MASTER}
    return replace(finding, stations=(station, *sorted(beside - {station})))


def late_speakers(late: LateSpeakers, whole: Mapping[str, int], heard: Mapping[int, Heard]) -> Iterator[LateSpeaker]:
    """Who speaks late, the surest first. `whole`: good frames of each sender on the bus, and as nobody's those of the
    master; `heard`: of each station."""
    nobody, windows = Heard(0, 0, 0), late.windows

    def weight(station: int) -> tuple[bool, int, int]:
        window = windows[station]
        return heard.get(station, nobody).late > 0, window.shown.total(), window.damage.count

    innocent: set[int] = set()
    for station in sorted(windows, key=weight, reverse=True):
        window, known = windows[station], heard.get(station, nobody)
        if station in innocent or window.damage.count < _LEAST:
            continue
        found = _judge(station, late, whole, heard)
        if found is not None and (known.answers or known.late or found.is_sure):
            innocent |= found.silenced
            yield found


def is_behind(struck: int, damaged: int, silent: int, requests: int, *, is_late: bool = False) -> bool:
    """Whether so many damaged requests stand directly behind one station's waits in vain as chance does not explain.

    `struck` of all `damaged` requests stand there; `silent` of all `requests` were to it and nothing answered them. Of
    the answers of one station: of its own. `is_late`: it was seen to answer late, so that half of the damage will do.
    """
    most = 2 * struck >= damaged if is_late else 5 * struck >= 4 * damaged
    if not _LEAST <= struck <= damaged or not most or silent >= requests:
        return False
    return at_least(struck, damaged, silent / requests) < _SELDOM


def _judge(
    station: int, late: LateSpeakers, whole: Mapping[str, int], heard: Mapping[int, Heard]
) -> LateSpeaker | None:
    window = late.windows[station]
    struck = of = elsewhere = of_elsewhere = 0
    hit, only_here = set(), set()
    for sender in (window.struck | window.whole).keys() - {f"station {station}"}:
        here = _frames(window, sender)
        others = late.damaged[sender] + whole.get(sender, 0) - here
        damaged_others = late.damaged[sender] - window.struck[sender]
        if others < _ELSEWHERE or _SHARE * others < here:
            only_here.add(sender)
            continue
        is_shown = 2 * window.shown[sender] > window.struck[sender]
        if window.struck[sender] and 4 * damaged_others * here >= window.struck[sender] * others and not is_shown:
            continue  # damaged elsewhere as well: its own doing
        struck, of = struck + window.struck[sender], of + here
        elsewhere, of_elsewhere = elsewhere + damaged_others, of_elsewhere + others
        if window.struck[sender]:
            hit.add(sender)
    chance = at_least(struck, struck + elsewhere, of / (of + of_elsewhere)) if struck else 1.0
    shown = window.shown.total()
    is_shown = shown >= _SHOWN and 2 * shown >= window.damage.count
    is_often = window.waits_struck >= _LEAST
    is_sure = is_shown or (is_often and struck >= _LEAST and _is_seldom(chance, late))
    hit = hit if is_sure else set()
    if is_shown:
        hit |= {sender for sender in only_here if window.struck[sender]}
    elif is_often:
        hit |= _standing_out(window, only_here, late)
    if sum(window.struck[sender] for sender in hit) < _LEAST:
        return None
    silenced = frozenset(
        other for other, count in window.silenced.items() if 4 * count >= 3 * heard.get(other, Heard(0, 0, 1)).missing
    )
    return LateSpeaker(station, window, struck, of, elsewhere, of_elsewhere, frozenset(hit), silenced, is_sure)


def _frames(window: Window, sender: str) -> int:
    return window.struck[sender] + window.whole[MASTER if sender == NOBODY else sender]


def _is_seldom(chance: float, late: LateSpeakers) -> bool:
    """Whether that is no chance, and not of any of those that are waited for either."""
    return chance < _SELDOM and chance * len(late.windows) < _SELDOM_OF_ANY


def _standing_out(window: Window, senders: set[str], late: LateSpeakers) -> set[str]:
    """Those of some senders that are struck in a window far more than all others, since noise strikes all alike; and
    often: who is late once is late as a rule."""
    hit = {sender for sender in senders if window.struck[sender] >= _LEAST}
    struck = sum(window.struck[sender] for sender in hit)
    here = sum(_frames(window, sender) for sender in hit)
    everybody = (window.struck | window.whole).keys()
    all_struck, all_here = window.struck.total(), sum(_frames(window, sender) for sender in everybody)
    if (
        not hit
        or 3 * struck < window.opened
        or here >= all_here
        or 4 * (all_struck - struck) * here > struck * (all_here - here)
    ):
        return set()
    return hit if _is_seldom(at_least(struck, all_struck, here / all_here), late) else set()
