"""The summaries of many short stretches of one table, counted in one pass over its columns. Pure.

A `Summary` for each costs as many looks at the columns as there are stretches, which for stretches of a second is more
than reading the capture. Stations are told apart by stretch and address together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from dissectors.columns import NONE, VERDICTS, counted
from dissectors.histogram import add_grouped
from dissectors.tracker import Verdict
from sniff.analysis.nodes import NodeTable
from sniff.analysis.summary import Summary

if TYPE_CHECKING:
    import numpy.typing as npt

    from dissectors.columns import Times
    from dissectors.line import LineSettings
    from sniff.engine.table import Table

    Column = npt.NDArray[Any]


def summaries(line: LineSettings, table: Table, stops: Sequence[int]) -> list[Summary]:
    """One of each stretch of rows that ends before one of the ascending `stops`, the last of which is the table's end.

    They have what a stretch alone has, but for kinds, damages and the seconds of its load (its total is there).
    """
    made = [Summary(line) for _ in stops]
    of_row = np.repeat(np.arange(len(stops)), np.diff(np.array([0, *stops])))
    closed_by = table.closed_by
    last = np.maximum.accumulate(np.where(closed_by < 0, len(table) - 1, closed_by))
    of_closed = of_row[last] if len(table) else np.full(len(last), len(stops) - 1)
    _add_rows(made, table, of_row)
    _add_transactions(made, table, of_closed)
    _add_nodes(made, table, of_row, of_closed)
    return made


def _add_rows(made: list[Summary], table: Table, of_row: Times) -> None:
    heard, octets = table.heard, table.frames.length
    is_frame = table.is_frame & heard

    def summed(values: Column) -> list[int]:
        whole: list[int] = np.bincount(of_row, values, len(made)).astype(np.int64).tolist()
        return whole  # exact: sums below 2**53

    numbers = zip(
        made,
        summed(octets * ~heard),
        summed(octets * heard),
        summed(octets * (heard & ~table.is_frame)),
        summed(is_frame),
        summed(is_frame & ~table.good),
        strict=True,
    )
    for summary, searched, of_bus, noise, frames, damaged in numbers:
        summary.searched, summary.octets, summary.noise = searched, of_bus, noise
        summary.frames, summary.damaged = frames, damaged
        total = summary.load.total
        total.busy, total.octets, total.frames = of_bus * summary.line.char, of_bus, frames
        total.damaged, total.noise = damaged, noise
    for place, row in table.odd.items():
        if row.searched is None:
            made[of_row[place]].add_marks(row)


def _add_transactions(made: list[Summary], table: Table, of_closed: Times) -> None:
    closed = table.transactions
    for (at, verdict), count in counted(of_closed, closed.verdict):
        made[at].verdicts[VERDICTS[verdict]] += count
    timed = (closed.latency != NONE) & (closed.verdict != VERDICTS.index(Verdict.DATA))
    add_grouped(lambda at: made[at].latency, of_closed[timed], closed.latency[timed])


def _add_nodes(made: list[Summary], table: Table, of_row: Times, of_closed: Times) -> None:
    frames, placed, closed = table.frames, table.placed, table.transactions
    parties = (frames.source, frames.destination, placed.source, placed.destination, closed.station)
    stride = 1 + max(int(one.max(initial=0)) for one in parties)  # counting is by every possible key: few of them

    def apart(addresses: Column, at: Times) -> Any:  # wider than the columns it takes the place of
        return np.where(addresses == NONE, NONE, at * stride + addresses)

    whole = NodeTable()
    whole.add_table(
        replace(
            table,
            frames=replace(frames, source=apart(frames.source, of_row), destination=apart(frames.destination, of_row)),
            placed=replace(placed, source=apart(placed.source, of_row), destination=apart(placed.destination, of_row)),
            transactions=replace(closed, station=apart(closed.station, of_closed)),
        )
    )
    for key, node in whole.nodes.items():
        at, node.address = divmod(key, stride)
        made[at].nodes.nodes[node.address] = node
