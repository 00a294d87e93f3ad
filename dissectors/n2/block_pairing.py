"""The bulk form of the N2 tracker, as the engine asks for it (`dissectors.columns.Pairing`).

Regular is a good command with a good answer directly behind it that it may ask for, in time, and not much sooner than
its station ever answered. While the tracker is at rest, such exchanges need nothing of it but those times. All else
goes through the tracker: what is not answered, damaged, late, said twice.
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
from dissectors.n2.commands import parse_command
from dissectors.n2.envelope import ANSWER, COMMAND
from dissectors.n2.exchange import GIVE_UP
from dissectors.n2.forms import may_answer
from dissectors.n2.header import BROADCAST
from dissectors.n2.station_times import FEW
from dissectors.n2.tracker import N2Tracker
from dissectors.tracker import Verdict

if TYPE_CHECKING:
    from dissectors.line import Timing
    from dissectors.tracker import Tracker

PROTOCOL: Final = "n2"

HORIZON: Final = 1 << 14
"""Exchanges looked at in one go: a run that goes on is taken up again."""

_RESPONSE = np.uint8(ROLES.index(Role.RESPONSE))
_ANSWERED, _EXCEPTION = (np.uint8(VERDICTS.index(one)) for one in (Verdict.ANSWERED, Verdict.EXCEPTION))
_HEX = np.zeros(256, bool)
_HEX[list(b"0123456789ABCDEFabcdef")] = True


class N2BlockPairing:
    """Runs of regular exchanges among some frames."""

    def __init__(self, tracker: N2Tracker, frames: FrameColumns, octets: Octets, timing: Timing, slack: Times) -> None:
        self._tracker = tracker
        self._frames, self._octets, self._slack = frames, octets, slack
        self._latency = timing.latency
        regular = _regular(frames, octets)
        # of each parity, the first row from which on no regular exchange begins
        self._irregular = [parity + 2 * np.flatnonzero(~regular[parity::2]) for parity in (0, 1)]

    def run(self, begin: int, no: int) -> Run | None:
        """See `dissectors.columns.BlockPairing`."""
        if not self._tracker.is_at_rest:
            return None
        stops = self._irregular[begin & 1]
        stop = int(stops[np.searchsorted(stops, begin)])
        asked: Times = np.arange(begin, min(stop, begin + 2 * HORIZON), 2)
        if len(asked):
            asked, times = self._not_too_soon(asked)
        if not len(asked):
            return None
        last = int(asked[-1])
        made = self._made(asked, no - begin)
        start, end = self._frames.start, self._frames.end
        pauses = start[asked[1:]] - end[asked[:-1] + 1]
        self._tracker.pass_by(
            len(asked),
            times,
            int(start[asked[0]]),
            max(0, int(pauses.min())) if len(pauses) else None,
            (no + last - begin, self._frame(last), self._frames.header(last, PROTOCOL)),
            self._frame(last + 1),
        )
        return Run(begin, last + 2, *made, asked + 1)

    def _frame(self, row: int) -> Frame:
        return self._frames.frame(row, self._octets, PROTOCOL, int(self._slack[row]))

    def _not_too_soon(self, asked: Times) -> tuple[Times, dict[int, tuple[int, int]]]:
        """The exchanges before the first that was answered much sooner than its station ever did; what is known of the
        times of the stations behind them."""
        frames = self._frames
        gap = frames.start[asked + 1] - frames.end[asked]
        low, high = np.maximum(gap - self._latency, 0), np.maximum(gap + self._slack[asked], 0)
        station = frames.destination[asked]
        order = np.argsort(station, kind="stable")
        begins = np.flatnonzero(np.append(True, station[order][1:] != station[order][:-1])).tolist()
        end, seen = len(asked), []
        for first, beyond in zip(begins, [*begins[1:], len(order)], strict=True):
            which = order[first:beyond]
            name = int(station[which[0]])
            count, least = self._tracker.known_times(name)
            lows = np.minimum.accumulate(low[which])
            if count:
                lows = np.minimum(lows, least)
            before = np.append(least if count else 0, lows[:-1])
            soon = (count + np.arange(len(which)) >= FEW) & (2 * high[which] < before)
            if soon.any():
                end = min(end, int(which[np.argmax(soon)]))
            seen.append((int(which[0]), name, count, which, lows))
        times = {}
        for place, name, count, which, lows in sorted(seen, key=lambda one: one[0]):
            if place < end:
                number = int(np.searchsorted(which, end))
                times[name] = count + number, int(lows[number - 1])
        return asked[:end], times

    def _made(self, asked: Times, to_number: int) -> tuple[PlacementColumns, TransactionColumns]:
        frames, slack, answered = self._frames, self._slack, asked + 1
        gap = frames.start[answered] - frames.end[asked]
        count, tx = len(asked), self._tracker.next_id + np.arange(len(asked))
        station, nothing = frames.destination[asked], np.full(len(asked), NONE, np.int64)
        refused = self._octets[frames.offset[answered]] != ANSWER
        transactions = TransactionColumns(
            tx,
            station,
            frames.kind[asked],
            asked + to_number,
            answered + to_number,
            np.where(refused, _EXCEPTION, _ANSWERED),
            frames.start[asked],
            frames.end[answered],
            gap,
            np.maximum(gap - self._latency, 0),
            np.maximum(gap + slack[asked], 0),
            np.ones(count, np.int32),
            nothing,
            frames.error[answered],
            frames.names,
        )
        role = np.empty(2 * count, np.uint8)
        role[0::2], role[1::2] = frames.role[asked], _RESPONSE
        source, destination = np.full(2 * count, NONE, np.int16), np.full(2 * count, NONE, np.int16)
        source[1::2] = destination[0::2] = station
        return PlacementColumns(np.repeat(tx, 2), role, source, destination), transactions


def _regular(frames: FrameColumns, octets: Octets) -> Masks:
    """Which rows begin a regular exchange, as far as its two frames tell; the last two never do."""
    count = len(frames)
    regular = np.zeros(count + 2, bool)
    if count < 2:
        return regular
    command = octets[frames.offset] == COMMAND
    asks = command & frames.ok & (frames.destination > BROADCAST)
    answers = ~command & frames.ok
    gap = frames.start[1:] - frames.end[:-1]
    pairs = np.flatnonzero(asks[:-1] & answers[1:] & frames.chained[1:] & (gap <= GIVE_UP))
    regular[pairs] = _fits(frames, octets, pairs)
    return regular


def _fits(frames: FrameColumns, octets: Octets, asked: Times) -> Masks:
    """Whether commands may ask for the answers behind them; each different pair of forms is asked once."""
    answered = asked + 1
    begin, length = frames.offset[answered], frames.length[answered].astype(np.int64)
    strange = np.concatenate(([0], np.cumsum(~_HEX[octets], dtype=np.int64)))
    data_end = np.maximum(begin + length - 3, begin + 1)
    is_hex = strange[data_end] == strange[np.minimum(begin + 1, data_end)]
    fits: Masks = octets[begin] != ANSWER
    ask = np.flatnonzero(~fits)
    for size in np.unique(frames.length[asked[ask]]).tolist():
        alike = ask[frames.length[asked[ask]] == size]
        commands = octets[frames.offset[asked[alike]][:, None] + np.arange(size)]
        different, which = np.unique(commands.view(f"V{size}")[:, 0], return_inverse=True)
        key = which << 10 | length[alike] << 1 | is_hex[alike]
        forms, form_of = np.unique(key, return_inverse=True)
        told = []
        for form in forms.tolist():
            data = (b"0" if form & 1 else b"G") * max((form >> 1 & 0x1FF) - 4, 0)
            answer = b"A" + data + b"00\r" if form >> 1 & 0x1FF >= 4 else b"A\r"
            told.append(may_answer(parse_command(different[form >> 10].tobytes()), answer))
        fits[alike] = np.array(told, bool)[form_of]
    return fits


def pairing(tracker: Tracker, frames: FrameColumns, octets: Octets, timing: Timing, slack: Times) -> N2BlockPairing:
    """For the manifest."""
    assert isinstance(tracker, N2Tracker)
    return N2BlockPairing(tracker, frames, octets, timing, slack)
