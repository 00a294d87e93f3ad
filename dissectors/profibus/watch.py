"""Watches a bus telegram by telegram: who holds the token, what masters ask, how slaves come up.

What it notices it tells as events to whoever judges; the ring as a value is made when it is asked for.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import Enum, auto

from dissectors.frame import Event, Frame, Header
from dissectors.histogram import Histogram
from dissectors.line import NS_PER_S, Timing
from dissectors.profibus.parameters import parse_global_control
from dissectors.profibus.ring import MasterView, Ring, RingWindow, SlaveRow, ring_window
from dissectors.profibus.services import Service, service_of
from dissectors.profibus.slave_state import SlaveState
from dissectors.profibus.slave_watch import SlaveView
from dissectors.profibus.telegram import HIGHEST, SYN, Telegram, parse

CLEAR_LONG = 5 * NS_PER_S
"""ns of data exchange in Clear that are more than a start."""

_KEPT_ROUNDS = 10
"""Times the longest round of the token so far, for which no master has reason to keep it."""

_ROUNDS_LEAST = 8
LONGEST_SLOT = 16_383
"""Bit times of the longest slot time that a master can be given (14 bits): no longer does it wait for an answer."""

_LEAST_CLAIM = 6 * 37
"""Bit times of silence after which the lowest master makes a new token: six slot times, of 37 bits at least."""


class Notice(Enum):
    """What was noticed, about which station."""

    CLAIM = auto()  # a master made a token of its own although a ring was running
    TOKEN_AGAIN = auto()  # a token was sent again: its taker did not show itself
    OUT_OF_TURN = auto()  # a request by who did not hold the token, whose holder then went on with it
    WOKE = auto()  # the same by who had it until it was given up for silent, and goes on as if nothing had been
    DROP = auto()  # a slave left data exchange by itself
    STARVED = auto()  # the same, where something else than the slave may be why
    MASTER_SILENT = auto()  # a master asked nothing for longer than the watchdog of a slave, which left
    DIAGNOSIS = auto()  # a slave told its diagnosis
    LOCKED = auto()  # the same, to a master that wants the slave; it belongs to another one
    CLEAR = auto()  # data is exchanged while the master is in Clear, and has been for CLEAR_LONG
    CLEAR_PERHAPS = auto()  # the same where octets were damaged since: the end of it may be lost here


@dataclass(slots=True)
class Clear:
    """A master that said Clear to all. `since`: when it exchanged data first since then, ns; `latest`: when last."""

    since: int | None = None
    latest: int = 0
    is_blurred: bool = False

    @property
    def length(self) -> int:
        """For how long data was exchanged, ns."""
        return 0 if self.since is None else self.latest - self.since


@dataclass(slots=True)
class _Interruption:
    """A master, `by`, spoke while `holder` had the token, in row `no`. `alone`: it passed a token to itself since."""

    holder: int | None
    by: int
    no: int
    time: int
    alone: bool = False


@dataclass(slots=True)
class _Master:
    """A master on its way. `got`: when it last got the token; None after a disturbance."""

    view: MasterView = field(default_factory=MasterView)
    got: int | None = None
    rotation: Histogram = field(default_factory=Histogram)
    clear: Clear | None = None
    following: dict[int, int] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class KeptToken:
    """A master that has the token and does not pass it on. `time`: for how long, `usual`: the longest round before, ns.
    `others`: who had it in turns with this one."""

    master: int
    time: int
    usual: int
    others: tuple[int, ...]


Told = Callable[[Notice, int, int, int], None]
"""(what, station, number of the frame, ns)"""


def _to_nobody(what: Notice, station: int, no: int, time: int) -> None:
    """Nobody wants to know."""


class BusWatch:
    """The observer of one bus. `tell`: is told what is noticed."""

    def __init__(self, timing: Timing, tell: Told = _to_nobody) -> None:
        self.slaves: dict[int, SlaveView] = {}
        self._masters: dict[int, _Master] = {}
        self._tell = tell
        self._first: int | None = None
        self._last = 0
        self._unheard = 0
        self._missed: int | None = None  # where octets may be lost, until an event ends there or later
        self._wasted = 0
        self._looked: Ring | None = None
        self._heard = self._slack = 0  # end of the row before, and by how much it may have been earlier
        self._timing = timing
        self._least_claim = timing.line.bits(_LEAST_CLAIM)
        self._slot = timing.line.bits(LONGEST_SLOT)
        self._syn = timing.line.bits(SYN) if timing.has_times else 0  # without times nothing is sure to come at once
        self._holder: int | None = None
        self._interruption: _Interruption | None = None  # until it is known whether a token was missed at this tap
        self._robbed: int | None = None  # who lost the token to another one that gave it up; until it speaks in turn
        self.claimed_from: Counter[int] = Counter()  # who had the tokens that others then made anew
        self._gone: set[int] = set()  # who did not take its last token, and was not heard since
        self._newest = b""  # the newest request, while no token or other request came after it
        self._longest_clear: dict[int, int] = {}
        self._token: tuple[int, int] | None = None  # source and destination of the last token, nothing after it
        self._asked: tuple[Telegram, Service, int] | None = None  # an open request and its end

    def see(self, no: int, event: Event, header: Header | None) -> None:
        """Take the next row; one without octets: nobody heard what was before it."""
        if self._first is not None and (not event.octets or (self._missed is not None and event.end >= self._missed)):
            self._unheard += max(0, event.start - self._last)
            self._missed = None
        self._first = event.start if self._first is None else self._first
        self._see(no, event, header)
        self._last = max(self._last, event.end)
        self._heard, self._slack = event.end, event.slack if isinstance(event, Frame) else 0

    def _see(self, no: int, event: Event, header: Header | None) -> None:
        if not isinstance(event, Frame) or header is None or not event.ok:
            self._forget()
            return
        telegram = parse(event.octets)
        if telegram.is_token:
            self._pass(no, telegram, event)
        elif telegram.is_request:
            self._ask(no, telegram, event)
        else:
            self._answer(no, telegram, event)

    def miss(self, time: int) -> None:
        """Octets were lost at `time`, ns: what is missing there says nothing."""
        self._missed = time
        self._forget()

    def _forget(self) -> None:
        """Octets were lost or damaged."""
        if self._asked is not None and self._asked[0].destination in self.slaves:
            slave = self.slaves[self._asked[0].destination]
            slave.illegal += 1
            slave.unanswered += 1
        self._asked = self._token = self._holder = None
        for master in self._masters.values():
            master.got = None
            if master.clear is not None:
                master.clear.is_blurred = True
        for slave in self.slaves.values():
            slave.blur()

    def longest_clear(self, master: int) -> int:
        """For how long a master exchanged data in Clear without a break, at most, ns."""
        return self._longest_clear.get(master, 0)

    def kept(self) -> KeptToken | None:
        """Who has the token at last, asks on, and does not pass it on as it used to; None if nobody is sure to."""
        holder = None if self._holder is None else self._masters.get(self._holder)
        if holder is None or holder.got is None or not self._newest or not self._timing.has_times:
            return None
        usual, time = holder.rotation.quantile(1), self._last - holder.got
        there = (at for at in sorted(self._masters) if at not in self._gone and at != self._holder)
        others = tuple(at for at in there if self._masters[at].view.tokens)
        if usual is None or holder.rotation.count < _ROUNDS_LEAST or not others or self._holder is None:
            return None
        is_long = time > max(NS_PER_S, _KEPT_ROUNDS * usual)
        return KeptToken(self._holder, time, usual, others) if is_long else None

    def ring(self) -> Ring:
        """The ring so far."""
        masters = {
            address: replace(
                one.view,
                rotation=one.rotation.copy(),
                following=max(one.following, key=lambda to: one.following[to], default=None),
            )
            for address, one in self._masters.items()
        }
        slaves = {
            address: SlaveRow(
                view.state,
                view.changes[-1][0],
                view.changed,
                view.exchanges,
                tuple(view.changes),
                view.counts,
                view.cycle.copy(),
            )
            for address, view in self.slaves.items()
            if view.state is not None
        }
        timing = self._timing
        return Ring(
            *(masters, slaves, self._first or 0, self._last, self._wasted),
            has_times=timing.has_times,
            unheard=self._unheard,
            latency=timing.latency,
        )

    def window(self) -> RingWindow:
        """What is new since this was called the last time; the first time is not told of."""
        before, self._looked = self._looked, self.ring()
        return RingWindow() if before is None else ring_window(before, self._looked)

    def _master(self, address: int) -> _Master:
        return self._masters.setdefault(address, _Master())

    def _pass(self, no: int, token: Telegram, frame: Frame) -> None:
        source, to = token.source, token.destination
        if source is None or to is None or (source != to and self._token == (source, to) and self._is_copy(frame)):
            return
        self._unanswered(frame.start)
        self._newest = b""
        self._goes_on(source)
        giver = self._master(source)
        is_again = self._token == (source, to) and source != to
        by_another = self._token is None or self._token[0] != source  # else its taker is gone, and it goes on alone
        if self._holder not in (None, source) and self._is_at_once(frame):
            self._out_of_turn(source, no, frame)
        elif self._robbed == source:
            self._robbed = None
        is_claim = source == to and by_another and self._holder not in (None, source)
        was_in_ring = any(other != source for other in giver.following)
        giver.view = replace(
            giver.view,
            tokens=giver.view.tokens + (not is_again),
            repeats=giver.view.repeats + is_again,
            claims=giver.view.claims + (is_claim and was_in_ring),
        )
        if is_again:
            self._gone.add(to)
            self._tell(Notice.TOKEN_AGAIN, to, no, frame.start)
        elif is_claim and was_in_ring:
            self.claimed_from[self._holder or 0] += 1
            self._tell(Notice.CLAIM, source, no, frame.start)
        if not is_claim:
            giver.following[to] = giver.following.get(to, 0) + 1
            if not by_another and self._token is not None and self._token[1] != to:
                self._robbed = self._token[1]  # it did not take the token, which goes on without it
        else:
            self._robbed = self._holder
        if self._interruption is not None and (source != to or self._interruption.alone):
            self._interruption = None  # the token went round since
        elif self._interruption is not None:
            self._interruption.alone = True
        taker = self._master(to)
        if not is_again:
            if taker.got is not None:
                taker.rotation.add(frame.end - taker.got)
            taker.got = frame.end
        self._holder, self._token = to, (source, to)

    def _out_of_turn(self, source: int, no: int, frame: Frame) -> None:
        """A master speaks that does not hold the token: as if nothing had been, where it slept when it lost it.

        Else it may have been given the token in a telegram that was missed at this tap: then who held it last is
        silent until the token is back.
        """
        if source == self._robbed:
            self._tell(Notice.WOKE, source, no, frame.start)
        else:
            self._interruption = _Interruption(self._holder, source, no, frame.start)
        self._holder = None

    def _goes_on(self, source: int) -> None:
        """A master speaks: had it never given the token away, who spoke meanwhile did not have it."""
        self._gone.discard(source)
        cut = self._interruption
        if cut is not None and cut.holder == source:
            self._tell(Notice.OUT_OF_TURN, cut.by, cut.no, cut.time)
            self._interruption, self._holder = None, source

    def _is_copy(self, frame: Frame) -> bool:
        """Whether the same octets as before come so soon that the line gives them back."""
        return frame.start - self._heard + self._slack < self._syn

    def _is_at_once(self, frame: Frame) -> bool:
        """Whether it is sure that less silence was before a frame than any master waits before it claims the token."""
        return frame.start - self._heard + self._slack < self._least_claim

    def _ask(self, no: int, asked: Telegram, frame: Frame) -> None:
        is_open = self._asked is not None and self._asked[1] is not Service.FDL_STATUS
        if is_open and frame.octets == self._newest and self._is_copy(frame):
            return
        self._unanswered(frame.start)
        source, to = asked.source, asked.destination
        assert source is not None
        assert to is not None
        service, master = service_of(asked), self._master(source)
        is_poll = service is Service.FDL_STATUS
        self._goes_on(source)
        if self._holder is not None and self._holder != source:
            self._out_of_turn(source, no, frame)
        elif self._robbed == source and self._holder == source:
            self._robbed = None
        master.view = replace(
            master.view, requests=master.view.requests + (not is_poll), polls=master.view.polls + is_poll
        )
        self._token = None
        if service is Service.GLOBAL_CONTROL and (control := parse_global_control(asked.data)) is not None:
            if not control.groups:  # what is for some groups says nothing of the others
                master.clear = replace(master.clear or Clear(), is_blurred=False) if control.is_clear else None
        elif service is Service.DATA_EXCHANGE and any(asked.data):
            master.clear = None  # outputs that are not zero: the end of Clear was not heard
        if asked.control is not None and asked.control.wants_answer and to <= HIGHEST:
            self._asked = asked, service, frame.end
            if not is_poll:
                slave = self.slaves.setdefault(to, SlaveView())
                slave.ask(frame.start, source)
                slave.request(asked, service is Service.DATA_EXCHANGE, frame.octets == self._newest, frame.start)
        self._newest = frame.octets

    def _answer(self, no: int, answer: Telegram, frame: Frame) -> None:
        if self._asked is None:
            return
        (asked, service, _), self._asked = self._asked, None
        if answer.source is not None and (answer.source, answer.destination) != (asked.destination, asked.source):
            return
        assert asked.destination is not None
        assert asked.source is not None
        master = self._master(asked.source)
        if service is Service.FDL_STATUS:
            master.view = replace(master.view, answered=master.view.answered + 1)
            return
        slave = self.slaves.setdefault(asked.destination, SlaveView())
        fell = slave.answered(service, asked, answer, frame.end)
        if fell:
            self._tell(Notice.STARVED if slave.is_excused else Notice.DROP, asked.destination, no, frame.start)
            if self._timing.has_times and slave.is_starved(self._timing.latency):
                self._tell(Notice.MASTER_SILENT, asked.source, no, frame.start)
        slave.heard(slave.state is SlaveState.EXCHANGE)
        if service is Service.SET_PARAMETERS and slave.is_taken:
            slave.start(no, frame.start)
        elif service is Service.DIAGNOSIS:
            slave.wait(no, frame.start)
            self._tell(Notice.DIAGNOSIS, asked.destination, no, frame.start)
            if asked.source in slave.wanted_by and slave.is_of_another(asked.source):
                self._tell(Notice.LOCKED, asked.destination, no, frame.start)
        elif service is Service.DATA_EXCHANGE and master.clear is not None:
            self._cleared(asked.source, master.clear, no, frame)

    def _cleared(self, address: int, clear: Clear, no: int, frame: Frame) -> None:
        """Data is exchanged in Clear."""
        if clear.since is None:
            clear.since = frame.start
        clear.latest = frame.start
        if clear.length >= CLEAR_LONG:
            self._longest_clear[address] = max(self.longest_clear(address), clear.length)
            self._tell(Notice.CLEAR_PERHAPS if clear.is_blurred else Notice.CLEAR, address, no, frame.start)

    def _unanswered(self, time: int) -> None:
        """The open request was not answered."""
        if self._asked is None:
            return
        (asked, service, end), self._asked = self._asked, None
        if service is Service.FDL_STATUS:
            self._wasted += min(max(0, time - end), self._slot)
        elif asked.destination is not None:
            self.slaves.setdefault(asked.destination, SlaveView()).missed(time)
