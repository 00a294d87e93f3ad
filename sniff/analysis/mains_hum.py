"""Hum: disturbances in step with the mains, told once about the bus where its own rhythm is not. Pure, bounded."""

from __future__ import annotations

import cmath
import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dissectors.findings import Finding, Tally
from dissectors.line import MS, NS_PER_S
from dissectors.words import milliseconds
from sniff.analysis.line_rules import LINE_RULES

if TYPE_CHECKING:
    from dissectors.columns import Times

MAINS = {20 * MS: "50 Hz", 10 * MS: "twice 50 Hz", 50 * MS // 3: "60 Hz", 25 * MS // 3: "twice 60 Hz"}
"""Periods, ns: once a wave, and twice (each half wave, as of a dimmer)."""

LEAST = 15
LOCKED = 0.7
OWN = 0.35
STRUCK_LEAST = 5
"""So many disturbances of known senders' frames tell whether they strike whoever sends."""

SPAN = 2 * NS_PER_S  # over longer the mains drift
SAME = 4 * MS  # what follows sooner is the same disturbance


@dataclass(slots=True)
class _Lock:
    """How well moments keep in step with one period: sums of unit vectors, of trouble and of all else."""

    trouble: complex = 0j
    others: complex = 0j


class MainsHum:
    """Fed the moments of disturbances, and of good frames between them, ns, in order."""

    def __init__(self, latency: int) -> None:
        """`latency`: of the adapter, ns."""
        self._latency = latency
        self._locks = {period: _Lock() for period in MAINS}
        self._trouble_at: int | None = None
        self._steps = self._other_steps = 0
        self._tally = Tally()
        self._struck: Counter[str] = Counter()  # senders of what is disturbed
        self._apart: Counter[int] = Counter()  # ms from disturbance to disturbance

    def see_trouble(self, moment: int, no: int, sender: str) -> None:
        """Something was disturbed then; what follows at once is the same disturbance."""
        before = self._trouble_at
        if before is not None and before <= moment <= before + SPAN:
            if moment - before <= SAME:
                return
            for period, lock in self._locks.items():
                lock.trouble += _unit(moment - before, period)
            self._steps += 1
            self._apart[(moment - before) // MS] += 1
        self._trouble_at = moment
        self._tally.add(moment, no)
        self._struck[sender] += 1

    def see_good(self, moment: int) -> None:
        """A good frame ended then."""
        before = self._trouble_at
        if before is None or not SAME < moment - before <= SPAN:
            return
        for period, lock in self._locks.items():
            lock.others += _unit(moment - before, period)
        self._other_steps += 1

    def see_many_good(self, moments: Times) -> None:
        """The same of one or more, ascending."""
        import numpy as np

        before = self._trouble_at
        if before is None or int(moments[0]) - before > SPAN < int(moments[-1]) - before:
            return
        since = moments - before
        since = since[(since > SAME) & (since <= SPAN)]
        self._other_steps += len(since)
        for period, lock in self._locks.items():
            lock.others += complex(np.exp(2j * math.pi * ((since % period) / period)).sum())

    def findings(self) -> Iterator[Finding]:
        """That it hums, if it does."""
        if self._steps < LEAST:
            return
        if 3 * max(self._apart.values()) > self._steps or self._is_of_one_sender():
            return  # one rhythm of the bus, or one sender's
        for period, words in MAINS.items():
            if 6 * self._latency > period:
                continue
            lock = self._locks[period]
            locked = abs(lock.trouble) / self._steps
            own = abs(lock.others) / self._other_steps if self._other_steps else 0.0
            chance = math.exp(-self._steps * locked * locked)  # Rayleigh
            angle = cmath.phase(lock.trouble) * period / (2 * math.pi)
            if locked < LOCKED or own > OWN or chance > 1e-6 or abs(angle) > 0.15 * period:
                continue
            seen = (
                f"{self._steps + 1} disturbances come in step with {words}: {locked:.0%} locked to "
                f"{milliseconds(period)}, what is undisturbed {own:.0%}"
            )
            yield self._tally.found(LINE_RULES["LN301"], "bus", seen)
            return

    def _is_of_one_sender(self) -> bool:
        """Whether nearly all that is disturbed is one sender's, or that of somebody who is not known.

        Where frames of several known ones are struck, the rest needs no sender: hum in silence is beside nobody.
        """
        known = Counter({name: count for name, count in self._struck.items() if name != "bus"})
        if known.total() >= STRUCK_LEAST and 10 * max(known.values()) <= 9 * known.total():
            return False
        return 10 * max(self._struck.values()) > 9 * self._struck.total()


def _unit(time: int, period: int) -> complex:
    """Where in the period a time (ns) falls, as a vector of length 1."""
    return cmath.exp(2j * math.pi * (time % period) / period)
