"""A capture read in two processes: one reads, frames and pairs, the other judges what comes of it.

Half of a file could only be judged from the state that the first half leaves, so a capture is not cut: tables go from
one process to the other as they come, in their order, and whoever observes them sees what it would have seen. What an
observer can have counted elsewhere (`Lends`) is counted where the tables are made, and comes back as a value.

The second process is a fork, made when enough was read to be worth its while; so it knows all that is known, imports
nothing, and reads on where the first stopped. Where there is no fork, no second core, or a thread beside, everything
stays in one process. The fork ends with the capture, with who made it, or when nobody listens to it any more.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Generator, Iterator, Sequence
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

from dissectors import registry
from sniff.engine.session import LineEvent, Session

if TYPE_CHECKING:
    from sniff.engine.observer import Observer
    from sniff.engine.table import Table

ENOUGH = 1 << 19
"""Octets of a capture after which a second process is made."""


@runtime_checkable
class Lends(Protocol):
    """An observer of which a part may be fed elsewhere."""

    def lend(self) -> Observer:
        """The part, which is a plain value; from now on it is fed by who asked."""
        ...

    def take_back(self, part: Any) -> None:
        """The part as it has become."""
        ...


def divides(session: Session, observers: Sequence[Observer]) -> bool:
    """Whether two processes may read a capture for these observers, and would be faster."""
    if not any(isinstance(one, Lends) for one in observers) or sys.platform != "linux":
        return False
    import threading

    return (
        session.protocol in registry.BUILT_IN
        and threading.current_thread() is threading.main_thread()
        and threading.active_count() == 1
        and len(os.sched_getaffinity(0)) > 1
    )


def divided(
    items: Iterator[Table | LineEvent], observers: Sequence[Observer], capture: object
) -> Generator[Table | LineEvent, None, None]:
    """The same items; when there are many, made by another process. Whoever takes them closes the iterator. Raises
    what `items` raises, when all before it was given."""
    octets = 0
    for item in items:
        octets += 0 if isinstance(item, LineEvent) else len(item.octets)
        if octets >= ENOUGH:
            from sniff.bus.reading_process import from_another  # most captures are not long

            lending = [one for one in observers if isinstance(one, Lends)]
            yield from from_another(item, items, lending, capture)
            return
        yield item
