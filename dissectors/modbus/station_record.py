"""The record of a station and of the times on the bus: what the rules remember; bounded, without judgement."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from dissectors.findings import Tally, together
from dissectors.frame import Flaw
from dissectors.modbus.garbage import Garbage
from dissectors.modbus.impossible import Impossible
from dissectors.modbus.pairing import is_answer
from dissectors.modbus.poll_order import Asked, Neighbours, PollOrder
from dissectors.modbus.response_groups import AnsweredRequest, SameRequest
from dissectors.modbus.text_changes import TextDamage
from dissectors.tracker import Interval
from dissectors.wrong_checks import Habit, WrongChecks

KEYS_KEPT = 512
"""Most different requests, or exceptions, of a station that are counted apart."""

SAME_KEPT = 8
"""Requests of a station whose answers are compared with each other."""

AWAY_LEAST = 5
"""Unanswered requests in a row of one that is not there for a while; fewer get lost."""

_BLOCKS = 64
_NEARLY_ALL = 4  # of five
_PERIODS = 256

Key = tuple[str, int | None]
"""A request as a poll list has it: kind and first register."""


@dataclass(frozen=True, slots=True)
class RegisterBlock:
    """Some response times in a row, ns: medians by the shortest, the nominal and the longest reading, and the least."""

    least: int
    low: int
    nominal: int
    high: int


@dataclass(slots=True)
class ResponseTimes:
    """Response times in the order they came, as medians of blocks; when there are too many blocks, pairs are joined."""

    count: int = 0
    longest: int = 0  # by the shortest reading, ns
    quickest: int = 0  # by the shortest reading, ns
    blocks: list[RegisterBlock] = field(default_factory=list)
    _size: int = 8
    _lows: list[int] = field(default_factory=list)  # of those since the last block, by their three readings
    _nominals: list[int] = field(default_factory=list)
    _highs: list[int] = field(default_factory=list)

    def add(self, latency: Interval) -> None:
        """Take the next one."""
        self.extend([latency.low], [latency.nominal], [latency.high])

    def extend(self, lows: list[int], nominals: list[int], highs: list[int]) -> None:
        """Take the next ones, at least one, by their three readings."""
        self.longest = max(self.longest, max(lows))
        self.quickest = min(self.quickest, min(lows)) if self.count else min(lows)
        self.count += len(lows)
        self._lows += lows
        self._nominals += nominals
        self._highs += highs
        done = 0
        while len(self._lows) - done >= self._size:
            done = self._make_block(done)
        if done:
            del self._lows[:done], self._nominals[:done], self._highs[:done]

    def _make_block(self, begin: int) -> int:
        """Of those from `begin` on; gives where the next one begins."""
        end = begin + self._size
        self.blocks.append(_block(self._lows[begin:end], self._nominals[begin:end], self._highs[begin:end]))
        if len(self.blocks) == _BLOCKS:
            pairs = zip(self.blocks[::2], self.blocks[1::2], strict=True)
            self.blocks = [_mean(earlier, later) for earlier, later in pairs]
            self._size *= 2
        return end

    def soonest(self) -> int:
        """How soon it answers at best, by the shortest reading, ns: the least of some in a row, in the middle of all.

        Of two masters that ask one station at once, the answer to the first seems a very quick one to the second.
        """
        return middle([block.least for block in self.blocks]) if self.blocks else self.quickest

    def median(self) -> RegisterBlock | None:
        """Over all of them; None without any."""
        if self.blocks:
            return _of_blocks(self.blocks)
        return _block(self._lows, self._nominals, self._highs) if self._lows else None

    def quarters(self) -> tuple[RegisterBlock, ...]:
        """Medians of the four quarters, in order; empty while there is too little to compare."""
        size = len(self.blocks) // 4
        if size < 2:
            return ()
        return tuple(_of_blocks(self.blocks[len(self.blocks) * k // 4 :][:size]) for k in range(4))


def middle(values: Sequence[int]) -> int:
    """The median of at least one value."""
    return sorted(values)[len(values) // 2]


def _block(lows: Sequence[int], nominals: Sequence[int], highs: Sequence[int]) -> RegisterBlock:
    return RegisterBlock(min(lows), middle(lows), middle(nominals), middle(highs))


def _of_blocks(blocks: Sequence[RegisterBlock]) -> RegisterBlock:
    return RegisterBlock(
        middle([block.least for block in blocks]),
        middle([block.low for block in blocks]),
        middle([block.nominal for block in blocks]),
        middle([block.high for block in blocks]),
    )


def _mean(earlier: RegisterBlock, later: RegisterBlock) -> RegisterBlock:
    return RegisterBlock(
        (earlier.least + later.least) // 2,
        (earlier.low + later.low) // 2,
        (earlier.nominal + later.nominal) // 2,
        (earlier.high + later.high) // 2,
    )


@dataclass(slots=True)
class Requested:
    """One kind of request to a station: how often it was asked for the first time, and what came of all tries."""

    turns: int = 0
    tries: int = 0
    echoed: int = 0  # of them, given back whole
    missing: Tally = field(default_factory=Tally)


@dataclass(frozen=True, slots=True)
class Lost:
    """A request that nothing answered, so far. `end`: when it ended, ns."""

    unit: int
    key: Key
    no: int
    end: int
    is_unheard: bool = False
    is_waited_for: bool = False


STRAY = 4
"""Of so many requests to nobody who is heard one may be followed by octets that are no good frame."""


@dataclass(slots=True)
class StationRecord:
    """One station. `missing`: no octet followed. `silent`: those since its last sign of life; `away`: those that stood
    AWAY_LEAST or more in a row after which it was heard again, `times_away` such rows of `away_for` ns. `unheard`: of
    those that are missing such after which the master went on as after an answer."""

    asked: int = 0
    answered: int = 0
    missing: Tally = field(default_factory=Tally)
    silent: Tally = field(default_factory=Tally)
    away: Tally = field(default_factory=Tally)
    times_away: int = 0
    away_for: int = 0
    unheard: Tally = field(default_factory=Tally)
    damaged: Tally = field(default_factory=Tally)
    cut: int = 0  # of the damaged answers: ended early
    last_octet: Tally = field(default_factory=Tally)  # only the last octet is wrong
    first_lost: Tally = field(default_factory=Tally)  # only the first octet is wrong; when: ns after the request
    checks: WrongChecks = field(default_factory=WrongChecks)  # of the damaged answers
    talked_over: Tally = field(default_factory=Tally)  # begun as an answer, and longer than it can be
    outlasting: Tally = field(default_factory=Tally)  # the same, and not over when the master gave up
    excess: list[int] = field(default_factory=list)  # octets by which those were too long
    garbled: int = 0  # octets in place of an answer that are no frame at all
    garbage: Garbage = field(default_factory=Garbage)  # what came in place of an answer, whole
    text_damage: TextDamage = field(default_factory=TextDamage)  # of the damaged answers of RTU
    flaws: dict[Flaw, Tally] = field(default_factory=dict)  # damaged answers that one change makes good
    undecided: Tally = field(default_factory=Tally)  # a frame that is the answer or the request again
    echoed: int = 0  # requests that were given back at once
    same_twice: int = 0  # second answers that say the same as the first
    impossible: Impossible = field(default_factory=Impossible)  # requests to it
    unasked: int = 0  # answers of it
    damaged_requests: int = 0  # of RTU, that name it
    unfit: Tally = field(default_factory=Tally)
    unfit_words: Counter[str] = field(default_factory=Counter)
    slow: Tally = field(default_factory=Tally)
    slow_of: int = 0  # answers that were compared with the same limit
    slow_limit: int | None = None  # that limit, ns, by the master's timeout; None: the one while it is not known
    late: Tally = field(default_factory=Tally)
    twice: Tally = field(default_factory=Tally)
    repeats: Tally = field(default_factory=Tally)
    repeats_cost: int = 0  # ns
    waited_for: int = 0  # of the missing, those that the master surely waited for
    waited: int = 0  # ns, that the master spent on requests that nothing followed
    last_start: int | None = None  # of its newest request
    last_heard: int | None = None
    copies: int = 0  # of the answers: those that equal the request and may be its repeat
    reserved: Tally = field(default_factory=Tally)  # frames when its address is outside the standard
    times: ResponseTimes = field(default_factory=ResponseTimes)
    requests: dict[Key, Requested] = field(default_factory=dict)
    exceptions: dict[tuple[Key, int], Tally] = field(default_factory=dict)
    same: dict[tuple[Key, bytes], SameRequest] = field(default_factory=dict)  # by request, octet by octet

    @property
    def explained(self) -> int:
        """How many damaged answers are no damage of the line: always the same, or always in the same way."""
        if self.text_damage.change is not None:
            return self.damaged.count
        flawed = sum(tally.count for tally in self.flaws.values() if tally.count >= 3)
        miscounted = self.miscounted
        flawed += miscounted.count if miscounted is not None else 0
        garbage = self.garbage.tally.count if self.garbage.is_system else 0
        return min(self.damaged.count, flawed + garbage)  # one answer may be explained twice

    @property
    def has_own_protocol(self) -> bool:
        """Whether it speaks a maker's own protocol in frames of Modbus, so that what it says fits nothing."""
        return self.impossible.is_own_protocol(self.answered)

    @property
    def miscounted(self) -> Habit | None:
        """What its answers have in common that are right but for the check; None where that is not its own doing."""
        habit = self.checks.habit(self.damaged.count, self.times.count)
        flawed = sum(tally.count for tally in self.flaws.values())
        return habit if habit is not None and 2 * flawed <= habit.count else None

    @property
    def is_unheard(self) -> bool:
        """Whether its answers were missed here: the master went on as after an answer, and asked hardly ever again."""
        unheard, repeats = self.unheard.count, self.repeats.count
        return 0 < self.missing.count <= 2 * unheard and _NEARLY_ALL * max(self.waited_for, repeats) <= unheard

    @property
    def turns(self) -> int:
        """How often the request was asked for the first time that was asked most often."""
        return max((request.turns for request in self.requests.values()), default=0)

    def request(self, key: Key) -> Requested:
        """The record of one kind of request; beyond KEYS_KEPT kinds, one for all others."""
        request = self.requests.get(key)
        if request is None:
            if len(self.requests) >= KEYS_KEPT:
                key = ("other requests", None)
            request = self.requests.setdefault(key, Requested())
        return request

    def exception(self, key: Key, code: int) -> Tally:
        """The record of one exception to one kind of request; beyond KEYS_KEPT, one for all others."""
        if (key, code) not in self.exceptions and len(self.exceptions) >= KEYS_KEPT:
            key = ("other requests", None)
        return self.exceptions.setdefault((key, code), Tally())

    def compare(self, key: Key, request: bytes, answer: AnsweredRequest) -> None:
        """Keep an answer beside the others to exactly the same request; the first SAME_KEPT requests only."""
        same = self.same_request(key, request)
        if same is not None:
            same.add((answer,))

    def same_request(self, key: Key, request: bytes) -> SameRequest | None:
        """The answers to exactly the same request, those to come included; None beyond SAME_KEPT requests."""
        same = self.same.get((key, request))
        if same is None and len(self.same) < SAME_KEPT:
            same = self.same[key, request] = SameRequest()
        return same

    def compare_with(self, limit: int | None, answers: int) -> None:
        """Count answers that are compared with a limit; anew when there is one, or none any more."""
        if (limit is None) != (self.slow_limit is None):
            self.slow, self.slow_of = Tally(), 0
        self.slow_limit = limit
        self.slow_of += answers

    def flaw(self, flaw: Flaw) -> Tally:
        """The record of one way in which answers are damaged."""
        return self.flaws.setdefault(flaw, Tally())

    def forgive(self, lost: Lost) -> None:
        """The request was answered, after its master had given up: it is not lost as well."""
        request = self.requests.get(lost.key)
        unheard = self.unheard if lost.is_unheard else None
        self.waited_for -= lost.is_waited_for
        for tally in (self.missing, unheard, request.missing if request is not None else None):
            if tally is not None and tally.count:
                tally.count -= 1
                if lost.no in tally.evidence:
                    tally.evidence.remove(lost.no)

    def withdraw(self, lost: Lost) -> None:
        """Whether the request was answered cannot be known: it counts as not asked."""
        self.forgive(lost)
        self.asked -= 1
        self.silent.count = max(0, self.silent.count - 1)
        request = self.requests.get(lost.key)
        if request is not None:
            request.tries -= 1
            request.turns -= request.turns > 0

    @property
    def is_heard(self) -> bool:
        """Whether anything came from it but what stray octets in place of answers look like."""
        frames = self.answered or self.late.count or self.twice.count or self.undecided.count
        return bool(frames) or STRAY * self.damaged.count > self.asked

    def heard(self, time: int) -> None:
        """Something came in place of its answer."""
        self.last_heard = time
        if self.silent.count:
            if self.silent.count >= AWAY_LEAST:
                self.away = together((self.away, self.silent))
                self.times_away += 1
                self.away_for += self.silent.last - self.silent.first
            self.silent = Tally()


