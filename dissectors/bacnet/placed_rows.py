"""The rows of MS/TP columns, each by itself and by the row before it: the half of pairing that needs no memory.

A token, a poll and a request wait for the next frame and are over with it, whatever it is; everything else waits for
nothing. Where that is not so, or needs to know more than two rows, the row is doubtful: `pairing.py` lists which.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dissectors.bacnet.data_exchanges import LATE_WITHIN
from dissectors.bacnet.frame_types import HEADER, FrameType
from dissectors.bacnet.limits import BROADCAST, T_NO_TOKEN, T_USAGE_DELAY, T_USAGE_TIMEOUT, TURNAROUND_BITS
from dissectors.bacnet.npdu_columns import heads
from dissectors.bacnet.open_exchanges import REMEMBERED
from dissectors.bacnet.past_exchanges import NO_KEY
from dissectors.columns import NONE, VERDICTS, FrameColumns, TransactionColumns
from dissectors.tracker import Verdict

if TYPE_CHECKING:
    from dissectors.bacnet.past_exchanges import Nets
    from dissectors.columns import Codes, Masks, Octets, Times
    from dissectors.line import Timing

DOUBTFUL, TOKEN, POLL, POLL_REPLY, REQUEST, ANSWER, SINGLE = range(7)
WAITS = np.array([0, 1, 1, 0, 1, 0, 0], bool)
"""Which kinds of rows hold the bus."""

CODE = {verdict: np.uint8(code) for code, verdict in enumerate(VERDICTS)}
_CRC = 2


class PlacedRows:
    """Rows of some columns, placed by what each says and by the one before it.

    `octets`: where `frames.offset` counts. `nets`: numbers of addresses behind routers. `slack`: ns, of each frame.

    One entry a row: `kinds`, what it is (above); `keys`, of the exchange that it asks for or answers; `answered`,
    whether it answers the row before; `attempt`, of tokens passed again; `opened`, transactions opened up to it, it
    included; `sure`, whether it can be decided without a tracker. One entry a request: `requests`, its row; `earlier`,
    the place here of the newest one before it with its key. `repeating`: places of those that may repeat that one,
    which had no answer. One entry a transaction, in the order of closing: `closing` and `owner`, the rows that closed
    and opened it; `transactions`, with places among `opened` for ids and rows for numbers.
    """

    def __init__(self, frames: FrameColumns, octets: Octets, timing: Timing, nets: Nets, slack: Times) -> None:
        self.frames, self.octets, self._timing, self._nets, self._slack = frames, octets, timing, nets, slack
        self.source, self.destination = frames.source.astype(np.int64), frames.destination.astype(np.int64)
        self.kinds, self.keys, self._verdict_alone = self._classes()
        self._relate()
        self._close()

    # What each row is by itself

    def _classes(self) -> tuple[Codes, Times, Codes]:
        frames, kinds = self.frames, self.frames.function
        good, to_all = frames.ok, self.destination == BROADCAST
        classes = np.full(len(frames), DOUBTFUL, np.uint8)
        short = good & (frames.length == HEADER)
        for kind, what in (
            (FrameType.TOKEN, TOKEN),
            (FrameType.POLL_FOR_MASTER, POLL),
            (FrameType.REPLY_TO_POLL_FOR_MASTER, POLL_REPLY),
        ):
            classes[short & (kinds == kind)] = what
        foreign = (kinds > FrameType.REPLY_POSTPONED) & (kinds != FrameType.EXTENDED_DATA_EXPECTING_REPLY)
        classes[good & foreign & (kinds != FrameType.EXTENDED_DATA_NOT_EXPECTING_REPLY)] = SINGLE
        keys = np.full(len(frames), NO_KEY, np.int64)
        expecting = kinds == FrameType.DATA_EXPECTING_REPLY
        rows = np.flatnonzero(good & (expecting | (kinds == FrameType.DATA_NOT_EXPECTING_REPLY)))
        begin, size = frames.offset[rows] + HEADER, frames.length[rows] - np.int64(HEADER + _CRC)
        head = heads(self.octets, begin, size, self.source[rows], self.destination[rows], self._nets)
        one, asked = ~to_all[rows], expecting[rows]
        classes[rows[head.asks & one & asked]] = REQUEST
        classes[rows[head.answers & one]] = ANSWER
        classes[rows[head.unasked & (~one | ~asked)]] = SINGLE
        keys[rows] = head.key
        return classes, keys, np.where(to_all, CODE[Verdict.BROADCAST], CODE[Verdict.DATA])

    # What each row is by the one before it

    def _relate(self) -> None:
        frames, classes = self.frames, self.kinds
        count = len(frames)
        before = np.maximum(np.arange(count) - 1, 0)
        gap = frames.start - frames.end[before]
        back = (self.source == self.destination[before]) & (self.destination == self.source[before])
        in_time = gap < T_NO_TOKEN
        answered = in_time & back & (classes == POLL_REPLY) & (classes[before] == POLL)
        asked = in_time & (classes[before] == REQUEST)
        answered |= asked & back & (classes == ANSWER) & (self.keys == self.keys[before])
        doubtful = ((classes == POLL_REPLY) | (classes == ANSWER)) & ~answered
        doubtful |= asked & back & ~answered & (classes != TOKEN) & (classes != POLL)
        same = (frames.length == frames.length[before]) & (frames.function == frames.function[before])
        same &= (self.source == self.source[before]) & (self.destination == self.destination[before])
        if self._timing.latency < T_USAGE_DELAY:
            doubtful |= same & (gap < self._timing.line.bits(TURNAROUND_BITS))
        doubtful |= same & ((classes == TOKEN) | (classes == POLL)) & (gap < T_USAGE_TIMEOUT)  # perhaps a copy
        doubtful |= classes == DOUBTFUL
        self.answered, self._in_time = answered, in_time
        self._used = in_time & (self.source == self.destination[before])
        again = same & in_time & (classes == TOKEN)  # a token passed again
        self.attempt = (np.arange(count) - np.maximum.accumulate(np.where(again, 0, np.arange(count))) + 1).astype(
            np.int32
        )
        self.requests = np.flatnonzero(classes == REQUEST)
        self.earlier = self._same_key_before()
        within = self._failed_within()
        self.repeating = np.flatnonzero(within)
        doubtful[self.requests] |= within & (np.arange(len(within)) - self.earlier >= REMEMBERED)
        sure = ~doubtful & frames.chained
        sure[1:] &= ~doubtful[:-1]
        self.sure = sure
        self.doubtful_rows = np.append(np.flatnonzero(~sure), count)
        self.opened = np.cumsum(~answered)

    def _same_key_before(self) -> Times:
        """Of each request, the place among requests of the newest one before it with the same key, or NONE."""
        keys = self.keys[self.requests]
        order = np.argsort(keys, kind="stable")
        earlier = np.full(len(keys), NONE, np.int64)
        same = keys[order][1:] == keys[order][:-1]
        earlier[order[1:][same]] = order[:-1][same]
        return earlier

    def _failed_within(self) -> Masks:
        """Which requests come so soon after one with the same key that had no answer, that they may repeat it."""
        if not len(self.requests):
            return np.zeros(0, bool)
        older = self.requests[np.maximum(self.earlier, 0)]
        answered = np.append(self.answered, False)[older + 1]
        soon = self.frames.start[self.requests] - self.frames.end[older] < LATE_WITHIN
        failed: Masks = (self.earlier >= 0) & ~answered & soon
        return failed

    # The transactions that each row closes

    def _close(self) -> None:
        frames, classes = self.frames, self.kinds
        closes = np.zeros(len(frames), bool)
        closes[1:] = WAITS.take(classes[:-1])
        waited, alone = np.flatnonzero(closes), np.flatnonzero(classes == SINGLE)
        closing, owner = waited, waited - 1
        if len(alone):
            closing = np.concatenate((waited, alone))
            order = np.argsort(closing, kind="stable")  # what waited goes before what is over at once
            closing, owner = closing[order], np.concatenate((owner, alone))[order]
        kind = classes[owner]
        answered, single = self.answered[closing] & (kind != SINGLE), kind == SINGLE
        negative = frames.error[closing] != 0
        verdict = np.where(kind == REQUEST, CODE[Verdict.NO_RESPONSE], CODE[Verdict.DATA])
        verdict[(kind == TOKEN) & ~self._used[closing]] = CODE[Verdict.NO_RESPONSE]
        verdict[answered] = CODE[Verdict.ANSWERED]
        verdict[answered & (kind == REQUEST) & negative] = CODE[Verdict.EXCEPTION]
        verdict = np.where(single, self._verdict_alone[owner], verdict)
        timed = answered | (kind == TOKEN) & self._used[closing]
        latency = np.maximum(frames.start[closing] - frames.end[owner], 0)
        self.closing, self.owner = closing, owner
        self.transactions = TransactionColumns(
            id=self.opened[owner],
            station=frames.destination[owner],
            kind=frames.kind[owner],
            request=owner,
            response=np.where(answered, closing, NONE),
            verdict=verdict,
            start=frames.start[owner],
            end=np.where(answered, frames.end[closing], frames.end[owner]),
            latency=np.where(timed, latency, NONE),
            least=np.where(timed, np.maximum(latency - self._slack[closing], 0), NONE),
            most=np.where(timed, latency + self._slack[owner], NONE),
            attempt=self.attempt[owner],
            of=np.where(self.attempt[owner] > 1, self.opened[owner] - 1, NONE),
            error=np.where(single | answered & (kind == REQUEST) & negative, frames.error[closing], 0).astype(
                np.uint16
            ),
            names=frames.names,
        )
