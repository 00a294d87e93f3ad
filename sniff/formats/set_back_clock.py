"""A clock that was set back while a file was written: from there on everything is as much later, and that is said.

A computer that finds the right time steps its clock; what it hears goes on. Times that run backwards would put all that
follows at one moment, with response times of nothing. A single packet that another one overtook changes nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from dissectors.frame import Chunk
from dissectors.line import NS_PER_S
from dissectors.words import duration
from sniff.engine.session import Item, LineEvent, LineEventKind

if TYPE_CHECKING:
    from dissectors.columns import Reads

SET_BACK = NS_PER_S
"""ns; by less than that packets come out of order."""

_FAR = 1 << 62
"""ns, the year 2116: what says so lies, and is passed on as it is."""


def steady(items: Iterable[Item], char: int) -> Iterator[Item]:
    """Items whose times do not run back by SET_BACK or more. `char`: ns that a character takes on the line."""
    clock = _Clock(char)
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


class _Clock:
    """`_latest`: the latest time told, None before the first; `_shift`: ns to add; `_before`: to what that was before
    the clock was set back last, until a second time shows that it was."""

    def __init__(self, char: int) -> None:
        self._char = char
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
        elif self._before is not None and self._latest - SET_BACK < item.time + self._before < time:
            self._shift, time = self._before, item.time + self._before  # a single one was wrong
            self._before = None
        elif time <= self._latest - SET_BACK:
            back, follows = self._latest - time, self._latest + len(item.octets) * self._char
            words = f"the file's clock goes back by {duration(back)}"
            yield LineEvent(self._latest, LineEventKind.CLOCK, words, -back)
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
