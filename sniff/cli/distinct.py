"""The distinct numbers in a column, and where each row's stands among them."""

from __future__ import annotations

import numpy as np

from dissectors.columns import Times
from sniff.cli.byte_columns import Codes


def distinct_codes(codes: Times) -> tuple[Times, Codes]:
    """Which numbers, 0 or more, there are, and the place of each row's among them."""
    if not len(codes):
        return np.zeros(1, np.int64), codes
    most = int(codes.max())
    if most > _DENSE:
        order = np.argsort(codes, kind="stable")
        ascending = codes[order]
        first = np.ones(len(codes), bool)
        first[1:] = ascending[1:] != ascending[:-1]
        inverse = np.empty(len(codes), np.int64)
        inverse[order] = np.cumsum(first) - 1
        return ascending[first], inverse
    used = np.zeros(most + 1, bool)
    used[codes] = True
    return np.flatnonzero(used), (np.cumsum(used) - 1)[codes]


_DENSE = 1 << 20
"""Numbers up to this are not sorted. (`np.unique` is no way: its first call imports all of `numpy.ma`.)"""
