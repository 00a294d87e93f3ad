"""Rows of an MS/TP bus as `MstpRingObserver` sees them, where all goes its way: tokens, polls, requests, answers.

Who has the token behind such a row is told by the row and the one before it alone: whoever was sent a token, or an
answer; else the sender. A row is *clean* where nothing happens in it that the observer tells of. What is left out:

    damaged frames, noise, rows of which columns do not say all, and the row behind each of them; whoever is not next
    to speak; answers that come late or never; tests, Reply Postponed, I-Am; silences in which a token may be lost;
    forbidden addresses and lengths; broadcasts as dense as a storm
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dissectors.bacnet.frame_types import HEADER, PROPRIETARY, FrameType
from dissectors.bacnet.limits import BROADCAST, MAX_DATA, MAX_MASTER, T_NO_TOKEN, T_REPLY_DELAY, T_USAGE_DELAY
from dissectors.bacnet.ring_questions import T_GO_ON
from dissectors.bacnet.searches import T_STOPPED
from dissectors.bacnet.storms import STORM_BROADCASTS, STORM_WITHIN
from dissectors.bacnet.turn_columns import TaughtTurns
from dissectors.columns import ROLES
from dissectors.frame import Role

if TYPE_CHECKING:
    from collections.abc import Iterable

    from dissectors.columns import Masks, Times
    from dissectors.line import Timing
    from dissectors.row_columns import RowColumns

_REQUEST = ROLES.index(Role.REQUEST)
_CRC = 2
_TOKEN, _POLL, _POLL_REPLY = map(int, (FrameType.TOKEN, FrameType.POLL_FOR_MASTER, FrameType.REPLY_TO_POLL_FOR_MASTER))
_EXPECTING = (int(FrameType.DATA_EXPECTING_REPLY), int(FrameType.EXTENDED_DATA_EXPECTING_REPLY))
_NOT_EXPECTING = (int(FrameType.DATA_NOT_EXPECTING_REPLY), int(FrameType.EXTENDED_DATA_NOT_EXPECTING_REPLY))


class RingColumns:
    """Columns of some rows, one entry each.

    `start`, `end`, `slack`, `length`, `kind` (frame type), `source`, `destination`: as in the rows. `token`, `poll`,
    `poll_reply`, `data`: what it is. `asks`: the next frame answers it. `answers`: it answers the frame before.
    `series`: of a poll, the row where polls of its sender began to follow one another; of another row, itself.
    `after`: who has the token behind it, or was sent it. `gap`: ns since the row before. `clean`: see above; the first
    two never are. `turns`: what they teach of who speaks to whom.
    """

    def __init__(self, rows: RowColumns, timing: Timing, least_gap: int, broadcasts: Iterable[int]) -> None:
        """`least_gap`: ns; what is closer came in one read. `broadcasts`: when the newest before were sent."""
        frames, self.rows = rows.frames, rows
        self.start, self.end, self.length = frames.start, frames.end, frames.length.astype(np.int64)
        self.slack = np.where(rows.is_frame, rows.slack, timing.latency)
        self.kind, self.source, self.destination = (
            one.astype(np.int64) for one in (frames.function, frames.source, frames.destination)
        )
        self._plain = rows.good & (self.kind >= 0) & (self.source >= 0) & (self.destination >= 0)
        for place in rows.odd:
            self._plain[place] = False
        self.token, self.poll = self.kind == _TOKEN, self.kind == _POLL
        self.poll_reply = self.kind == _POLL_REPLY
        self.turns = TaughtTurns(self.token, self.poll_reply, self.source, self.destination, self.kind)
        self._expecting = np.isin(self.kind, _EXPECTING)
        self.data = self._expecting | np.isin(self.kind, _NOT_EXPECTING) | (self.kind >= PROPRIETARY)
        self.to_all = self.data & (self.destination == BROADCAST)
        self.asked = self._expecting & ~self.to_all & (frames.role == _REQUEST)
        self.asks = self.poll | self.asked
        back = np.zeros(len(rows), bool)
        back[1:] = (self.source[1:] == self.destination[:-1]) & (self.destination[1:] == self.source[:-1])
        self._back = back
        self.answers = back & (_before(self.poll) & self.poll_reply | _before(self.asked) & self.data)
        self.after = np.where(self.token | self.answers, self.destination, self.source)
        self.series = _series(self.poll, self.source)
        self.gap = np.zeros(len(rows), np.int64)
        self.gap[1:] = self.start[1:] - self.end[:-1]
        self._least_gap = least_gap
        self.clean = self._is_clean(broadcasts)
        self.unclean = np.flatnonzero(~self.clean)

    def __len__(self) -> int:
        return len(self.start)

    def end_of_run(self, begin: int) -> int:
        """The first row from `begin` on that is not clean, or how many there are."""
        at = int(np.searchsorted(self.unclean, begin))
        return int(self.unclean[at]) if at < len(self.unclean) else len(self)

    def alone_since(self, place: int) -> int | None:
        """Of the row behind `place`: the earliest that `place` may have begun; None where it came with others."""
        if int(self.gap[place]) < self._least_gap:
            return None
        return int(self.end[place - 1]) - int(self.slack[place - 1])

    # What is clean

    def _is_clean(self, broadcasts: Iterable[int]) -> Masks:
        known = self._plain & (self.token | self.poll | self.poll_reply | self.data)
        clean: Masks = known & _before(known) & self._is_next() & self._is_allowed() & self._is_in_time()
        clean &= ~self._are_dense(broadcasts)
        clean[:2] = False
        return clean

    def _is_next(self) -> Masks:
        """Whether it is the turn of whoever sends, and what was asked is answered."""
        next_to_speak = np.zeros(len(self), bool)
        next_to_speak[1:] = self.source[1:] == self.after[:-1]
        taken: Masks = self.answers | next_to_speak & ~self.poll_reply & ~_before(self.asked)
        return taken & ~(self._expecting & self._back & _before(self.asks))

    def _is_allowed(self) -> Masks:
        """Whether nothing is told of it by itself."""
        frames = self.rows.frames
        masters = (self.source <= MAX_MASTER) & (self.destination <= MAX_MASTER)
        allowed: Masks = (self.source != BROADCAST) & (self.source != self.destination)
        allowed &= masters | (self.kind > _POLL)
        allowed &= (self.length <= HEADER + MAX_DATA + _CRC) & ~(self._expecting & ~self.asked)
        if "i-am" in frames.names:
            allowed &= frames.kind != frames.names.index("i-am")
        return allowed

    def _is_in_time(self) -> Masks:
        """Whether it came neither so early nor so late that this says something."""
        surely = self.gap - self.slack
        limit = np.full(len(self), T_NO_TOKEN, np.int64)
        limit[_before(self.token) | self.poll_reply] = T_USAGE_DELAY
        limit[self.answers & self.data] = T_REPLY_DELAY
        in_time: Masks = (self.gap >= 0) & (surely <= limit)
        slack_before = np.zeros(len(self), np.int64)
        slack_before[1:] = self.slack[:-1]
        in_time &= self.gap + slack_before < T_NO_TOKEN
        gone_on = _before(self.poll) & ~self.answers
        in_time[1:] &= ~(gone_on & self.token)[1:] | (
            self.destination[1:] != self.destination[:-1]
        )  # it heard the answer
        soonest = np.zeros(len(self), np.int64)  # since a poll came alone, as `Questions` reckons
        soonest[2:] = self.start[2:] - self.end[:-2] + self.slack[:-2] - (self.end[1:-1] - self.start[1:-1])
        in_time &= ~(gone_on & ((surely > T_GO_ON) | (soonest < T_USAGE_DELAY // 2)))
        taken = self.token[1:] & (self.destination[1:] == self.source[:-1])
        in_time[1:] &= ~self.poll_reply[:-1] | taken
        began = self.series[:-1]  # before a table, or so long ago that it may say something
        in_time[1:] &= (
            ~_before(self.poll)[1:] | self.poll[1:] | ((began > 0) & (self.start[1:] - self.start[began] < T_STOPPED))
        )
        return in_time

    def _are_dense(self, broadcasts: Iterable[int]) -> Masks:
        """Broadcasts that may be the last of as many as make a storm."""
        places = np.flatnonzero(self.to_all)
        times = np.concatenate([np.array(list(broadcasts), np.int64), self.end[places]])
        dense: Masks = np.zeros(len(self), bool)
        many = STORM_BROADCASTS - 1
        if len(places) and len(times) > many:
            within = np.zeros(len(times), bool)
            within[many:] = times[many:] - times[:-many] <= STORM_WITHIN
            dense[places[within[len(times) - len(places) :]]] = True
        return dense


def _series(poll: Masks, source: Times) -> Times:
    first = np.ones(len(poll), bool)
    first[1:] = ~(poll[1:] & poll[:-1] & (source[1:] == source[:-1]))
    begun: Times = np.maximum.accumulate(np.where(first, np.arange(len(poll)), 0))
    return begun


def _before(mask: Masks) -> Masks:
    """The same of the row before; False for the first."""
    before: Masks = np.zeros(len(mask), bool)
    before[1:] = mask[:-1]
    return before
