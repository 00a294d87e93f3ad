"""On which side of two taps the fault is, told from who is hit at which tap and who is spared.

What is damaged at one tap only was whole when it passed the other. Does that befall some senders and spare others, the
spared ones stand on the far side: the tap reads well, so the way towards it is at fault. Does it befall everybody, the
tap itself or all before it may be: only a sender that is known to stand on the tap's own side tells the two apart.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from sniff.taps.frames import TapFrames
from sniff.taps.matching import Crossing, CrossingOutcome, Matched

LEAST = 3
"""Frames that must be hit before anything is said."""

SHARE = 0.004
"""Of a sender's frames; less happens to everybody."""

CHANCE = 0.001
"""Who is hit as rarely as by this chance, were he hit as the others are, is spared."""

KNOWN = 20
"""Frames of a sender before his delay tells where he stands."""

DEAD = 0.95
"""Share of frames that do not arrive from which on the way is dead."""

ALIKE = 0.8
"""Share of damaged frames that are damaged in the same way."""


_ANY = 1 << 62
"""ns; no delay tells a side."""


class FaultPlace(Enum):
    """Where the fault is."""

    BETWEEN = "between the taps"
    TAP = "at the tap itself"
    EITHER = "between the taps or at the tap"


class SegmentFaultKind(Enum):
    """What it does to frames."""

    DEAD = "nothing passes"
    LOST = "frames are lost"
    BEGIN = "the first octets are missing"
    END = "the last octets are missing"
    BITS = "octets are damaged"
    CHANGED = "octets are changed, with a good check"


class TapSide(Enum):
    """On which side of the taps somebody stands, told by where his frames come first."""

    FIRST = 0
    SECOND = 1
    UNKNOWN = 2


@dataclass(slots=True)
class Traffic:
    """Frames of one sender. `damaged`, `missing`, `changed`: at each tap, while the other heard them as they were sent.

    `delays`: ns from the first tap to the second, of those heard well at both.
    """

    both: int = 0
    damaged: list[int] = field(default_factory=lambda: [0, 0])
    missing: list[int] = field(default_factory=lambda: [0, 0])
    changed: list[int] = field(default_factory=lambda: [0, 0])
    delays: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    damages: list[list[SegmentFaultKind]] = field(default_factory=lambda: [[], []])

    @property
    def heard(self) -> int:
        """Frames that one tap at least heard well."""
        return self.both + sum(self.damaged) + sum(self.missing) + sum(self.changed)

    def hit(self, tap: int) -> int:
        """Frames that were not well at a tap."""
        return self.damaged[tap] + self.missing[tap] + self.changed[tap]

    def share(self, tap: int) -> float:
        """The same of all, 0 … 1."""
        return self.hit(tap) / self.heard if self.heard else 0.0

    def side(self, doubt: int) -> TapSide:
        """Where he stands, when his frames are later at one tap than the adapters' `doubt` (ns) explains."""
        if not len(self.delays):
            return TapSide.UNKNOWN
        usual = int(np.median(self.delays))
        if abs(usual) <= doubt:
            return TapSide.UNKNOWN
        return TapSide.FIRST if usual > 0 else TapSide.SECOND


@dataclass(frozen=True, slots=True)
class SegmentFault:
    """One fault. `tap`: 0 or 1, where frames are not well; the way towards it is meant. `senders`: who is hit;
    `spared`: who is not. `hit` of `heard` frames."""

    place: FaultPlace
    tap: int
    kind: SegmentFaultKind
    senders: tuple[int, ...]
    spared: tuple[int, ...]
    hit: int
    heard: int


def traffic(first: TapFrames, second: TapFrames, matching: Matched) -> dict[int, Traffic]:
    """What every sender's frames went through; senders ascending, `NONE` first."""
    found: dict[int, Traffic] = {}
    senders = first.sender[matching.first]
    delays = second.end[matching.second] - first.end[matching.first]
    for sender in np.unique(senders).tolist():
        own = senders == sender
        found[sender] = Traffic(both=int(own.sum()), delays=delays[own])
    for crossing in matching.others:
        _count(found, first, second, crossing)
    return dict(sorted(found.items()))


