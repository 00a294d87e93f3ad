"""Which exchanges are trouble: what lists mark red, and errors are counted of."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dissectors.columns import NONE, VERDICTS, Times, TransactionColumns
from dissectors.tracker import Passing, Transaction, Verdict

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
_LOOKING = (Passing.POLL, Passing.STATUS)
_NONE: Times = np.zeros(0, np.int64)


def is_trouble(transaction: Transaction) -> bool:
    """Whether it went wrong. A master that looks for another one where there is none is no trouble."""
    in_vain = transaction.kind in _LOOKING and transaction.verdict is Verdict.NO_RESPONSE
    return transaction.verdict in BAD_VERDICTS and not in_vain


def rows_in_trouble(closed: TransactionColumns) -> tuple[Times, Times]:
    """Of transactions that went wrong, the number of a row, and when they began, ns."""
    bad = _BAD[closed.verdict] & ~_looked_in_vain(closed)
    if not bad.any():
        return _NONE, _NONE
    numbers = np.where(closed.request[bad] != NONE, closed.request[bad], closed.response[bad])
    return numbers[numbers != NONE], closed.start[bad][numbers != NONE]


def _looked_in_vain(closed: TransactionColumns) -> npt.NDArray[np.bool_]:
    """Which looked for a station to pass the token to where there is none: masters do that all day."""
    kinds = [at for at, name in enumerate(closed.names) if name in _LOOKING]
    nobody: npt.NDArray[np.bool_] = closed.verdict == VERDICTS.index(Verdict.NO_RESPONSE)
    return nobody & np.isin(closed.kind, kinds) if kinds else np.zeros(len(closed), bool)
