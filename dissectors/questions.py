"""The question of a request: which things of a station it asks for, without the values that it carries.

Each protocol takes its own requests apart (`Dissector.questions`); two requests that ask the same are one entry of the
master's programme, whatever they write and whichever number the exchange has.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from dissectors.frame import Frame

if TYPE_CHECKING:
    from dissectors.columns import FrameColumns, Octets, Times


@dataclass(frozen=True, slots=True)
class Span:
    """`count` things of a table of the station from `address` on, as in `Reading`. `writes`: they are written."""

    space: str
    address: int
    count: int = 1
    part: str = ""
    writes: bool = False


@dataclass(frozen=True, slots=True)
class Question:
    """What a request asks. `spans`: empty where it names nothing; `behind`: which station is meant, where that is not
    the one that the frame goes to."""

    spans: tuple[Span, ...] = ()
    behind: str = ""


class Stems(NamedTuple):
    """The octets of requests that say what they ask: those from `begin` to before `end`, but for one at `hole` (a
    place, or -1). Places count in the octets of all reads. Two requests with the same stem ask the same."""

    begin: Times
    end: Times
    hole: Times


@dataclass(frozen=True, slots=True)
class Questions:
    """Of one protocol: what a good request asks, total; and the stems of many, None where they are whole frames."""

    of: Callable[[Frame], Question]
    stems: Callable[[FrameColumns, Octets], Stems] | None = None
