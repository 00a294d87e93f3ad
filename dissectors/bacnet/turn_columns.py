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


def teach(
    turn: Turn,
    token: Masks,
    poll_reply: Masks,
    source: Times,
    destination: Times,
    kinds: Times | Small | Numbers,
    frame: Frame,
) -> None:
    """Who spoke to whom in some rows; the last four say whose turn it is. `frame`: the last."""
    if len(source) > _FEW:
        passed = np.flatnonzero(token | poll_reply)
        by_token = token[passed]
        sender, receiver = source[passed], destination[passed]
        holder, following = np.where(by_token, sender, receiver), np.where(by_token, receiver, sender)
        heard = source
        if len(source) > _MANY:
            last = np.full(256, NONE, np.int64)
            last[holder] = following
            holder = np.flatnonzero(last != NONE)
            following, heard = last[holder], np.flatnonzero(np.bincount(heard))
        turn.learn(dict(zip(holder.tolist(), following.tolist(), strict=True)), heard.tolist())
    parties = source[-_FEW:].tolist(), destination[-_FEW:].tolist()
    for kind, sent_by, sent_to in zip(kinds[-_FEW:].tolist(), *parties, strict=True):
        turn.see(frame, kind, sent_by, sent_to)