def _count(found: dict[int, Traffic], first: TapFrames, second: TapFrames, crossing: Crossing) -> None:
    heard_at = second if crossing.good_at else first
    place = crossing.second if crossing.good_at else crossing.first
    assert place is not None
    one = found.setdefault(int(heard_at.sender[place]), Traffic())
    hurt_at = 1 - crossing.good_at
    if crossing.outcome is CrossingOutcome.MISSING:
        one.missing[hurt_at] += 1
    elif crossing.outcome is CrossingOutcome.CHANGED:
        one.changed[hurt_at] += 1
    else:
        one.damaged[hurt_at] += 1
        other = first if crossing.good_at else second
        hurt = crossing.first if crossing.good_at else crossing.second
        assert hurt is not None
        one.damages[hurt_at].append(damage(heard_at.octets_at(place), other.octets_at(hurt)))


def damage(sent: bytes, came: bytes) -> SegmentFaultKind:
    """How a frame was damaged. `sent`: as the other tap heard it."""
    if 0 < len(came) < len(sent):
        if sent.endswith(came):
            return SegmentFaultKind.BEGIN
        if sent.startswith(came):
            return SegmentFaultKind.END
    return SegmentFaultKind.BITS


def faults(senders: Mapping[int, Traffic], doubt: int, is_one_clock: bool = True) -> list[SegmentFault]:
    """What can be said: nothing where not one frame was heard at both. `doubt`: ns by which both adapters together may
    misplace a frame. `is_one_clock`: whether both taps are known to be on one; of two that differ everybody seems to
    stand on one side."""
    if not any(one.both for one in senders.values()):
        return []
    if not is_one_clock and len({one.side(doubt) for one in senders.values()} - {TapSide.UNKNOWN}) < 2:
        doubt = _ANY
    return [fault for tap in (1, 0) if (fault := _fault(senders, tap, doubt)) is not None]


def _fault(senders: Mapping[int, Traffic], tap: int, doubt: int) -> SegmentFault | None:
    hit = {name: one for name, one in senders.items() if one.hit(tap) >= LEAST and one.share(tap) >= SHARE}
    if not hit:
        return None
    count, heard = sum(one.hit(tap) for one in hit.values()), sum(one.heard for one in hit.values())
    spared = _spared({name: one for name, one in senders.items() if name not in hit}, tap, count / heard)
    place = _place(hit, spared, tap, doubt)
    return SegmentFault(place, tap, _kind(hit.values(), tap), tuple(hit), spared, count, heard)


def _spared(others: Mapping[int, Traffic], tap: int, share: float) -> tuple[int, ...]:
    """Those of the others whom the fault spares: each for himself, else all together, else nobody."""
    alone = [name for name, one in others.items() if _is_rare(one.hit(tap), share * one.heard)]
    if alone:
        return tuple(alone)
    whole = {name: one for name, one in others.items() if not one.hit(tap)}
    together = share * sum(one.heard for one in whole.values())
    return tuple(whole) if _is_rare(0, together) else ()


def _is_rare(count: int, expected: float) -> bool:
    """Whether so few of so many expected would be chance (Poisson's sum up to `count`)."""
    if not expected:
        return False
    each = math.log(expected)  # of thousands, not even the first term is a number
    return sum(math.exp(at * each - expected - math.lgamma(at + 1)) for at in range(count + 1)) < CHANCE


def _place(hit: Mapping[int, Traffic], spared: tuple[int, ...], tap: int, doubt: int) -> FaultPlace:
    own_side = TapSide(tap)
    if any(one.side(doubt) is own_side and one.heard >= KNOWN for one in hit.values()):
        return FaultPlace.TAP  # what reaches the other tap whole passed this one before
    return FaultPlace.BETWEEN if spared else FaultPlace.EITHER


def _kind(hit: Iterable[Traffic], tap: int) -> SegmentFaultKind:
    hit = list(hit)
    heard = sum(one.heard for one in hit)
    missing, changed = sum(one.missing[tap] for one in hit), sum(one.changed[tap] for one in hit)
    damages = [kind for one in hit for kind in one.damages[tap]]
    if missing >= DEAD * heard:
        return SegmentFaultKind.DEAD
    if changed > missing + len(damages):
        return SegmentFaultKind.CHANGED
    for kind in (SegmentFaultKind.BEGIN, SegmentFaultKind.END):
        if damages and damages.count(kind) >= ALIKE * len(damages) and len(damages) >= missing:
            return kind
    return SegmentFaultKind.LOST if missing > len(damages) else SegmentFaultKind.BITS
