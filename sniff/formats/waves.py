"""Logic waves, which every file of a logic analyser comes to: channels with a level that changes at times. Pure.

A reader of such files gives a `WaveFile`; what its channels say is found by `logic_capture.py`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from sniff.engine.session import Completeness

if TYPE_CHECKING:
    from dissectors.columns import Times

MOST_CHANNELS = 64


@dataclass(frozen=True, slots=True)
class Edges:
    """What changed in a stretch of time that ends at `until`, ns: for each channel the times of its edges, ascending,
    none at or before the stretch before. A channel changes its level with each edge.
    """

    until: int
    channels: Sequence[Times]


class WaveFile(Protocol):
    """A file with the levels of channels over time.

    `kind`: in words; `channels`: their names; `levels`: 0 or 1 before the first edge; `started`: ns since the epoch,
    0 when nobody knows; `resolution`: in words, "" when the file does not say.
    """

    path: Path
    kind: str
    channels: list[str]
    levels: list[int]
    started: int
    resolution: str

    def stretches(self) -> Iterator[Edges]:
        """All edges from the begin, a bounded number at a time. Raises CaptureError for what cannot go on."""
        ...

    def completeness(self) -> Completeness:
        """Whether the file is whole, as far as `stretches` has read."""
        ...
