"""Which exchanges are trouble: what lists mark red, and errors are counted of."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from dissectors.columns import NONE, VERDICTS, Times, TransactionColumns
from dissectors.tracker import Passing, Transaction, Verdict
from sniff.bus.kept_tables import KeptTables

BAD_VERDICTS = frozenset(
    {
        Verdict.EXCEPTION,
        Verdict.NO_RESPONSE,
        Verdict.LATE,
        Verdict.ECHO,
        Verdict.UNSOLICITED,
        Verdict.ANSWERED_TWICE,
        Verdict.DAMAGED_ANSWER,
        Verdict.DAMAGED_REQUEST,
    }
)
_BAD = np.array([verdict in BAD_VERDICTS for verdict in VERDICTS], bool)
_NO_RESPONSE = VERDICTS.index(Verdict.NO_RESPONSE)
_LOOKING = (Passing.POLL, Passing.STATUS)
_NONE: Times = np.zeros(0, np.int64)

_Places = npt.NDArray[np.integer[Any]]


def is_trouble(transaction: Transaction) -> bool:
    """Whether it went wrong. A master that looks for another one where there is none is no trouble."""
    in_vain = transaction.kind in _LOOKING and transaction.verdict is Verdict.NO_RESPONSE
    return transaction.verdict in BAD_VERDICTS and not in_vain


def rows_in_trouble(closed: TransactionColumns) -> tuple[Times, Times]:
    """Of transactions that went wrong, the number of a row, and when they began, ns."""
    bad = _in_trouble(closed.verdict, closed.kind, closed.names)
    if not bad.any():
        return _NONE, _NONE
    numbers = np.where(closed.request[bad] != NONE, closed.request[bad], closed.response[bad])
    return numbers[numbers != NONE], closed.start[bad][numbers != NONE]


def closings_in_trouble(kept: KeptTables, no: int, step: int) -> Iterator[int]:
    """Numbers of the closings that went wrong: those after `no`, or with -1 those before it; the nearest first."""
    at = max(no + 1, kept.first_closed) if step > 0 else min(no - 1, kept.last_closed)
    while (part := kept.part_of_closing(at)) is not None:
        bad = _in_trouble(part.closed_column("verdict"), part.closed_column("kind"), part.closed_names)
        numbers = np.flatnonzero(bad) + part.closed_first
        if step > 0:
            yield from numbers[numbers >= at].tolist()
            at = part.closed_first + part.closed
        else:
            yield from numbers[(numbers <= at) & (numbers >= kept.first_closed)][::-1].tolist()
            at = part.closed_first - 1


def _in_trouble(verdict: _Places, kind: _Places, names: Sequence[str]) -> npt.NDArray[np.bool_]:
    """Which transactions with these verdicts and kinds went wrong.

    Masters look all day for a station to pass the token to where there is none.
    """
    bad: npt.NDArray[np.bool_] = _BAD[verdict]
    kinds = [at for at, name in enumerate(names) if name in _LOOKING]
    if kinds:
        bad &= (verdict != _NO_RESPONSE) | ~np.isin(kind, kinds)
    return bad
