"""The bulk form of the PROFIBUS tracker, as the engine asks for it (`dissectors.columns.Pairing`).

Regular is what a row and the one behind it decide, with a tracker at rest before it:

    a token, SDN, broadcast            stands for itself
    a request, its answer in time      answered, or refused
    a request, no answer behind it     over with the next row

All else goes through the tracker: answers that nobody waits for, late ones, and requests that may be repeats.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from dissectors.columns import (
    NONE,
    ROLES,
    VERDICTS,
    FrameColumns,
    Masks,
    Octets,
    PlacementColumns,
    Run,
    Times,
    TransactionColumns,
)
from dissectors.frame import Frame, Role
from dissectors.profibus.control import FCV
from dissectors.profibus.telegram import SD2
from dissectors.profibus.tracker import PATIENCE, Past, ProfibusTracker
from dissectors.tracker import Verdict

if TYPE_CHECKING:
    from dissectors.line import Timing
    from dissectors.tracker import Tracker

PROTOCOL: Final = "profibus"

HORIZON: Final = 1 << 15
"""Rows looked at in one go: a run that goes on is taken up again."""

_REQUEST, _POLL, _RESPONSE, _TO_ALL, _TOKEN = (
    np.uint8(ROLES.index(role)) for role in (Role.REQUEST, Role.POLL, Role.RESPONSE, Role.BROADCAST, Role.TOKEN)
)
_ANSWERED, _EXCEPTION, _NO_RESPONSE, _DATA, _BROADCAST = (
    np.uint8(VERDICTS.index(verdict))
    for verdict in (Verdict.ANSWERED, Verdict.EXCEPTION, Verdict.NO_RESPONSE, Verdict.DATA, Verdict.BROADCAST)
)


class ProfibusBlockPairing:
    """Runs of regular rows among some good telegrams."""

    def __init__(
        self, tracker: ProfibusTracker, frames: FrameColumns, octets: Octets, timing: Timing, slack: Times
    ) -> None:
        self._tracker = tracker
        self._frames, self._octets, self._slack = frames, octets, slack
        self._asks: Masks = (frames.role == _REQUEST) | (frames.role == _POLL)
        self._answered = _answered(frames, self._asks, PATIENCE + timing.latency)
        self._irregular = np.append(np.flatnonzero(self._find_irregular()), len(frames))

    def run(self, begin: int, no: int) -> Run | None:
        """See `dissectors.columns.BlockPairing`."""
        tracker = self._tracker
        if not tracker.is_at_rest:
            return None
        stop = int(self._irregular[np.searchsorted(self._irregular, begin)])
        ends = np.flatnonzero(~self._asks[begin : min(stop, begin + HORIZON)])  # a request is over with the next row
        if not len(ends) or (self._asks[begin] and tracker.may_repeat(self._octets_of(begin))):
            return None
        end = begin + int(ends[-1]) + 1
        asked = np.flatnonzero(self._frames.role[begin:end] != _RESPONSE) + begin
        run = Run(begin, end, *self._made(asked, begin, end, no))
        tracker.pass_by(len(asked), self._past(int(asked[-1]), no - begin), bool(self._asks[asked].any()))
        self._teach(begin, end)
        return run

    def _teach(self, begin: int, end: int) -> None:
        """Who was heard, and whose turn it is behind them."""
        frames, rows = self._frames, slice(begin, end)
        source, to, role = frames.source[rows], frames.destination[rows], frames.role[rows]
        token, checked = role == _TOKEN, (source != NONE) & (role != _TOKEN)
        passed, first = np.unique(source[token][::-1], return_index=True)
        sends = int(np.flatnonzero(role != _RESPONSE)[-1])
        self._tracker.turn.pass_by(
            np.unique(source[checked]).tolist(),
            np.unique(source[checked & (role != _RESPONSE)]).tolist(),
            np.unique(to[checked]).tolist(),
            dict(zip(passed.tolist(), to[token][::-1][first].tolist(), strict=True)),
            int(to[sends] if token[sends] else source[sends]),
        )
        goes_on = (role != _RESPONSE) & ~(token & (source == to))
        self._tracker.turn.wait(frames.start[rows], frames.end[rows], goes_on)

    def _find_irregular(self) -> Masks:
        """Rows that the tracker must see: answers that are not of the row before, and what may be a repeat."""
        frames = self._frames
        response = frames.role == _RESPONSE
        irregular: Masks = response.copy()
        irregular[1:] &= ~self._answered[:-1]
        irregular[:-1] |= self._asks[:-1] & response[1:] & ~self._answered[:-1]
        asked = np.flatnonzero(self._asks)
        behind = asked + 1 + self._answered[asked]
        again = np.flatnonzero(behind[:-1] == asked[1:])
        first, second = asked[again], asked[again + 1]
        irregular[second[self._may_repeat(first, second)]] = True
        return irregular

    def _may_repeat(self, first: Times, second: Times) -> Masks:
        """Whether requests may be those before them again, as far as head, length and sum tell."""
        frames, octets = self._frames, self._octets
        at, other = (
            frames.offset[rows] + np.where(octets[frames.offset[rows]] == SD2, 4, 1) for rows in (first, second)
        )
        sums = (octets[frames.offset[rows] + frames.length[rows] - 2] for rows in (first, second))
        same: Masks = (frames.length[first] == frames.length[second]) & (next(sums) == next(sums))
        for place in range(3):
            same &= octets[at + place] == octets[other + place]
        same &= frames.role[second] == _REQUEST
        return same & (~self._answered[first] | (octets[other + 2] & FCV > 0))

    def _made(self, asked: Times, begin: int, end: int, no: int) -> tuple[PlacementColumns, TransactionColumns, Times]:
        """Of all rows that open an exchange or stand for themselves."""
        frames, slack, asks, answered = self._frames, self._slack, self._asks[asked], self._answered[asked]
        behind = np.minimum(asked + 1, len(frames) - 1)
        tx, nothing = self._tracker.next_id + np.arange(len(asked)), np.full(len(asked), NONE, np.int64)
        to_all = frames.role[asked] == _TO_ALL
        gap = np.maximum(frames.start[behind] - frames.end[asked], 0)
        alone = np.where(to_all, _BROADCAST, _DATA)
        missed = np.where(frames.role[asked] == _POLL, _DATA, _NO_RESPONSE)
        replied = np.where(frames.error[behind] > 0, _EXCEPTION, _ANSWERED)
        transactions = TransactionColumns(
            tx,
            np.where(to_all, np.int16(NONE), frames.destination[asked]),
            frames.kind[asked],
            asked + (no - begin),
            np.where(answered, behind + (no - begin), NONE),
            np.where(asks, np.where(answered, replied, missed), alone),
            frames.start[asked],
            np.where(answered, frames.end[behind], frames.end[asked]),
            np.where(answered, gap, NONE),
            np.where(answered, np.maximum(gap - slack[behind], 0), NONE),
            np.where(answered, gap + slack[asked], NONE),
            np.ones(len(asked), np.int32),
            nothing,
            np.where(answered, frames.error[behind], 0).astype(np.uint16),
            frames.names,
        )
        return self._placed(asked[answered], begin, end), transactions, asked + asks

    def _placed(self, answered: Times, begin: int, end: int) -> PlacementColumns:
        frames, rows = self._frames, slice(begin, end)
        source, destination = frames.source[rows].copy(), frames.destination[rows].copy()
        replies = answered + 1 - begin
        source[replies], destination[replies] = frames.destination[answered], frames.source[answered]
        opened = np.cumsum(frames.role[rows] != _RESPONSE)
        return PlacementColumns(self._tracker.next_id - 1 + opened, frames.role[rows], source, destination)

    def _past(self, row: int, to_number: int) -> Past | None:
        """The newest request as the tracker remembers it; None where something came after it that nobody answers."""
        if not self._asks[row]:
            return None
        frames = self._frames
        frame: Frame = frames.frame(row, self._octets, PROTOCOL, int(self._slack[row]))
        return Past(row + to_number, frame, frames.header(row, PROTOCOL), self._octets_of(row + 1))

    def _octets_of(self, row: int) -> bytes:
        begin = int(self._frames.offset[row])
        return self._octets[begin : begin + int(self._frames.length[row])].tobytes()


def _answered(frames: FrameColumns, asks: Masks, patience: int) -> Masks:
    """Which requests the next row answers in time."""
    answered = np.zeros(len(frames), bool)
    if len(frames) < 2:
        return answered
    source, destination = frames.source, frames.destination
    named = (source[1:] == destination[:-1]) & (destination[1:] == source[:-1])
    fits = asks[:-1] & (frames.role[1:] == _RESPONSE) & (named | (source[1:] == NONE))
    answered[:-1] = fits & (frames.start[1:] - frames.end[:-1] <= patience)
    return answered


def pairing(
    tracker: Tracker, frames: FrameColumns, octets: Octets, timing: Timing, slack: Times
) -> ProfibusBlockPairing:
    """For the manifest."""
    assert isinstance(tracker, ProfibusTracker)
    return ProfibusBlockPairing(tracker, frames, octets, timing, slack)
