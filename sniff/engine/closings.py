"""What became of rows, as columns: of each row of a table the transaction that it belongs to, where that has closed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from dissectors.columns import NONE, Numbers, Small, Times

Values = npt.NDArray[Any]


@dataclass(frozen=True, slots=True)
class Closings:
    """One entry a row. `verdict`: place in VERDICTS, -1 where the row has no transaction or it has not closed; the
    others mean nothing there. `latency`: ns, `NONE` for None.
    """

    verdict: Small
    latency: Times
    attempt: Numbers


class ClosingsOf:
    """Puts the closings of a stretch of rows together. `least`, `most`: ids of their transactions."""

    def __init__(self, least: int, most: int) -> None:
        self._least, count = least, most - least + 1
        self._verdict = np.full(count, -1, np.int16)
        self._latency = np.full(count, NONE, np.int64)
        self._attempt = np.zeros(count, np.int32)

    def add(self, ids: Values, verdict: Values, latency: Values, attempt: Values) -> None:
        """Take transactions that closed; those of other rows are passed over."""
        places = ids - self._least
        inside = (places >= 0) & (places < len(self._verdict))
        if not inside.all():
            places, verdict, latency, attempt = places[inside], verdict[inside], latency[inside], attempt[inside]
        self._verdict[places], self._latency[places], self._attempt[places] = verdict, latency, attempt

    def of(self, tx: Times) -> Closings:
        """For rows with these transactions, 0 for none."""
        places = np.where(tx > 0, tx - self._least, 0)
        verdict = self._verdict[places]
        verdict[tx <= 0] = -1
        return Closings(verdict, self._latency[places], self._attempt[places])
