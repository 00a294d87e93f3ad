"""Columns of the exchanges of a store: when they began, of which station, how they ended and how long the answers
took, so that a picture of any stretch of a million of them is counted in some milliseconds.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from dissectors.columns import NONE, VERDICTS
from dissectors.line import NS_PER_S
from dissectors.tracker import PASSING, Verdict
from sniff.bus.rows import Store
from sniff.bus.trouble import BAD_VERDICTS

Values = npt.NDArray[Any]

_BAD = np.array([verdict in BAD_VERDICTS for verdict in VERDICTS], bool)
_TO_ALL = VERDICTS.index(Verdict.BROADCAST)
_STEPS = 16
"""Classes of times in each doubling: a percentile is right to 5 %."""
_CLASSES = 512
_NO_TIME = _CLASSES
_US = 1000.0


class Exchanges:
    """What is asked and answered; tokens, polls for masters and what is said to all are none of it.

    Take what closed with `bring_up`.
    """

    def __init__(self) -> None:
        self._seen = 0  # closings
        self._pieces: list[tuple[Values, ...]] = []
        self._whole: tuple[Values, ...] | None = None

    def bring_up(self, store: Store, last: int) -> None:
        """Take the closings that came since, up to number `last`."""
        kept = store.kept
        first = max(self._seen + 1, kept.first_closed)
        if first > last:
            return
        for part in kept.parts:
            if part.closed and part.closed_first + part.closed > first and part.closed_first <= last:
                self._take(part, slice(max(0, first - part.closed_first), last + 1 - part.closed_first))
        self._seen = last
        self._whole = None

    def _take(self, part: Any, which: slice) -> None:
        station = part.closed_column("station")[which]
        kind = part.closed_column("kind")[which]
        passing = np.array([name in PASSING for name in part.closed_names] or [False], bool)
        verdict = part.closed_column("verdict")[which]
        wanted = (station != NONE) & ~passing[kind] & (verdict != _TO_ALL)
        verdict = verdict[wanted]
        latency = part.closed_column("latency")[which][wanted]
        timed = (latency != NONE) & (verdict != VERDICTS.index(Verdict.DATA))
        classes = np.clip(np.log2(np.maximum(latency, 0) / _US + 1) * _STEPS, 0, _CLASSES - 1).astype(np.int16)
        self._pieces.append(
            (
                (part.closed_column("start")[which][wanted] // NS_PER_S).astype(np.int64),
                station[wanted].astype(np.int16),
                np.where(timed, classes, _NO_TIME).astype(np.int16),
                _BAD[verdict],
            )
        )

    @property
    def _columns(self) -> tuple[Values, ...]:
        if self._whole is None:
            if not self._pieces:
                empty = np.zeros(0, np.int64)
                return empty, empty, empty, empty.astype(bool)
            self._whole = tuple(np.concatenate(one) for one in zip(*self._pieces, strict=True))
            self._pieces = [self._whole]
        return self._whole

    def _places(self, begin: int, width: int, zoom: int) -> tuple[Values, Values]:
        """Which began in `width` columns of `zoom` seconds from second `begin` on, and in which of them each."""
        seconds = self._columns[0]
        inside = (seconds >= begin) & (seconds < begin + width * zoom)
        return inside, (seconds[inside] - begin) // zoom

    def latencies(self, begin: int, width: int, zoom: int, shares: tuple[float, ...]) -> list[list[float | None]]:
        """For each share, the percentile of the answers in each column, ms; None where nothing was answered."""
        inside, places = self._places(begin, width, zoom)
        classes = self._columns[2][inside]
        timed = classes != _NO_TIME
        spots = places[timed] * _CLASSES + classes[timed]
        counts = np.bincount(spots, minlength=width * _CLASSES).reshape(width, _CLASSES)
        running, total = np.cumsum(counts, axis=1), counts.sum(axis=1)
        found: list[list[float | None]] = []
        for share in shares:
            wanted = np.maximum(1, np.ceil(total * share))
            at = np.argmax(running >= wanted[:, None], axis=1)
            times = (2.0 ** ((at + 0.5) / _STEPS) - 1) * _US / 1e6
            found.append([float(time) if some else None for time, some in zip(times, total > 0, strict=True)])
        return found

    def stations(self, begin: int, width: int, zoom: int) -> dict[int, tuple[list[int], list[int]]]:
        """For each station that was asked there: how many exchanges began in each column, and how many went wrong."""
        inside, places = self._places(begin, width, zoom)
        station, bad = self._columns[1][inside], self._columns[3][inside]
        made = {}
        for address in np.unique(station).tolist():
            its = station == address
            asked = np.bincount(places[its], minlength=width).tolist()
            failed = np.bincount(places[its & bad], minlength=width).tolist()
            made[address] = asked, failed
        return made
