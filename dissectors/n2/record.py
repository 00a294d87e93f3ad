"""What is kept of one station, or of the master, while a bus is judged."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field

from dissectors.findings import Tally
from dissectors.frame import Flaw

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
        settled = self._settled
        both = Tally(settled.count, settled.first, settled.last, list(settled.evidence))
        for time, frame in self._recent.values():
            both.add(time, frame)
        return both


@dataclass(slots=True)
class Damages:
    """Damaged frames of one sender beside all that it sent."""

    frames: int = 0
    octets: int = 0
    bad: Tally = field(default_factory=Tally)
    flaws: dict[Flaw, Tally] = field(default_factory=dict)

    def add_bad(self, time: int, frame: int | None, flaw: Flaw | None = None) -> None:
        """Count one; `flaw`: the one thing that is wrong with it, where that is known."""
        self.bad.add(time, frame)
        if flaw is not None:
            self.flaws.setdefault(flaw, Tally()).add(time, frame)


@dataclass(frozen=True, slots=True)
class Override:
    """An override that a station acknowledged: the command's frame, when, and what was commanded."""

    row: int
    time: int
    value: float | None


@dataclass(slots=True)
class Station:
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
    sent: Damages = field(default_factory=Damages)
    missing: Missing = field(default_factory=Missing)
    resets: Tally = field(default_factory=Tally)
    slow: Tally = field(default_factory=Tally)
    again: Tally = field(default_factory=Tally)
    twice: Tally = field(default_factory=Tally)
    repeated: Tally = field(default_factory=Tally)
    late: Tally = field(default_factory=Tally)
    points: dict[tuple[int, int, int | None], Tally] = field(default_factory=dict)
    refused: dict[tuple[str, str], Tally] = field(default_factory=dict)
    overrides: dict[tuple[int, int], Override] = field(default_factory=dict)
