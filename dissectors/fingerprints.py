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
    return np.random.default_rng(485).integers(1 << 64, size=LONGEST + 1, dtype=np.uint64)


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
