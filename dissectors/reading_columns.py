"""Readings of many exchanges at once, where they are numbers and nothing else; the contract of the bulk form of
`readings.Readings`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from dissectors.columns import Codes, FrameColumns, Masks, Names, Numbers, Octets, Times
from dissectors.readings import Origin

HOWS = tuple(Origin)

Bits = npt.NDArray[np.int32] | npt.NDArray[np.uint64]
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ToldValues:
    """What readings say besides their bits, one entry a reading.

    `number`: finite, exact, no negative zero; `whole`: whether it is an int. `part`, `words`: places in `parts` and
    `phrases`; `units`: as long as these, the unit of each that has one instead. `station`: whose thing it is.
    """

    number: Floats
    whole: Masks
    part: Numbers
    words: Numbers
    station: Numbers
    parts: tuple[str, ...] = ("",)
    phrases: tuple[str, ...] = ("",)
    units: tuple[str, ...] = ("",)

    def take(self, which: Masks | Times) -> ToldValues:
        """Some of them."""
        return replace(self, **{one.name: getattr(self, one.name)[which] for one in fields(self)[:-3]})

    def numbers(self) -> Iterator[int | float]:
        """As they are."""
        for number, whole in zip(self.number.tolist(), self.whole.tolist(), strict=True):
            yield int(number) if whole else number


@dataclass(frozen=True, slots=True)
class ReadingColumns:
    """One entry a reading, those of an exchange in their order: what `Readings` gives, sure, with a number as value.

    `done`: bool[k], exchanges of which this is all; of the others nothing is here. `exchange`: 0 … k-1, ascending.
    `space`: places in `spaces`. `how`: places in `HOWS`. `told`: None where each value is its `raw`, without part and
    words, of the station of the transaction.
    """

    done: Masks
    exchange: Times
    space: Codes | Names
    address: Numbers
    raw: Bits
    how: Codes
    spaces: tuple[str, ...] = ("",)
    told: ToldValues | None = None

    @classmethod
    def nothing(cls, done: Masks) -> ReadingColumns:
        """Exchanges that say nothing."""
        none, codes = np.zeros(0, np.int32), np.zeros(0, np.uint8)
        return cls(done, np.zeros(0, np.int64), codes, none, none, codes)

    def without(self, others: Masks) -> ReadingColumns:
        """The same, but of these exchanges nothing is here."""
        kept = ~others[self.exchange]
        columns: dict[str, Any] = {
            name: getattr(self, name)[kept] for name in ("exchange", "space", "address", "raw", "how")
        }
        told = self.told.take(kept) if self.told is not None else None
        return replace(self, done=self.done & ~others, told=told, **columns)


class BulkReadings(Protocol):
    """Good frames in, readings out; total and pure."""

    def __call__(
        self, asked: FrameColumns, answered: FrameColumns, has_answer: Masks, octets: Octets
    ) -> ReadingColumns:
        """`asked`, `answered`: the frames of k exchanges; `answered` counts only where `has_answer`. `octets`: where
        their `offset` counts."""
        ...
