"""Columns of text that stand beside one another as one, where few different texts come of it: less to copy a line."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sniff.cli.byte_columns import Chosen, Column
from sniff.cli.distinct import distinct_codes

_MOST = 1024
"""Texts of a column up to which it is put together with its neighbours."""


def merged(columns: Sequence[Column]) -> list[Column]:
    """The same columns of the same rows, fewer of them."""
    out: list[Column] = []
    for column in columns:
        both = _both(out[-1], column) if out else None
        if both is None:
            out.append(column)
        else:
            out[-1] = both
    return out


def _both(left: Column, right: Column) -> Column | None:
    """Both as one; None where that would be too many texts."""
    if isinstance(left, bytes) and isinstance(right, bytes):
        return left + right
    if isinstance(left, Chosen) and isinstance(right, Chosen):
        return _combined(left, right)
    if isinstance(left, bytes) and isinstance(right, Chosen) and len(right.texts) <= _MOST:
        return Chosen.of([left + text for text in _texts(right)], right.codes)
    if isinstance(left, Chosen) and isinstance(right, bytes) and len(left.texts) <= _MOST:
        return Chosen.of([text + right for text in _texts(left)], left.codes)
    return None


def _combined(left: Chosen, right: Chosen) -> Chosen | None:
    if max(len(left.texts), len(right.texts)) > _MOST or not len(left.codes):
        return None
    if len(right.texts) == 1:
        (only,) = _texts(right)
        return Chosen.of([text + only for text in _texts(left)], left.codes)
    count = len(right.texts)
    distinct, codes = distinct_codes(left.codes.astype(np.int64) * count + right.codes)
    if len(distinct) > _MOST:
        return None
    before, behind = _texts(left), _texts(right)
    return Chosen.of([before[one // count] + behind[one % count] for one in distinct.tolist()], codes)


def _texts(column: Chosen) -> list[bytes]:
    return [row.tobytes().translate(None, b"\0") for row in column.texts]
