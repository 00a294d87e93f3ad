"""Which numbers there are in a column, and where each row's stands among them."""

from __future__ import annotations

import numpy as np

from dissectors.columns import Times
from sniff.cli.byte_columns import Codes


def distinct_codes(codes: Times) -> tuple[Times, Codes]:
    """Which numbers, 0 or more, there are, and the place of each row's among them."""
    if not len(codes):
        return np.zeros(1, np.int64), codes
    most = int(codes.max())
    if most > 1 << 20:
        distinct, inverse = np.unique(codes, return_inverse=True)
        return distinct, inverse
    used = np.zeros(most + 1, bool)
    used[codes] = True
    return np.flatnonzero(used), (np.cumsum(used) - 1)[codes]
