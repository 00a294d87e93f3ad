"""The rows of a table of octets (CSV) as reads, in order of time: what its layout (`octet_table.py`) says of each."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from heapq import merge
from itertools import zip_longest
from pathlib import Path

from dissectors.frame import Chunk
from sniff.engine.capture import CaptureError
from sniff.engine.session import Item, LineEvent
from sniff.formats.log_calendar import carried_on, turn
from sniff.formats.log_counts import Counts, Order
from sniff.formats.log_margin import plain_signs
from sniff.formats.octet_table import TableLayout
from sniff.formats.set_back_clock import in_order
from sniff.formats.timeless import LINE_END

MOST_ROWS = 5_000_000
"""Of a table, which is held in memory whole to be sorted: 140 octets of it a row."""

_RULED = re.compile(r"[\s+|:=-]*")
"""What stands between the rows of a table that is drawn."""


def reads_of_table(
    path: Path, lines: Iterable[str], at: int, table: TableLayout, char: int, counts: Counts
) -> Iterator[Item]:
    """The reads of a table. `lines`: from its heading on, which is line `at` of the file, from 0; `char`: ns that a
    character takes on the line. Raises CaptureError for more rows than are held."""
    found, order = _rows(path, lines, at, table, char, counts)
    if order.is_newest_first:
        found.reverse()
    turns: list[Item] = []
    if table.daily or table.local:
        times = carried_on([chunk.time for chunk in found], table.daily, table.local)
        for at, (time, turned) in enumerate(times):
            turns += [turn(found[at - 1].time, turned)] if turned else []
            found[at] = found[at] if found[at].time == time else replace(found[at], time=time)
    first = min((chunk.time - len(chunk.octets) * char for chunk in found), default=0)
    if first < 0:  # counted from a trigger: no time is before 1970
        found = [replace(chunk, time=chunk.time - first) for chunk in found]

    def begin(chunk: Chunk) -> int:
        return chunk.time - len(chunk.octets) * char

    has_begin = table.exact and table.duration is None
    items = list(in_order(found, char, begin if has_begin else lambda chunk: chunk.time))
    read = [item for item in items if isinstance(item, Chunk)]  # two lines of a bus, one after another
    turns += [item for item in items if isinstance(item, LineEvent)]
    yield from merge(_one_after_another(read, begin) if has_begin else read, turns, key=lambda item: item.time)


def _rows(
    path: Path, lines: Iterable[str], at: int, table: TableLayout, char: int, counts: Counts
) -> tuple[list[Chunk], Order]:
    """The reads in the order of the file, and which way their times go."""
    rows = csv.reader(map(plain_signs, lines), delimiter=table.delimiter)
    next(rows, None)
    found: list[Chunk] = []
    order = Order()
    for row in each_row(rows):
        if row is None:
            counts.pass_over(at + rows.line_num)
            continue
        if not any(row):
            continue
        if len(found) >= MOST_ROWS:
            raise CaptureError(f"{path}: a table of over {MOST_ROWS} rows; cut it into pieces")
        if not table.holds(row) or all(_RULED.fullmatch(cell) for cell in row):
            counts.text += 1
            continue
        if found and (more := table.more(row)):
            found[-1] = replace(found[-1], octets=found[-1].octets + more)
            counts.data += 1
            continue
        try:
            told = list(table.chunks(row, char))
            order.add(told[0].time - len(told[0].octets) * char * table.exact)
            found += told
            counts.data += 1
        except ValueError:
            counts.pass_over(at + rows.line_num)
    return found, order


def _one_after_another(read: list[Chunk], begin: Callable[[Chunk], int]) -> Iterator[Chunk]:
    """Reads in the order of their begin, which is told; nobody knows how fast the line was: one of several octets ends
    before the next begins, and after what began with it."""
    last = 0
    for chunk, after in zip_longest(read, map(begin, read[1:])):
        time = chunk.time
        if len(chunk.octets) > 1:
            if after is not None and after > begin(chunk):
                time = min(time, max(after - LINE_END, (begin(chunk) + after) // 2))
            if begin(chunk) < last:
                time = last + LINE_END + chunk.time - begin(chunk)
        last = max(last, time)
        yield chunk if last == chunk.time else replace(chunk, time=last)


def each_row(rows: Iterator[list[str]]) -> Iterator[list[str] | None]:
    """The rows of a table; None for one that is none: a field that never ends, a zero octet."""
    while True:
        try:
            yield next(rows)
        except csv.Error:
            yield None
        except StopIteration:
            return
