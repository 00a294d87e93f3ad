"""The record of one station, or of the master, while a bus is judged."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable
from dataclasses import dataclass, field

from dissectors.findings import Tally
from dissectors.frame import Flaw
from dissectors.last_silence import LastSilence
from dissectors.n2.misfits import Misfits

_RECALLED = 16  # unanswered commands that a late answer may still answer


@dataclass(slots=True)
class Missing:
    """Commands that no answer followed; one that is answered late is taken back."""

    _settled: Tally = field(default_factory=Tally)
    _recent: OrderedDict[int, tuple[int, int | None]] = field(default_factory=OrderedDict)

    def add(self, transaction: int, time: int, frame: int | None) -> None:
        """Count a command (its transaction, when, its frame)."""
        self._recent[transaction] = (time, frame)
        if len(self._recent) > _RECALLED:
            self._settled.add(*self._recent.popitem(last=False)[1])

    def take_back(self, transaction: int | None) -> None:
        """Its answer came after all."""
        if transaction is not None:
            self._recent.pop(transaction, None)

    @property
    def count(self) -> int:
        """How many."""
        return self._settled.count + len(self._recent)

    def tally(self) -> Tally:
        """All of them."""
        return _with(self._settled, self._recent.values())


@dataclass(slots=True)
class Damages:
    """Damaged frames of one sender beside all that it sent; the newest can be taken back until they are settled."""

    frames: int = 0
    octets: int = 0
    _settled: Tally = field(default_factory=Tally)
    _flaws: dict[Flaw | int, Tally] = field(default_factory=dict)
    _recent: list[tuple[int, int | None, Flaw | int | None]] = field(default_factory=list)

    def add_bad(self, time: int, frame: int | None, flaw: Flaw | int | None = None) -> None:
        """Count one; `flaw`: the one thing that is wrong with it, where that is known; a number: its checksum is too
        large by that."""
        self._recent.append((time, frame, flaw))
        if len(self._recent) > _RECALLED:
            self.settle()

    def settle(self) -> None:
        """The newest ones are damage indeed."""
        for time, frame, flaw in self._recent:
            self._settled.add(time, frame)
            if flaw is not None:
                self._flaws.setdefault(flaw, Tally()).add(time, frame)
        self._recent.clear()

    def forget(self) -> None:
        """The newest ones were none."""
        self._recent.clear()

    @property
    def bad(self) -> Tally:
        """All damaged frames."""
        return _with(self._settled, ((time, frame) for time, frame, _ in self._recent))

    @property
    def flaws(self) -> dict[Flaw | int, Tally]:
        """Those whose one flaw is known, by it."""
        flaws = dict(self._flaws)
        for flaw in {flaw for _, _, flaw in self._recent if flaw is not None}:
            recent = ((time, frame) for time, frame, its in self._recent if its == flaw)
            flaws[flaw] = _with(self._flaws.get(flaw, Tally()), recent)
        return flaws


def _with(settled: Tally, recent: Iterable[tuple[int, int | None]]) -> Tally:
    """A tally and what is not settled yet."""
    both = Tally(settled.count, settled.first, settled.last, list(settled.evidence), dict(settled.quarters))
    for time, frame in recent:
        both.add(time, frame)
    return both


@dataclass(frozen=True, slots=True)
class Override:
    """An override that a station acknowledged: the command's frame, when, and what was commanded."""

    row: int
    time: int
    value: float | None


@dataclass(slots=True)
class N2StationRecord:
    """What is known of one station. `turns`: how often the master turned to it; `quickest`: shortest answer, ns."""

    asked: int = 0
    answered: int = 0
    turns: int = 0
    only_identify: bool = True
    quickest: int | None = None
    identified: bool = False
    waits: bool = False  # it answered N00 and was not identified since
    slowest: int = 0
    refused_while_reset: int = 0
    told_to_reset: int | None = None  # when it obeyed a warm reset last, ns
    sent: Damages = field(default_factory=Damages)
    missing: Missing = field(default_factory=Missing)
    behind: Tally = field(default_factory=Tally)  # damaged commands directly behind one to it that nothing followed
    unheard: Missing = field(default_factory=Missing)  # the same, where the master had an answer
    silence: LastSilence = field(default_factory=LastSilence)  # both, since it was heard last
    resets: Tally = field(default_factory=Tally)
    resets_told: Tally = field(default_factory=Tally)  # those that its master told it to make
    slow: Tally = field(default_factory=Tally)
    again: Tally = field(default_factory=Tally)
    twice: Tally = field(default_factory=Tally)
    beside: dict[int, Tally] = field(default_factory=dict)  # the same, soon behind commands to that station
    repeated: Tally = field(default_factory=Tally)
    late: Tally = field(default_factory=Tally)
    points: dict[tuple[int, int, int | None], Tally] = field(default_factory=dict)
    refused: dict[tuple[str, str], Tally] = field(default_factory=dict)
    misfits: Misfits = field(default_factory=Misfits)
    overrides: dict[tuple[int, int], Override] = field(default_factory=dict)
