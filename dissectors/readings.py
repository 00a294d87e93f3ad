"""Readings: what an exchange says of the things inside a station, before anybody knows which device that is.

Each protocol takes its own exchanges apart (`Dissector.readings`); profiles give the readings names
and units. A reading is what was on the wire, no more.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum

from dissectors.frame import Frame


class Origin(Enum):
    """How a value came over the line."""

    READ = "read"  # a station answered a question
    WRITE = "write"  # a master gave it to a station
    REPORT = "report"  # a station told it by itself (change of state)


@dataclass(frozen=True, slots=True)
class Reading:
    """One thing that an exchange told.

    `station`: whose thing it is; None when that is the station of the transaction. `space`: which table of the station
    ("holding", "AI", "analog-input"); points of "holding", "input", "coil" and "discrete" are numbered as Modbus'
    tables are, from 40001, 30001, 00001 and 10001, so that a table of another protocol needs another name. `address`:
    the place in it, as on the wire; `part`: the attribute or property, empty for the value itself. `raw`: the bits as
    they were on the wire, unsigned; None for text. `sure`: False where no public source confirms the layout. `words`:
    the value in the protocol's own words, where it has some; `beside`: what came with it, as names and texts; `unit`:
    the one that the protocol itself fixes for the number.
    """

    space: str
    address: int
    raw: int | None
    value: int | float | str
    how: Origin
    part: str = ""
    sure: bool = True
    station: int | None = None
    words: str = field(default="", compare=False)
    beside: tuple[tuple[str, str], ...] = field(default=(), compare=False)
    unit: str = field(default="", compare=False)


Readings = Callable[[Frame | None, Frame | None], tuple[Reading, ...]]
"""(request, response) → readings; total. Without the response: what the request itself tells (a write, a report);
with it, what is confirmed: nothing after an exception."""

Asks = Callable[[Frame], tuple[Reading, ...]]
"""frame → the places that it speaks of without a value (`Dissector.asks`); total. Their `words` are what is asked of
them, empty where they are to be read."""

Refusal = Callable[[Frame], tuple[str, int] | None]
"""frame → the family of its codes ("modbus", "n2") and the code, when it refuses a request (`Dissector.refusal`)."""

PlaceName = Callable[[Reading, str, int], str]
"""(reading, number, offset) → its place in words: `Register 2524h (wire 0x2524)`. `number`: the manual's, empty without
a profile; `offset`: the wire's number less the manual's (`Dissector.place`)."""


def plain_place(reading: Reading, number: str, offset: int) -> str:
    """The place of what has a kind and a number: `AI 3`, `analog-value 1 units`."""
    return f"{reading.space} {reading.address} {reading.part.replace('.', ' ')}".rstrip()
