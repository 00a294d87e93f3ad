"""Silences on a Modbus line: between frames, inside frames, and what they say of how late the computer read.

A pause that is far shorter than the master's usual one tells that the answer before it was not sent late but read late:
the computer was busy, and had caught up when the next request came.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from dissectors.findings import Tally
from dissectors.frame import FoundBy, Frame, Header, Role
from dissectors.line import Timing
from dissectors.modbus.bus_record import BusRecord
from dissectors.modbus.envelope import RTU_NAME
from dissectors.modbus.learned_timing import LearnedTiming
from dissectors.modbus.station_record import middle
from dissectors.tracker import Placement, Transaction

SPACING_KEPT = 64
SPACING_LEAST = 8
PAUSES_KEPT = 32
"""The newest pauses, of which `LearnedTiming` keeps no more."""

_SLOW_KEPT = 2
_FIFO_CHARS = 5  # of silence before the last octets of a frame: a UART that nobody named holds them for four


@dataclass(frozen=True, slots=True)
class _Slow:
    """An answer that took long, and where it counts."""

    tally: Tally
    transaction: Transaction


class Gaps:
    """Fed frame by frame; writes what it finds into the evidence."""

    def __init__(self, timing: Timing, seen: BusRecord, learnt: LearnedTiming) -> None:
        self.latency = timing.latency
        self._char = timing.char
        self.pause_limit = timing.t15
        self._is_told = timing.is_told
        self._may_be_held = timing.t15 + _FIFO_CHARS * timing.char
        self.close = timing.t35 - timing.line.bits(1)  # a silence between frames that is below, by the longest reading
        self.seen = seen
        self._learnt = learnt
        self.before: Frame | None = None  # the row before, if it was a good frame
        self.answered: Frame | None = None  # the row before, if it was a good answer
        self.spacing: dict[str, deque[int]] = {}  # silence an octet of the last frames of each sender, ns
        self.asked: int | None = None  # when the request of that answer began, if it was the row before it
        self._asks: int | None = None  # when the row before began, if it was a good request
        self._slow: deque[_Slow] = deque()  # answers that took long, until the pause after them is known
        self.pauses: deque[int] = deque(maxlen=SPACING_KEPT)  # the master's, between an answer and its next request
        self.hurried: deque[int] = deque(maxlen=64)  # answers after which the master seemed to pause hardly

    def see(self, no: int, frame: Frame, header: Header, placement: Placement) -> None:
        """Take the next frame."""
        self._see_gap(no, frame, header, placement)
        self._see_pause_before(no, frame, header, placement)
        self.before = frame if header.ok else None
        self.answered = frame if placement.role is Role.RESPONSE and header.ok else None
        self.asked = self._asks if self.answered is not None else None
        self._asks = frame.start if placement.role is Role.REQUEST and header.ok else None

    def hear_noise(self) -> None:
        """Take octets that are no frame."""
        self.before = self.answered = self.asked = self._asks = None

    def took_long(self, tally: Tally, transaction: Transaction) -> None:
        """Count an answer that took long, once the pause after it is known."""
        self._slow.append(_Slow(tally, transaction))
        self.judge_slow(_SLOW_KEPT)

    def judge_slow(self, left: int) -> None:
        """Count all but the last `left` answers that took long."""
        while len(self._slow) > left:
            self._judge_slow(self._slow.popleft())

    def pass_by(self, last: Frame, asked: int) -> None:
        """Go on behind good frames, of which `last` is the last one, and an answer; its request began at `asked`."""
        self.before = self.answered = last
        self.asked, self._asks = asked, None

    def begins_soon(self, start: int, octets: bytes) -> bool:
        """Whether a good frame begins too soon after the row before; frames that touch came in one read, which says
        nothing of the silence between them."""
        before = self.before
        if before is None or before.octets == octets or before.end >= start:
            return False
        return max(0, start - before.end) + before.slack < self.close

    def _see_gap(self, no: int, frame: Frame, header: Header, placement: Placement) -> None:
        """Silences that are provably too short between frames, or too long inside one."""
        sender = sender_of(placement)
        if placement.role is not Role.EITHER:
            self.seen.frames[sender] += 1
            self.seen.octets[sender] += max(len(frame.octets), frame.expected or 0)
        if frame.protocol != RTU_NAME:
            return
        if header.ok and not frame.skipped and self.begins_soon(frame.start, frame.octets):
            self.seen.too_close(sender, frame.start, no - 1, no)
        if header.ok and not frame.marks:  # in a damaged one octets may be missing, and leave the same silence
            self._see_spacing(no, frame, sender)

    def _see_spacing(self, no: int, frame: Frame, sender: str) -> None:
        """A silence inside a frame, beyond the spacing that this sender always leaves between its octets."""
        length = len(frame.octets)
        if length < 2:
            return
        silence = frame.end - frame.slack - frame.start - length * self._char
        if silence > self.pause_limit:
            self.see_pause(no, frame.start, length, silence, sender, is_torn=frame.found is FoundBy.JOINED)
        self.spacing_of(sender).append(silence // (length - 1))

    def see_pause(self, no: int, start: int, length: int, silence: int, sender: str, *, is_torn: bool) -> None:
        """Take a frame with more silence in it than the rule allows. `is_torn`: so much of it stands at one place that
        the framer had to put the frame together, which no even spacing does."""
        usual = self.spacing_of(sender)
        uneven = silence - (length - 1) * max(0, middle(usual)) if len(usual) >= SPACING_LEAST else 0
        if uneven > self.pause_limit or (is_torn and self._is_told):
            self.seen.gap_tally(self.seen.paused, sender).add(start, no)
            self.seen.held_back[sender] += not self._is_told and uneven <= self._may_be_held

    def spacing_of(self, sender: str) -> deque[int]:
        """Silence an octet of the last frames of a sender, ns."""
        usual = self.spacing.get(sender)
        if usual is None:
            usual = self.spacing[sender] = deque(maxlen=SPACING_KEPT)
        return usual

    def _judge_slow(self, slow: _Slow) -> None:
        """Count an answer that took long, unless the computer was late for it and no later for what followed."""
        transaction = slow.transaction
        if transaction.response not in self.hurried:
            slow.tally.add(transaction.end, transaction.request, transaction.response)

    def _see_pause_before(self, no: int, frame: Frame, header: Header, placement: Placement) -> None:
        """A request after an answer: a pause far below the usual says that the answer was read too late."""
        if self.answered is None or placement.role is not Role.REQUEST or not header.ok:
            return
        pause = max(0, frame.start - self.answered.end)
        if self.is_hurried(pause, self.pauses):
            self.hurried.append(no - 1)
        turns = () if self.asked is None else ((frame.start - self.asked, self.answered.end - self.asked),)
        self.paused((pause,), turns)

    def is_hurried(self, pause: int, before: Sequence[int]) -> bool:
        """Whether a pause is far below the usual of those before."""
        return len(before) >= SPACING_LEAST and 2 * pause < middle(before) - self.latency

    def paused(self, pauses: Sequence[int], turns: Iterable[tuple[int, int]]) -> None:
        """The master's next pauses between an answer and a request, ns; `turns`: see `Rhythm.turns`."""
        self.pauses.extend(pauses)
        self.seen.rhythm.turns.extend(turns)
        for pause in pauses[-PAUSES_KEPT:]:
            self._learnt.paused(pause, 0)


def sender_of(placement: Placement) -> str:
    """Who sent a frame, as findings name him."""
    return "master" if placement.role is not Role.RESPONSE else f"station {placement.source}"


def sender_name(unit: int) -> str:
    """The same by the station's address; 0: the master."""
    return f"station {unit}" if unit else "master"
