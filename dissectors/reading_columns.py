"""Readings of many exchanges at once, where they are whole registers and nothing else; the contract of the bulk form
of `readings.Readings`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from dissectors.columns import Codes, FrameColumns, Masks, Numbers, Octets, Times
from dissectors.readings import Origin

HOWS = tuple(Origin)


@dataclass(frozen=True, slots=True)
class ReadingColumns:
    """One entry a reading, those of an exchange in their order: what `Readings` gives with `raw` as its value, sure,
    without part and without a station of its own.

    `done`: bool[k], exchanges of which this is all; of the others nothing is here. `exchange`: 0 … k-1, ascending.
    `space`: places in `spaces`. `how`: places in `HOWS`.
    """

    done: Masks
    exchange: Times
    space: Codes
    address: Numbers
    raw: Numbers
    how: Codes
    spaces: tuple[str, ...] = ("",)

    @classmethod
    def nothing(cls, done: Masks) -> ReadingColumns:
        """Exchanges that say nothing."""
        none, codes = np.zeros(0, np.int32), np.zeros(0, np.uint8)
        return cls(done, np.zeros(0, np.int64), codes, none, none, codes)


class BulkReadings(Protocol):
    """Good frames in, readings out; total and pure."""

    def __call__(
        self, asked: FrameColumns, answered: FrameColumns, has_answer: Masks, octets: Octets
    ) -> ReadingColumns:
        """`asked`, `answered`: the frames of k exchanges; `answered` counts only where `has_answer`. `octets`: where
        their `offset` counts."""
        ...
