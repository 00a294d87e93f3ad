"""Stretches between proved silences, and the frames that may stand in them, as columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Self

import numpy as np

from dissectors.columns import OctetTimes, Reads

if TYPE_CHECKING:
    from dissectors.columns import Masks, Times
    from dissectors.line import Timing
    from dissectors.modbus.length_columns import Lengths


@dataclass(frozen=True, slots=True)
class StretchRows:
    """Octets between two proved silences, in order.

    `begin`, `end`: places in the octets of all reads. `first`, `last`: their reads. `proved`: whether silence is proved
    before it (not before the first of a capture); `closed`: behind it (not behind the last). `marked`: with line
    errors.
    """

    begin: Times
    end: Times
    first: Times
    last: Times
    proved: Masks
    closed: Masks
    marked: Masks

    def __len__(self) -> int:
        return len(self.begin)

    @classmethod
    def of(cls, reads: Reads, times: OctetTimes, timing: Timing) -> Self:
        """Those of some reads, cut where even the smallest reading of a silence is long enough."""
        count = len(reads)
        proved = times.gaps() - timing.latency >= timing.t35
        first = np.flatnonzero(proved | (np.arange(count) == 0))
        last = np.append(first[1:], count)[: len(first)] - 1
        closed = np.ones(len(first), bool)
        closed[-1:] = False
        marks = np.append(0, np.cumsum(reads.marked))
        marked = marks[last + 1] != marks[first]
        return cls(times.begins[first], times.begins[last + 1], first, last, proved[first], closed, marked)


@dataclass(frozen=True, slots=True)
class Rows:
    """Stretches of octets of a predicted length, each perhaps a frame.

    `request`, `response`: the directions that predict its length. `other`: the length that the other direction
    predicts, MORE where it is not told yet, NEVER where there is none. `stretch`: where it stands. `whole`: it is all
    of its stretch, and no more need be known of it. `damaged`: its CRC is wrong; else it is good.
    """

    start: Times
    length: Lengths
    request: Masks
    response: Masks
    other: Lengths
    stretch: Times
    whole: Masks
    damaged: Masks

    def __len__(self) -> int:
        return len(self.start)

    @property
    def end(self) -> Times:
        """Place behind the last octet."""
        return self.start + self.length

    def take(self, which: slice | Masks | Times) -> Self:
        """Some of them."""
        return type(self)(*(getattr(self, one.name)[which] for one in fields(self)))

    @classmethod
    def joined(cls, parts: Sequence[Rows]) -> Self:
        """All of them, in the order of the parts."""
        return cls(*(np.concatenate([getattr(part, one.name) for part in parts]) for one in fields(cls)))

    def ordered(self) -> Self:
        """By their place."""
        if len(self) < 2 or (self.start[1:] > self.start[:-1]).all():
            return self
        return self.take(np.argsort(self.start, kind="stable"))
