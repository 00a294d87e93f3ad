"""Rows of a table that may tell values of points: passing the right to send on tells none. Pure."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from dissectors.tracker import PASSING
from sniff.engine.engine import Output
from sniff.engine.table import Table


def telling_transactions(table: Table) -> list[int]:
    """Places in the table of the transactions that closed and are more than passing."""
    closed = table.transactions
    passing = [name in PASSING for name in closed.names]
    if not any(passing):
        return list(range(len(closed)))
    telling: list[int] = np.flatnonzero(~np.array(passing)[closed.kind]).tolist()
    return telling


def telling_rows(table: Table, transactions: Collection[int]) -> Output:
    """Those transactions with their rows as objects, and the rows whose transaction has not closed."""
    closed = table.transactions
    which = np.array(list(transactions), np.int64)
    numbers = np.concatenate((closed.request[which], closed.response[which])) - table.first
    tx = table.placed.tx
    wanted = (tx != 0) & ~np.isin(tx, closed.id)
    wanted[numbers[(numbers >= 0) & (numbers < len(table))]] = True
    rows = tuple(map(table.row, np.flatnonzero(wanted & table.is_frame).tolist()))
    return Output(rows, tuple(map(table.transaction, which.tolist())))