_FAR = 1 << 63
"""ns; no time is behind it."""


@dataclass(slots=True)
class Cycles:
    """Time from a request to the same request again, of the most frequent ones, and which of them follow which."""

    _last: dict[bytes, int] = field(default_factory=dict)
    _keys: dict[bytes, Key] = field(default_factory=dict)
    _periods: dict[bytes, deque[int]] = field(default_factory=dict)
    order: PollOrder = field(default_factory=PollOrder)

    def begin_anew(self) -> None:
        """No period goes on from what was seen so far."""
        self._last = dict.fromkeys(self._last, _FAR)

    def add(self, octets: bytes, key: Key, start: int) -> None:
        """Take a request (unit and PDU) that is no repeat of an unanswered one."""
        self.order.add((octets[0] if octets else 0, key))
        before = self._last.get(octets)
        if before is None and len(self._last) >= KEYS_KEPT:
            return
        self._last[octets] = start
        self._keys[octets] = key
        if before is None or start <= before:
            return
        periods = self._periods.get(octets)
        if periods is None:
            periods = self._periods[octets] = deque(maxlen=_PERIODS)
        periods.append(start - before)

    def again(self, octets: bytes, key: Key, starts: list[int]) -> tuple[int, list[int]] | None:
        """Take one request that came several times, in order (`order` apart); its periods, which are to be kept in the
        order in which the first of each ended, and at which of the starts that was. None where it has none."""
        before = self._last.get(octets)
        if before is None and len(self._last) >= KEYS_KEPT:
            return None
        self._last[octets] = starts[-1]
        self._keys[octets] = key
        if len(starts) == 1:  # as most do in a stretch
            return (0, [starts[0] - before]) if before is not None and starts[0] > before else None
        times = starts if before is None else [before, *starts]
        periods = [after - earlier for earlier, after in pairwise(times)]
        first = next((at for at, period in enumerate(periods) if period > 0), None)
        if first is None:
            return None
        return first + (before is None), [period for period in periods if period > 0]

    def keep(self, octets: bytes, periods: list[int]) -> None:
        """Keep periods of a request."""
        kept = self._periods.get(octets)
        if kept is None:
            kept = self._periods[octets] = deque(maxlen=_PERIODS)
        kept.extend(periods)

    def beside(self, asked: Asked, answer: bytes) -> tuple[Neighbours, ...]:
        """A request with each other one to its unit that an answer fits, in both orders."""
        unit = bytes(asked[:1])
        fitting = [octets for octets in self._last if octets[:1] == unit and is_answer(octets, answer)]
        others = [(asked[0], self._keys[octets]) for octets in fitting]
        return tuple(two for one in others for two in ((asked, one), (one, asked)))

    def usual(self) -> tuple[int, Key, list[int]] | None:
        """Unit and kind of the request with the most periods, and those in ascending order; None where none repeats."""
        if not self._periods:
            return None
        octets, periods = max(self._periods.items(), key=lambda pair: len(pair[1]))
        return octets[0], self._keys[octets], sorted(periods)
