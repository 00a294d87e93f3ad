"""Frames torn by a read that came late: nobody's damage.

A busy computer reads late. The part of a frame that it had read before stands alone, behind it a silence that there
never was, and the rest comes with all that followed. Two things tell: the next frame is known to have been read late
(its slack is more than the adapter's), or the pieces put together are a good frame again. Either is told only by a
later row, so the damage of the last rows is kept apart until then (`record.Damages`).
"""

from __future__ import annotations

from collections import deque
from typing import Final

from dissectors.frame import Event, Frame
from dissectors.line import MS, Timing
from dissectors.n2.envelope import is_good
from dissectors.n2.header import meant
from dissectors.n2.record import Damages

PIECES: Final = 8
"""Most rows that one torn frame is."""

_LONGEST = 256  # octets of a frame
_KEPT = 32


class TornFrames:
    """Fed every row; takes back the damage that a late read made."""

    def __init__(self, timing: Timing) -> None:
        self._usual = timing.latency + MS
        self._pieces: list[bytes] = []  # rows since the last good frame
        self._struck: list[Damages] = []  # who was counted for them
        self._open: list[int] = []  # their transactions
        self._torn: deque[int] = deque(maxlen=_KEPT)  # transactions with torn frames
        self._late_row = -1
        self.count = 0

    def is_late(self, event: Event) -> bool:
        """Whether a frame was read later than the adapter explains."""
        return isinstance(event, Frame) and event.slack > self._usual

    def is_torn(self, transaction: int | None, request: int | None) -> bool:
        """Whether a transaction, asked in this row, has a torn frame, or what came after the command was read late."""
        return transaction in self._torn or (request is not None and self._late_row >= request)

    def see(self, no: int, event: Event, tx: int | None, *, is_good_frame: bool) -> None:
        """Take a row before it is judged."""
        octets = meant(event) if isinstance(event, Frame) else event.octets
        late = self.is_late(event)
        if late:
            self._late_row = no
        if self._pieces and (late or self._is_whole_with(octets)):
            self._take_back(tx)
        elif is_good_frame:
            self._settle()
        if not is_good_frame:
            self._pieces.append(octets)
            if tx is not None:
                self._open.append(tx)
            if len(self._pieces) > PIECES:
                self._settle()

    def struck(self, sender: Damages) -> None:
        """Say who was counted for the row."""
        self._struck.append(sender)

    def _is_whole_with(self, octets: bytes) -> bool:
        whole = b"".join((*self._pieces, octets))
        return len(whole) <= _LONGEST and is_good(whole)

    def _take_back(self, tx: int | None) -> None:
        self.count += 1
        self._torn.extend(self._open)
        if tx is not None:
            self._torn.append(tx)
        for sender in self._struck:
            sender.forget()
        self._clear()

    def _settle(self) -> None:
        for sender in self._struck:
            sender.settle()
        self._clear()

    def _clear(self) -> None:
        self._pieces, self._struck, self._open = [], [], []
