"""Reads of a log in the order of their times. Pure, bounded.

Threads and programs that write one log hand lines over late: what is out of order by less than SET_BACK and a tick
of its clock is put in order, and a single line that is later still lies where it stands. Where times go back by more,
and stay, the clock was set back; or what stands below is another list of the same time, as of the other direction.
"""

from __future__ import annotations

from bisect import insort
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from dissectors.frame import Chunk
from sniff.engine.session import Item
from sniff.formats.set_back_clock import ROWS_A_STEP, SET_BACK, are_beside, steady, steps_back

MOST = 4096
"""Items that wait for one before them; of more the first is given."""

_FEW_ALIKE = 0.25
"""Share of messages of one list that another one has, too, up to which they are not those of a second run."""


def are_lists(reads: Sequence[Chunk], tick: int) -> bool:
    """Whether these reads are lists of one time that stand one below the other, each of its own messages."""
    times = [read.time for read in reads]
    steps = steps_back(times, SET_BACK + tick)
    if (len(steps) > 1 and ROWS_A_STEP * len(steps) > len(times)) or not are_beside(times, steps):
        return False
    above = {read.octets for read in reads[: steps[0]]}
    below = [read.octets in above for read in reads[steps[0] :]]
    return sum(below) <= _FEW_ALIKE * len(below)


def ordered(items: Iterable[Item], char: int, tick: int) -> Iterator[Item]:
    """Items in order of time. `char`: ns that a character takes on the line; `tick`: ns that the log's clock counts."""
    least = SET_BACK + tick
    waiting: list[Item] = []
    latest = 0
    for item in steady(_alone_in_place(items, least), char, least, "log"):
        latest = max(latest, item.time)
        if not waiting or item.time >= waiting[-1].time:
            waiting.append(item)
        else:
            insort(waiting, item, key=_time_of)
        if waiting[0].time <= latest - least or len(waiting) > MOST:
            given = max(1, next((at for at, one in enumerate(waiting) if one.time > latest - least), len(waiting)))
            yield from waiting[:given]
            del waiting[:given]
    yield from waiting


def _time_of(item: Item) -> int:
    return item.time


def _alone_in_place(items: Iterable[Item], least: int) -> Iterator[Item]:
    """Items; a single one that is `least` ns earlier than what stands above and below it at the time of that above."""
    latest: int | None = None
    late: Chunk | None = None
    for item in items:
        if late is not None and latest is not None:
            is_back = isinstance(item, Chunk) and item.time >= max(latest, late.time + least)
            yield replace(late, time=latest) if is_back else late
            latest, late = latest if is_back else late.time, None
        if isinstance(item, Chunk):
            if latest is not None and item.time <= latest - least:
                late = item
                continue
            latest = item.time if latest is None else max(latest, item.time)
        yield item
    if late is not None:
        yield late
