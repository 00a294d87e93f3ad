"""Several captures of one bus as one: the parts of a rotation, or of several days."""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import groupby
from typing import TYPE_CHECKING

from dissectors.line import NS_PER_S
from sniff.engine.capture import Capture, CaptureError
from sniff.engine.session import Item, LineEvent, LineEventKind, Session

if TYPE_CHECKING:
    from sniff.engine.blocks import Block

APART = NS_PER_S
"""Captures between which more time lies, ns, did not hear what was meanwhile: no frame is in both of them then."""


def merged_session(captures: Sequence[Capture], names: Sequence[str]) -> Session:
    """The session of all together: the earliest start, the worst adapter. Raises CaptureError where they differ, and
    where one does not say when anything came: what stands at the same place in two logs is not the same read.
    """
    timeless = [name for capture, name in zip(captures, names, strict=True) if not capture.session.has_times]
    if timeless and len(captures) > 1:
        raise CaptureError(f"{timeless[0]} does not say when anything came; captures are merged by time")
    first = next((capture.session for capture in captures if not capture.session.unknown), captures[0].session)
    for capture, name in zip(captures[1:], names[1:], strict=True):
        other = capture.session
        if not other.unknown and (other.protocol, other.line) != (first.protocol, first.line):
            raise CaptureError(
                f"{name}: {other.protocol} {other.line}, but {names[0]} is {first.protocol} {first.line}; "
                "captures of one bus with the same settings can be merged"
            )
    worst = max((capture.session for capture in captures), key=lambda session: session.adapter.latency)
    return replace(
        first,
        started=min(capture.session.started for capture in captures),
        adapter=worst.adapter,
        said=worst.said,  # with its own reads: those of another would speak for a better one
        reads=worst.reads,
    )


class Merged:
    """Several captures as one."""

    def __init__(self, captures: Sequence[Capture]) -> None:
        self._captures = captures

    def items(self) -> Iterator[Item]:
        """The items of all in order of time."""
        return merged(self._captures)

    def blocks(self) -> Iterator[Block | LineEvent]:
        """The same as columns."""
        from sniff.engine.blocks import blocks_of

        return blocks_of(self.items())


def merged(captures: Sequence[Capture], shared: Callable[[Item], None] | None = None) -> Iterator[Item]:
    """The items of all in order of time; what several captures have, the same at the same time, once.

    Where one ends, and the next begins a while later, nobody listened: an event says so. `shared` is called for each
    item that is left out because another capture has given it.
    """
    listening: set[int] = set()
    last: int | None = None
    in_order = heapq.merge(*(_given(*one, listening) for one in enumerate(captures)), key=lambda found: found[1].time)
    for time, at_once in groupby(in_order, key=lambda found: found[1].time):
        if last is not None and time - last > APART and not listening:
            yield LineEvent(time, LineEventKind.OMITTED, f"{(time - last) / NS_PER_S:.1f} s in none of the captures")
        last = time
        seen: Counter[tuple[int, Item]] = Counter()  # by source
        given: Counter[Item] = Counter()
        for number, item in at_once:
            listening.add(number)
            seen[number, item] += 1
            if seen[number, item] > given[item]:
                given[item] += 1
                yield item
            elif shared is not None:
                shared(item)


def _given(number: int, capture: Capture, listening: set[int]) -> Iterator[tuple[int, Item]]:
    """What a capture gives, beside its number, which is taken out of `listening` at its end."""
    for item in capture.items():
        yield number, item
    listening.discard(number)
