"""Pairing N2 commands and answers. An answer carries no address, so only order, form and time tell whose it is.

1. One master, one open command. A good answer belongs to the open one, unless it rather answers one before it that had
   none: it has a form that the open one does not ask for and the one before does, or comes sooner than the station of
   the open one ever answered, or that station was never heard and the one before is there. Then it is late, and the
   open command stays open.
2. A damaged answer leaves the command open: it may have been junk, and a good one come yet. So damage alone is never a
   second answer.
3. A command closes the one before it: no response, or a damaged answer where one came, or octets that may be one.
4. The same octets again, at once, are an echo; so they are where the commands before came twice as far apart, sooner
   than any master repeats, and were answered then (`relay.py`). Within GIVE_UP of the unanswered try, with no other
   command between, they are a retry.
5. A second good answer without a command between: late where a command a short while ago is owed one of that form (of
   the two answers either may be the late one), or was damaged or had a damaged answer, else answered twice. A short
   while: some times as long as the master waited for it. Of a station that says things twice, the same octets at once
   are no other station's late answer. Whether that means two stations is for the rules to say: the same octets again
   may be a repeater's. Where there is room for a command that was missed at this tap, it answers that one, unasked,
   unless a try of the command answered before it is owed one; a station that has answered four later commands owes
   nothing any more.
6. How long a master waits is its own setting (NAE 250 ms to 3 s), so silence alone closes a command after GIVE_UP.
7. A damaged command is for the station that it names where that one is known; else for the one known station whose
   address makes its checksum right, and is most like what was sent.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Mapping
from dataclasses import replace

from dissectors.frame import Event, Frame, Header, Noise, Reason, Role
from dissectors.line import Timing
from dissectors.n2.commands import parse_command
from dissectors.n2.exchange import GIVE_UP, Exchange, best_owed, closed_exchange
from dissectors.n2.forms import may_answer
from dissectors.n2.header import BROADCAST, meant
from dissectors.n2.known import KnownStations
from dissectors.n2.masters import HASTE
from dissectors.n2.relay import Relay
from dissectors.n2.station_times import FEW, StationTimes
from dissectors.n2.stretch import STRAY
from dissectors.tracker import Interval, Placement, Tracked, Transaction, Verdict

Row = tuple[int, Frame, Header]
"""Number, frame and header."""

ACKNOWLEDGED = b"A\r"  # which answers most commands alike
_LONGEST = 256  # characters of an answer that may have begun in time and not be read yet
_SHORTEST = 7  # characters of a command
_OWING = 16  # commands remembered that a late answer may still answer
_DOUBLES = 2  # answers given twice by a station that make it its habit


class N2Tracker:
    """Gives each frame of a bus its transaction, and each transaction its verdict."""

    def __init__(self, timing: Timing) -> None:
        self._latency = timing.latency
        self._char = timing.char
        self._at_once = max(timing.t35, timing.char + min(timing.latency, HASTE))  # a repeat comes later
        self._next = 1
        self._open: Exchange | None = None
        self._missed: Exchange | None = None  # the last command, closed without a good answer
        self._owing: deque[Exchange] = deque(maxlen=_OWING)  # commands without a good answer, oldest first
        self._done: Exchange | None = None  # the last command, when it was closed by an answer
        self._known = KnownStations()
        self._times: dict[int, StationTimes] = {}  # by station
        self._doubles: Counter[int | None] = Counter()  # answers given twice, octet for octet, by station
        self._pause: int | None = None  # ns, the shortest between an answer and the next command
        self._relay = Relay(max(timing.t35, 2 * timing.char + timing.latency))

    def track(self, no: int, event: Event, header: Header | None) -> Tracked:
        """Take the next event; `header` is None exactly for noise."""
        if header is None or isinstance(event, Noise):
            self._hear_noise(event)
            return Tracked()
        closed: list[Transaction] = []
        if self._open is not None and event.start - self._open.end > GIVE_UP:
            closed.append(self._close_unanswered(self._open))
        if meant(event)[:1] == b">":
            placement = self._command(no, event, header, closed)
        else:
            placement = self._answer(no, event, header, closed)
        return Tracked(placement, tuple(closed))

    def advance(self, now: int) -> tuple[Transaction, ...]:
        """Say that nothing came up to `now` (ns); give the transactions that this closes."""
        if self._open is None or now - self._open.end <= GIVE_UP + self._latency + _LONGEST * self._char:
            return ()
        return (self._close_unanswered(self._open),)

    def close(self) -> tuple[Transaction, ...]:
        """End of capture: what is open stays so."""
        if self._open is None:
            return ()
        left, self._open = self._open, None
        return (left.bad or closed_exchange(left, Verdict.OPEN),)

    # --- exchanges that go by without it (`block_pairing.py`) ---

    @property
    def is_at_rest(self) -> bool:
        """Whether nothing is open, and the last command was answered: then only what is known of times matters."""
        return self._open is None and self._missed is None

    @property
    def next_id(self) -> int:
        """The number of the next transaction."""
        return self._next

    def known_times(self, station: int) -> tuple[int, int]:
        """How many answers of a station came, and the shortest time that one may have taken, ns."""
        times = self._times.get(station)
        return (0, 0) if times is None else (times.count, times.least)

    def pass_by(
        self,
        count: int,
        times: Mapping[int, tuple[int, int]],
        first: int,
        pause: int | None,
        asked: Row,
        answered: Frame,
    ) -> None:
        """Take `count` answered exchanges that followed one another.

        `times`: by station, in the order of first being asked: as `known_times` gives them behind. `first`: ns, begin
        of the first command; `pause`: the shortest between two of the exchanges. `asked`: the last command, `answered`
        its answer.
        """
        self._see_pause(first)
        if pause is not None:
            self._pause = pause if self._pause is None else min(self._pause, pause)
        self._relay.forget()
        for station, (number, least) in times.items():
            self._known.add(station)
            self._times[station] = StationTimes(number, least)
        self._next += count
        no, frame, header = asked
        self._done = Exchange(
            id=self._next - 1,
            no=no,
            octets=frame.octets,
            station=header.destination,
            kind=header.kind,
            start=frame.start,
            end=frame.end,
            slack=frame.slack,
            attempt=1,
            of=None,
            damaged=False,
            answer=answered.octets,
            answer_end=answered.end,
        )

    # --- commands ---

    def _command(self, no: int, frame: Frame, header: Header, closed: list[Transaction]) -> Placement:
        open_, octets = self._open, meant(frame)
        if open_ is not None and octets == open_.octets:
            again = frame.start - open_.end
            if again <= self._at_once or (not open_.echoed and self._relay.repeats_after(again)):
                open_.echoed = True
                return self._echo(no, frame, header.role, open_, closed)
        self._see_pause(frame.start)
        if open_ is not None:
            open_.waited = max(frame.start - open_.end, open_.waits)
            closed.append(self._close_unanswered(open_))
        station = header.destination if header.ok or frame.repair is not None else self._station_of(octets, header)
        if station is not None and header.ok:
            self._known.add(station)
        missed = self._missed
        attempt, of = 1, None
        gap: int | None = None
        if missed is not None and missed.octets == octets and frame.start - missed.end <= GIVE_UP:
            attempt, of, gap = missed.attempt + 1, missed.first_try, frame.start - missed.end
        self._open = Exchange(
            id=self._take_id(),
            no=no,
            octets=octets,
            station=station,
            kind=header.kind,
            start=frame.start,
            end=frame.end,
            slack=frame.slack,
            attempt=attempt,
            of=of,
            damaged=not header.ok,
            gap=gap,
        )
        self._done = None
        return Placement(no, self._open.id, header.role, None, station)

    def _see_pause(self, start: int) -> None:
        """A command begins: how long the master paused after the answer before, where that was the last thing heard."""
        if self._done is not None:
            pause = max(0, start - self._done.answer_end)
            self._pause = pause if self._pause is None else min(self._pause, pause)

    def _station_of(self, octets: bytes, header: Header) -> int | None:
        """Whom a damaged command is for (rule 7)."""
        named = header.destination
        if not len(self._known) or (named is not None and named in self._known):
            return named
        return self._known.most_like(octets)

    def _close_unanswered(self, exchange: Exchange) -> Transaction:
        self._open, self._missed, self._done = None, exchange, None
        if exchange.station != BROADCAST:
            exchange.known_answers = self._answers_of(exchange)
            self._owing.append(exchange)
        if exchange.bad is not None:
            return exchange.bad
        if exchange.spoilt:
            return closed_exchange(exchange, Verdict.DAMAGED_ANSWER, error="octets that are no frame")
        if exchange.damaged:
            return closed_exchange(exchange, Verdict.DAMAGED_REQUEST)
        if exchange.station == BROADCAST:
            return closed_exchange(exchange, Verdict.BROADCAST)
        return closed_exchange(exchange, Verdict.NO_RESPONSE)

    def _hear_noise(self, event: Event) -> None:
        """A few stray octets are nobody's answer; more, or what ends like one, may be."""
        octets = event.octets
        if len(octets) > STRAY:
            self._done = None  # it may have been a command
        if self._open is None or not isinstance(event, Noise) or event.reason is Reason.PAD:
            return
        self._open.spoilt |= len(octets) > STRAY or (len(octets) > 1 and octets.endswith(b"\r"))

    # --- answers ---

    def _answer(self, no: int, frame: Frame, header: Header, closed: list[Transaction]) -> Placement:
        open_ = self._open
        if open_ is None:
            return self._orphan(no, frame, header, closed)
        if not header.ok:
            bad = closed_exchange(open_, Verdict.DAMAGED_ANSWER, error=header.error)
            open_.bad = replace(bad, response=no, end=frame.end, latency=self._since(open_, frame))
            return Placement(no, open_.id, Role.RESPONSE, open_.station, None)
        owing = self._owed_rather(open_, frame)
        if owing is not None:
            self._forget(owing)
            open_.waits = max(open_.waits, owing.waited)
            return self._separate(no, frame, header, Verdict.LATE, owing, closed)
        missed = self._missed
        perhaps_late = missed is not None and missed.is_owed and missed.station != open_.station
        self._open, self._missed, self._done = None, None, open_
        open_.answer, open_.answer_end = frame.octets, frame.end
        if not open_.echoed:
            self._relay.see_answered(open_.attempt, open_.gap)
        latency = self._since(open_, frame)
        verdict = Verdict.ANSWERED if open_.attempt == 1 else Verdict.RETRY
        if open_.damaged:
            verdict = Verdict.DAMAGED_REQUEST
        if header.kind == "negative-acknowledge":
            verdict = Verdict.EXCEPTION
        if open_.station is not None and open_.station in self._known and not perhaps_late:
            self._times.setdefault(open_.station, StationTimes()).add(latency)
        done = closed_exchange(open_, verdict, error=header.error)
        closed.append(replace(done, response=no, end=frame.end, latency=latency))
        return Placement(no, open_.id, Role.RESPONSE, open_.station, None)

    def _owed_rather(self, open_: Exchange, frame: Frame) -> Exchange | None:
        """An earlier command, to another station or of another form, that a good answer rather answers (rule 1)."""
        asked = parse_command(open_.octets)
        formless = not open_.damaged and not may_answer(asked, frame.octets)
        times = self._times.get(open_.station) if open_.station is not None else None
        latest = self._since(open_, frame).high
        soon = times is not None and times.count >= FEW and 2 * latest < times.least
        if not (formless or soon or self._is_anothers(open_)):
            return None
        candidates = [e for e in self._within(frame.start) if e.is_owed and (e.octets != open_.octets or not formless)]
        if self._missed is not None and self._missed not in candidates and self._missed.bad is None:
            candidates.append(self._missed)
        same = [exchange for exchange in candidates if exchange.station == open_.station]
        return best_owed(same, frame) or self._best(candidates, frame)

    def _is_anothers(self, open_: Exchange) -> bool:
        """Whether it is to a station never heard, and the one before it to one that is there and owes an answer."""
        missed = self._missed
        if missed is None or missed.station == open_.station or not missed.is_owed or open_.station in self._times:
            return False
        return missed.station in self._times

    def _within(self, now: int) -> list[Exchange]:
        """Commands that had no good answer and may still get one: a station answers in order."""
        return [
            exchange
            for exchange in self._owing
            if now - exchange.end <= exchange.owed_for and self._answers_of(exchange) - exchange.known_answers <= 3
        ]

    def _answers_of(self, exchange: Exchange) -> int:
        """How many answers of its station came so far."""
        return 0 if exchange.station is None else self.known_times(exchange.station)[0]

    def _has_room(self, done: Exchange, frame: Frame) -> bool:
        """Whether a command that was missed at this tap fits between the last answer and this one."""
        if self._pause is None:
            return False
        room = max(0, self._pause - self._latency) + _SHORTEST * self._char
        soonest = 0 if done.station is None else self.known_times(done.station)[1]
        return frame.start - done.answer_end >= room + soonest // 2

    def _says_again(self, done: Exchange, frame: Frame) -> bool:
        """Whether an answer says what the one before it said, sooner than a command surely fits between."""
        room = (self._pause or 0) + self._latency + _SHORTEST * self._char
        says_much = frame.octets != ACKNOWLEDGED or self._doubles[done.station] >= _DOUBLES
        return says_much and frame.octets == done.answer and frame.start - done.answer_end < room

    def _forget(self, exchange: Exchange) -> None:
        if self._missed is exchange:
            self._missed = None
        self._owing = deque((other for other in self._owing if other is not exchange), _OWING)

    def _orphan(self, no: int, frame: Frame, header: Header, closed: list[Transaction]) -> Placement:
        """An answer that no open command asked for."""
        done, missed = self._done, self._missed
        if not header.ok:
            station = done.station if done is not None else missed.station if missed is not None else None
            return self._separate(no, frame, header, Verdict.UNSOLICITED, None, closed, station)
        again = done is not None and self._says_again(done, frame)
        if done is not None and not again and self._has_room(done, frame):
            tries = [one for one in self._within(frame.start) if one.first_try == done.first_try]
            owing = best_owed(tries, frame)  # each try of one command has its answer
            if owing is None:
                return self._separate(no, frame, header, Verdict.UNSOLICITED, None, closed)
            self._forget(owing)
            return self._separate(no, frame, header, Verdict.LATE, owing, closed)
        if done is not None:
            owed = [] if again and self._doubles[done.station] >= _DOUBLES else self._within(frame.start)
            same = [exchange for exchange in owed if exchange.station == done.station]
            owing = best_owed(same, frame) or self._best(owed, frame) or self._crossed(owed, done, frame)
            owing = owing or next((exchange for exchange in owed if not exchange.is_owed), None)
            if owing is not None:
                self._forget(owing)
                return self._separate(no, frame, header, Verdict.LATE, owing, closed)
            at_once = frame.octets == done.answer and frame.start - done.answer_end <= self._at_once
            self._doubles.update([done.station] * (again or at_once))
            everybody = len(self._doubles) > 1 and self._times.keys() <= self._doubles.keys()
            if at_once and (done.echoed or everybody):  # the bus does so
                return self._echo(no, frame, Role.RESPONSE, done, closed)
            if frame.start - done.end <= GIVE_UP and may_answer(parse_command(done.octets), frame.octets):
                return self._separate(no, frame, header, Verdict.ANSWERED_TWICE, done, closed)
        elif missed is not None and frame.start - missed.end <= 2 * GIVE_UP:
            self._forget(missed)
            return self._separate(no, frame, header, Verdict.LATE, missed, closed)
        return self._separate(no, frame, header, Verdict.UNSOLICITED, None, closed)

    def _crossed(self, owed: list[Exchange], done: Exchange, frame: Frame) -> Exchange | None:
        """A command that the answer before this one rather answered, if this one may answer the last command."""
        if not may_answer(parse_command(done.octets), frame.octets):
            return None
        return self._best(owed, replace(frame, octets=done.answer))

    def _best(self, owed: list[Exchange], frame: Frame) -> Exchange | None:
        """The command that an answer belongs to: rather one to a station that is heard than to one that hardly was."""
        return best_owed([one for one in owed if self._answers_of(one) >= FEW], frame) or best_owed(owed, frame)

    def _separate(
        self,
        no: int,
        frame: Frame,
        header: Header,
        verdict: Verdict,
        to: Exchange | None,
        closed: list[Transaction],
        station: int | None = None,
    ) -> Placement:
        """A transaction of its own for an answer that came too late, twice or unasked."""
        station = to.station if to else station
        transaction = Transaction(
            id=self._take_id(),
            station=station,
            kind=to.kind if to else header.kind,
            request=None,
            response=no,
            verdict=verdict,
            start=frame.start,
            end=frame.end,
            latency=self._since(to, frame) if to and verdict is Verdict.LATE else None,
            of=to.id if to else None,
            error=header.error,
        )
        closed.append(transaction)
        return Placement(no, transaction.id, Role.RESPONSE, station, None)

    def _echo(self, no: int, frame: Frame, role: Role, of: Exchange, closed: list[Transaction]) -> Placement:
        request, response = (None, no) if role is Role.RESPONSE else (no, None)
        source, destination = (of.station, None) if role is Role.RESPONSE else (None, of.station)
        echo = Transaction(
            id=self._take_id(),
            station=of.station,
            kind=of.kind,
            request=request,
            response=response,
            verdict=Verdict.ECHO,
            start=frame.start,
            end=frame.end,
            of=of.id,
        )
        closed.append(echo)
        return Placement(no, echo.id, role, source, destination)

    def _since(self, exchange: Exchange, frame: Frame) -> Interval:
        """Time from the end of a command to the begin of an answer."""
        nominal = frame.start - exchange.end
        return Interval(nominal, max(0, nominal - self._latency), max(0, nominal + exchange.slack))

    def _take_id(self) -> int:
        self._next += 1
        return self._next - 1
