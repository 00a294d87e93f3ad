"""A clock that was set back while a file was written: from there on everything is as much later, and that is said.

A computer that finds the right time steps its clock; what it hears goes on. Times that run backwards would put all that
follows at one moment, with response times of nothing. A single packet that another one overtook changes nothing.
Rows of a table are sorted, since programs write them by direction, too; where the clock was set back, that would weave
what came after into what came before.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise, starmap
from typing import TYPE_CHECKING

from dissectors.frame import Chunk
from dissectors.line import NS_PER_S
from dissectors.words import duration
from sniff.engine.session import Item, LineEvent, LineEventKind

if TYPE_CHECKING:
    from dissectors.columns import Reads

SET_BACK = NS_PER_S
"""ns; by less than that packets come out of order."""

ROWS_A_STEP = 20
"""Rows for each time that a table's clock is set back; where times go back more often, rows are in another order."""

_NEAR = 10
"""Part of a stretch by which another one may begin or end beside it."""

_FAR = 1 << 62
"""ns, the year 2116: what says so lies, and is passed on as it is."""


def steady(items: Iterable[Item], char: int, least: int = SET_BACK, whose: str = "file") -> Iterator[Item]:
    """Items whose times do not run back by `least` ns or more. `char`: ns that a character takes on the line; `whose`:
    what the clock is called."""
    clock = _Clock(char, least, whose)
    for item in items:
        yield from clock.tell(item)


def steady_pieces(pieces: Iterable[Item | Reads], char: int) -> Iterator[Item | Reads]:
    """The same of items and columns between them; where the clock is set back, columns become items."""
    clock = _Clock(char)
    for piece in pieces:
        if isinstance(piece, Chunk | LineEvent):
            yield from clock.tell(piece)
        elif (told := clock.tell_all(piece)) is not None:
            yield told
        else:
            from sniff.engine.blocks import Block

            for chunk in Block(piece).chunks():
                yield from clock.tell(chunk)


def in_order(rows: Sequence[Chunk], char: int, order: Callable[[Chunk], int]) -> Iterator[Item]:
    """The rows of a table in `order` of a time, ns, from where its clock was set back on as much later. `char`: ns that
    a character takes on the line.
    """
    begins = _set_back([row.time for row in rows])
    shift = latest = 0
    for begin, end in zip((0, *begins), (*begins, len(rows)), strict=True):
        if begin:
            follows = latest + len(rows[begin].octets) * char
            back, shift = latest - rows[begin].time - shift, follows - rows[begin].time
            yield _step(latest, back, "file")
        stretch = sorted(rows[begin:end], key=order)
        latest = max((row.time + shift for row in stretch), default=latest)
        yield from (replace(row, time=row.time + shift) for row in stretch) if shift else stretch


def _set_back(times: Sequence[int]) -> list[int]:
    """Which rows are the first by a clock that was set back; none where the order of rows is another one."""
    found = steps_back(times)
    return [] if ROWS_A_STEP * len(found) > len(times) or are_beside(times, found) else found


def steps_back(times: Sequence[int], least: int = SET_BACK) -> list[int]:
    """Which of these times are `least` ns before the one before, and stay so."""
    found = []
    for at in range(1, len(times)):
        before, time = times[at - 1], times[at]
        is_alone = at + 1 < len(times) and times[at + 1] >= max(before, time + least)  # written late
        if time <= before - least and not is_alone:
            found.append(at)
    return found


def are_beside(times: Sequence[int], steps: Sequence[int]) -> bool:
    """Whether two stretches between these steps, one after the other, are of the same time: lists that stand one below
    the other."""
    if not steps:
        return False
    stretches = [(times[begin], times[end - 1]) for begin, end in pairwise((0, *steps, len(times)))]
    return any(starmap(_are_beside, pairwise(stretches)))


def _are_beside(one: tuple[int, int], other: tuple[int, int]) -> bool:
    """The same of two stretches, first and last time of each."""
    (begin, end), (begin_of_other, end_of_other) = one, other
    near = (end - begin) // _NEAR
    return abs(begin_of_other - begin) <= near or abs(end_of_other - end) <= near


def _step(time: int, back: int, whose: str) -> LineEvent:
    return LineEvent(time, LineEventKind.CLOCK, f"the {whose}'s clock goes back by {duration(back)}", -back)


class _Clock:
    """`_latest`: the latest time told, None before the first; `_shift`: ns to add; `_before`: to what that was before
    the clock was set back last, until a second time shows that it was."""

    def __init__(self, char: int, least: int = SET_BACK, whose: str = "file") -> None:
        self._char, self._least, self._whose = char, least, whose
        self._latest: int | None = None
        self._shift = 0
        self._before: int | None = None

    def tell(self, item: Item) -> Iterator[Item]:
        """The item at its time, behind what is to be said of the clock."""
        time = item.time + self._shift
        if max(abs(item.time), abs(time)) >= _FAR:
            yield item
            return
        if isinstance(item, LineEvent) or not item.octets or self._latest is None:
            pass
        elif self._before is not None and self._latest - self._least < item.time + self._before < time:
            self._shift, time = self._before, item.time + self._before  # a single one was wrong
            self._before = None
        elif time <= self._latest - self._least:
            back, follows = self._latest - time, self._latest + len(item.octets) * self._char
            yield _step(self._latest, back, self._whose)
            self._before, self._shift = self._shift, self._shift + follows - time
            time = follows
        if isinstance(item, Chunk) and item.octets:
            self._latest = time if self._latest is None else max(self._latest, time)
        yield item if time == item.time else replace(item, time=time)

    def tell_all(self, reads: Reads) -> Reads | None:
        """Reads at their times; None where they must be looked at one by one."""
        import numpy as np

        if self._before is not None or not len(reads):
            return None
        if abs(self._shift) >= _FAR or reads.times.max() >= _FAR or reads.times.min() <= -_FAR:
            return None
        times = reads.times + self._shift
        if times.max() >= _FAR or times.min() <= -_FAR:
            return None
        latest = np.maximum.accumulate(times if self._latest is None else np.append(self._latest, times[:-1]))
        if (times <= latest - SET_BACK).any():
            return None
        self._latest = max(int(times.max()), self._latest if self._latest is not None else int(times[0]))
        return replace(reads, times=times) if self._shift else reads
