"""Token rings, the same for all protocols: an observer of frames, and the ring as a value, a table and sentences."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from dissectors.frame import Event, Header
from dissectors.line import Timing
from dissectors.row_columns import RowColumns

Cell = str | int | float | None


class RingWindow(Protocol):
    """What was new in a ring in a stretch of rows: numbers of the bus, and of each station."""

    @property
    def bus(self) -> Mapping[str, object]:
        """Numbers of the whole ring, by name."""
        ...

    def of(self, address: int) -> Mapping[str, object]:
        """Numbers of a station; empty where there are none."""
        ...


class RingObserver(Protocol):
    """Watches a ring. Total: any events, any times; memory is bounded."""

    def see(self, no: int, event: Event, header: Header | None) -> None:
        """Take the next row."""
        ...

    def miss(self, time: int) -> None:
        """Octets were lost at this time (ns): what is missing there says nothing."""
        ...

    def ring(self) -> Any:
        """The ring so far, a value of the protocol's own."""
        ...

    def window(self) -> RingWindow:
        """What is new since this was called the last time; the first time is not told of."""
        ...


@runtime_checkable
class WatchesColumns(Protocol):
    """An observer that takes many rows at once."""

    def take(self, rows: RowColumns) -> None:
        """Take rows; the same as one after the other. What they closed is nothing to it."""
        ...

    def windows(self, stops: Sequence[tuple[int, int]]) -> Sequence[RingWindow]:
        """What was new before each of some rows, and not before the one named before it, in this call or an earlier
        one; of what came before the first call nothing need be known.

        `stops`: numbers of rows, ascending, up to the one that comes next, each with the end of all rows before it, ns.
        """
        ...


@runtime_checkable
class WatchesRing(Protocol):
    """A judge of such a protocol: it watches the ring anyhow, and nobody need do it a second time."""

    def ring(self) -> Any:
        """The ring so far, a value of the protocol's own."""
        ...

    def window(self) -> RingWindow:
        """What is new since this was called the last time; the first time is not told of."""
        ...


@dataclass(frozen=True, slots=True)
class StationTable:
    """Stations that do not pass the token, a row each, counted as the protocol's people count them."""

    headings: tuple[str, ...]
    rows: Callable[[Any], list[tuple[Cell, ...]]]


@dataclass(frozen=True, slots=True)
class TokenRing:
    """How a protocol's ring is watched and shown; `ring` is what its observer gives.

    `observer(timing)`: watches a bus.
    `order(ring)`: its masters in the order of the token; empty when no closed ring was seen.
    `headings`, `rows(ring)`: a table, one row a master. `sentences(ring)`: what it comes to. `stations`: of who answers
    only, where the protocol has such. `identities(ring)`: the numbers by which stations called themselves, by address;
    one that called itself by two has both. `shares(ring)`: for how much of the time each master has the token, 0 … 1.
    """

    observer: Callable[[Timing], RingObserver]
    order: Callable[[Any], tuple[int, ...]]
    headings: tuple[str, ...]
    rows: Callable[[Any], list[tuple[Cell, ...]]]
    sentences: Callable[[Any], list[str]]
    stations: StationTable | None = None
    identities: Callable[[Any], Mapping[int, tuple[int, ...]]] = lambda ring: {}
    shares: Callable[[Any], Mapping[int, float]] = lambda ring: {}
