"""Stray octets that may be the begin of a frame: the next frame tells. Pure.

A busy computer reads late. The begin of a frame that it had read before stands alone in a silence that there never was,
and is no frame; the rest comes with all that followed. They count as stray octets at once, since a frame need never
come, and are taken back where the next one was read late.
"""

from __future__ import annotations

from copy import copy
from typing import Final

from dissectors.findings import Tally
from dissectors.frame import Noise
from sniff.analysis.sender_findings import Senders

_KEPT: Final = 8
"""Rows that the begin of one frame may be."""


class UnsureStrays:
    """Counts stray octets away from frames and after them, and takes the newest back."""

    def __init__(self) -> None:
        self._newest: list[tuple[str, str, Noise, Tally | None]] = []  # and what was counted before

    def add(self, senders: Senders, name: str, code: str, no: int, noise: Noise) -> None:
        """Count the octets of a row at a sender, by a rule."""
        tally = senders.of(name).stray.get(code)
        before = None if tally is None else Tally(tally.count, tally.first, tally.last, copy(tally.evidence))
        senders.stray(name, code, no, noise)
        self._newest.append((name, code, noise, before))
        del self._newest[:-_KEPT]

    def forget(self) -> None:
        """A frame came in time: strays they were."""
        self._newest.clear()

    def take_back(self, senders: Senders) -> None:
        """A frame came that was read late: they may have been its begin."""
        for name, code, noise, before in reversed(self._newest):
            senders.put_back(name, code, noise, before)
        self._newest.clear()
