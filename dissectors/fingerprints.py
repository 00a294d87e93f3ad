"""Fingerprints of frames: which of many hold the same octets, without an object for each."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    from dissectors.columns import Octets, Times

LONGEST = 1 << 12
"""Octets of a frame at most."""


@cache
def _weights() -> npt.NDArray[np.uint64]:
    """Numbers without a pattern, by splitmix64; numpy's own generators with hashlib and secrets take long to import."""
    mixed: npt.NDArray[np.uint64] = np.arange(1, LONGEST + 2, dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        mixed = (mixed ^ (mixed >> np.uint64(shift))) * np.uint64(factor)
    return mixed ^ (mixed >> np.uint64(31))


def gathered(octets: Octets, begins: Times, lengths: Times) -> tuple[Octets, Times]:
    """The octets of frames behind one another, and where each begins. `lengths`: 1 or more."""
    edges: Times = np.cumsum(lengths) - lengths
    held: Octets = octets[np.arange(int(lengths.sum())) + np.repeat(begins - edges, lengths)]
    return held, edges


def fingerprints(octets: Octets, edges: Times, lengths: Times) -> npt.NDArray[np.uint64]:
    """64 bits for each frame, as `gathered` laid them; those of two different ones agree by a chance of 1 in 2**64.

    `lengths`: 1 … LONGEST.
    """
    weights = _weights()
    inside = np.arange(len(octets)) - np.repeat(edges, lengths)
    sums = np.add.reduceat((octets.astype(np.uint64) + np.uint64(1)) * weights[inside], edges)
    whole: npt.NDArray[np.uint64] = sums + weights[-1] * lengths.astype(np.uint64)
    return whole
