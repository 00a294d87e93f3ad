"""Frames torn by a read that came late: nobody's damage.

A busy computer reads late. The part of a frame that it had read before stands alone, behind it a silence that there
never was, and the rest comes with all that followed. Two things tell: the next frame is known to have been read late
(its slack is more than the adapter's), or the pieces put together, as they were heard, are a good frame again. Either
is told only by a later row, so the damage of the last rows is kept apart until then (`record.Damages`).

What is directly behind a torn frame may be the answer to what was torn: nobody's late or second one, none unasked.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Final

from dissectors.frame import Event, Frame
from dissectors.line import MS, Timing
from dissectors.n2.envelope import judge
from dissectors.n2.record import Damages

if TYPE_CHECKING:
    from dissectors.columns import Times

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
        self._whole_at = -1  # the newest row that made pieces a good frame
        self._begin = 0  # the row of the first piece
        self._begins: deque[int] = deque(maxlen=_KEPT)  # rows where torn frames begin
        self._behind: deque[int] = deque(maxlen=2 * _KEPT)  # rows of last pieces, and those after them
        self._late_row = -1
        self.count = 0

    def is_late(self, event: Event) -> bool:
        """Whether a frame was read later than the adapter explains."""
        return isinstance(event, Frame) and event.slack > self._usual

    def is_torn(self, transaction: int | None, request: int | None) -> bool:
        """Whether a transaction, asked in this row, has a torn frame, or what came after the command was read late."""
        return transaction in self._torn or (request is not None and self._late_row >= request)

    def completes(self, no: int) -> bool:
        """Whether what is in this row makes the pieces before it a good frame."""
        return no == self._whole_at

    def may_answer(self, response: int | None) -> bool:
        """Whether what is in this row may be the answer to a torn command."""
        return response in self._behind

    def is_answered(self, request: int | None) -> bool:
        """Whether a torn frame, which may be the answer, begins directly behind the command in this row."""
        return request is not None and request + 1 in self._begins

    def see(self, no: int, event: Event, tx: int | None, *, is_good_frame: bool) -> None:
        """Take a row before it is judged."""
        octets = event.octets  # as heard: what a piece alone may have been is no part of the whole
        late = self.is_late(event)
        if late:
            self._late_row = no
        if self._pieces and self._is_whole_with(octets):
            self._whole_at = no
            self._take_back(no, tx)
            return
        if self._pieces and late:
            self._take_back(no, tx)
        elif is_good_frame:
            self._settle()
        if not is_good_frame:
            if not self._pieces:
                self._begin = no
            self._pieces.append(octets)
            if tx is not None:
                self._open.append(tx)
            if len(self._pieces) > PIECES:
                self._settle()

    @property
    def is_quiet(self) -> bool:
        """Whether nothing is held that the next row may belong to."""
        return not self._pieces and not self._struck and not self._open

    def pass_by(self, first: int, slack: Times) -> None:
        """Go on behind good frames, in rows from `first` on, while nothing is held."""
        late = (slack > self._usual).nonzero()[0]
        if len(late):
            self._late_row = first + int(late[-1])

    def struck(self, sender: Damages) -> None:
        """Say who was counted for the row, or for those before it; where no piece is held, that is settled."""
        if self._pieces:
            self._struck.append(sender)
        else:
            sender.settle()

    def _is_whole_with(self, octets: bytes) -> bool:
        whole = b"".join((*self._pieces, octets))
        return 0 < len(whole) <= _LONGEST and judge(whole)[1] is None  # with or without a check

    def _take_back(self, no: int, tx: int | None) -> None:
        self.count += 1
        self._begins.append(self._begin)
        self._behind.extend((no, no + 1))
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
