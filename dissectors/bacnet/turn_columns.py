"""The turn to speak behind many good frames that follow one another in order."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dissectors.columns import NONE

if TYPE_CHECKING:
    from dissectors.bacnet.turn import Turn
    from dissectors.columns import Masks, Numbers, Small, Times
    from dissectors.frame import Frame

_FEW = 4
"""Rows after which it is certain whose turn it is, whatever was before."""
_MANY = 1000


class TaughtTurns:
    """What rows teach of who speaks to whom. `token`, `poll_reply`: which they are; `source`, `destination`: 0 … 255
    where they are anything."""

    def __init__(
        self, token: Masks, poll_reply: Masks, source: Times, destination: Times, kinds: Times | Small | Numbers
    ) -> None:
        self._kinds = kinds
        self._source, self._destination = source.astype(np.uint8), destination.astype(np.uint8)
        self._passed = passed = np.flatnonzero(token | poll_reply)
        by_token, sender, receiver = token[passed], self._source[passed], self._destination[passed]
        self._holder, self._following = np.where(by_token, sender, receiver), np.where(by_token, receiver, sender)

    def teach(self, turn: Turn, begin: int, end: int, frame: Frame) -> None:
        """Good rows [begin, end); the last four say whose turn it is. `frame`: the last."""
        if end - begin > _FEW:
            first, beyond = self._passed.searchsorted((begin, end)).tolist()
            holder, following, heard = (
                self._holder[first:beyond],
                self._following[first:beyond],
                self._source[begin:end],
            )
            if end - begin > _MANY:
                last = np.full(256, NONE, np.int64)
                last[holder] = following
                holder = np.flatnonzero(last != NONE).astype(np.uint8)
                following, heard = last[holder].astype(np.uint8), np.flatnonzero(np.bincount(heard)).astype(np.uint8)
            turn.learn(dict(zip(holder.tobytes(), following.tobytes(), strict=True)), heard.tobytes())
        few = slice(max(begin, end - _FEW), end)
        parties = self._source[few].tolist(), self._destination[few].tolist()
        for kind, sent_by, sent_to in zip(self._kinds[few].tolist(), *parties, strict=True):
            turn.see(frame, kind, sent_by, sent_to)
