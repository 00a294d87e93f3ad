"""A half-duplex pair in simulated time: parties transmit, what overlaps collides, faults strike by seed.

Pure and discrete: time is whatever the caller says, nothing sleeps. The same `Wire` runs an hour in seconds
(`run`), or in step with a clock (`advance`, `on_line`), which is what the pseudo-terminal bus does.

A *burst* is a stretch in which the line was busy without pause: one transmission, or several that ran into each
other. Every transmission that was ever wanted stands in exactly one burst's `sent`, with what became of it: that is the
ground truth a test compares a capture with.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from heapq import heappop, heappush
from random import Random

from dissectors.frame import LineError, Mark
from dissectors.line import LineSettings
from dissectors.quick_values import quickly_made
from dissectors.simulated import Party as Party
from dissectors.simulated import Send
from dissectors.simulated_faults import NOISE, Fault, Transmission
from sniff.simulation.collision import ReceivedOctets, low_times, receive


@quickly_made
@dataclass(frozen=True, slots=True)
class Sent:
    """One transmission: what its party meant, and what became of it.

    `start`, `end`: ns, when its driver held the line (equal where it never reached it). `faults`: names of those that
    struck it, "collision" among them. `intact`: every receiver got exactly `octets`; it may still have been late, or
    have noise directly beside it.
    """

    party: str
    start: int
    end: int
    octets: bytes
    intact: bool = True
    faults: tuple[str, ...] = ()


@quickly_made
@dataclass(frozen=True, slots=True)
class Burst:
    """What the line carried between two silences. Empty `octets`: nothing, the transmission in `sent` was lost.

    `start`, `end`: ns. `ends`: end of each octet, ns, ascending. `marks`: what a UART that reports everything says.
    """

    start: int
    end: int
    octets: bytes
    ends: Sequence[int]
    marks: tuple[Mark, ...]
    sent: tuple[Sent, ...]


class Wire:
    """The pair and those on it.

    `gap`: ns of silence that the protocol's framing wants before a frame (`Station.hear`, `quiet`); 0 for none.
    `faults` strike every transmission in the order given. The same stations, faults and `seed` give the same run.
    """

    def __init__(
        self,
        line: LineSettings,
        parties: Sequence[Party] = (),
        faults: Sequence[Fault] = (),
        seed: int = 0,
        gap: int = 0,
        start: int = 0,
    ) -> None:
        self.line = line
        self.now = start
        self._parties = tuple(parties)
        self._seed = seed
        self.switch(faults)
        self._gap = gap
        self._coming: list[tuple[int, int, Transmission]] = []  # a heap by start
        self._count = 0
        self._busy_until: dict[str, int] = {}  # of each party's own driver
        self._current: list[Transmission] = []  # those in the burst now on the line
        self._current_end = 0
        self._received: ReceivedOctets | None = None
        self._quiet_since = start - 86_400 * 1_000_000_000
        self._wakes: list[int | None] = [party.station.next_wake() for party in self._parties]

    def send(self, party: str, at: int, octets: bytes, answers: bool = False, linger: int = 0) -> None:
        """Transmit for a party that is no `Station`: from `at` (ns, not before `now`) on.

        `linger`: ns for which the burst stays open after its end, because more of it may come with another call.
        """
        if octets:
            self._plan(Transmission(party, max(at, self.now), octets, octets, answers, linger=linger))

    def next_event(self) -> int | None:
        """When something will happen by itself next (ns): a transmission begins or ends, a station wakes."""
        times = [wake for wake in self._wakes if wake is not None]
        if self._coming:
            times.append(self._coming[0][0])
        if self._current:
            times.append(self._closes())
        return max(self.now, min(times)) if times else None

    def advance(self, now: int) -> list[Burst]:
        """Let everything happen up to and including `now` (ns); give the bursts that ended."""
        bursts: list[Burst] = []
        while (time := self.next_event()) is not None and time <= now:
            self.now = time
            bursts.extend(self._step(time))
        self.now = max(self.now, now)
        return bursts

    def run(self, until: int) -> Iterator[Burst]:
        """Run as fast as it goes up to `until` (ns)."""
        while (time := self.next_event()) is not None and time <= until:
            self.now = time
            yield from self._step(time)
        self.now = max(self.now, until)

    def on_line(self) -> ReceivedOctets | None:
        """The burst now on the line as receivers will have got it if nothing more runs into it; None in silence.

        Octets whose end has passed do not change any more.
        """
        if not self._current:
            return None
        if self._received is None:
            self._received = self._mix()
        return self._received

    def switch(self, faults: Sequence[Fault]) -> None:
        """From now on these faults strike."""
        self._faults = [(fault, Random(f"{self._seed} {place} {fault.name}")) for place, fault in enumerate(faults)]

    def silent_since(self, now: int) -> int | None:
        """When the last transmission ended (ns); None while there is one."""
        if not self._current:
            return self._quiet_since
        return self._current_end if self._current_end <= now else None

    def senders(self) -> frozenset[str]:
        """Who takes part in the burst now on the line."""
        return frozenset(sent.party for sent in self._current)

    def _step(self, time: int) -> list[Burst]:
        """Do all that is due at `time`: ends first, so that back to back is no collision; then wakes, then begins."""
        bursts: list[Burst] = []
        if self._current and self._closes() <= time:
            bursts.append(self._close())
        for index, wake in enumerate(self._wakes):
            if wake is not None and wake <= time:
                station = self._parties[index].station
                self._answer(index, station.wake(time))
                again = station.next_wake()
                # One that asks for a time already past has had its call; it is woken again, but the line goes on.
                self._wakes[index] = again if again is None or again > time else time + self.line.char
        while self._coming and self._coming[0][0] <= time:
            bursts.extend(self._begin(heappop(self._coming)[2]))
        return bursts

    def _begin(self, sent: Transmission) -> list[Burst]:
        busy = self._busy_until.get(sent.party, 0)
        if sent.start < busy and sent.party != NOISE:  # one driver sends one thing after the other
            self._push(replace(sent, start=busy))
            return []
        if not sent.octets:
            return [Burst(sent.start, sent.start, b"", (), (), (self._truth(sent, False),))]
        closed: list[Burst] = []
        if self._current and sent.start >= self._current_end and sent.party != self._current[-1].party:
            closed.append(self._close())  # it lingered for more of the same
        end = sent.end(self.line)
        self._busy_until[sent.party] = end
        self._current.append(sent)
        self._current_end = max(end, self._current_end) if len(self._current) > 1 else end
        self._received = None
        return closed

    def _closes(self) -> int:
        return self._current_end + self._current[-1].linger

    def _close(self) -> Burst:
        """The burst on the line has ended: tell the parties, and say what it was."""
        received = self.on_line()
        assert received is not None
        current, end = self._current, self._current_end
        self._current, self._received = [], None
        start = current[0].start
        quiet = start - self._quiet_since >= self._gap and not _overlap(current, self.line)
        self._quiet_since = end
        senders = {sent.party for sent in current}
        for index, party in enumerate(self._parties):
            if party.name not in senders and received.octets:
                self._answer(index, party.station.hear(self.now, received.octets, quiet))
                self._wakes[index] = party.station.next_wake()
        return Burst(start, end, received.octets, received.ends, received.marks, self._truths(current, received))

    def _answer(self, index: int, sends: Sequence[Send]) -> None:
        party = self._parties[index]
        for send in sends:
            if send.octets:
                at = send.at if send.at > self.now else self.now
                self._plan(Transmission(party.name, at, send.octets, send.octets, party.answers))

    def _plan(self, sent: Transmission) -> None:
        """Let the faults strike, and put what is left of it on the agenda."""
        struck: tuple[Transmission, ...] = (sent,)
        for fault, dice in self._faults:
            if len(struck) == 1:  # the usual case, and the one that must be quick
                struck = fault.strike(struck[0], self.now, self.line, dice)
                continue
            results: list[Transmission] = []
            for one in struck:
                results += (one,) if one.party == NOISE else fault.strike(one, self.now, self.line, dice)
            struck = tuple(results)
        for one in struck:
            self._push(one)

    def _push(self, sent: Transmission) -> None:
        self._count += 1
        heappush(self._coming, (sent.start, self._count, sent))

    def _mix(self) -> ReceivedOctets:
        """What receivers get: each octet in its place while the drivers keep apart, else bits mixed in time."""
        line = self.line
        if _overlap(self._current, line) or any(sent.held for sent in self._current):
            lows = []
            for sent in self._current:
                if sent.held:
                    lows.append((sent.start, sent.start + sent.held))
                else:
                    lows += low_times(line, sent.start, sent.octets, dict(sent.flips))
            return receive(line, lows)
        if len(self._current) == 1:
            return _alone(line, self._current[0])
        parts = [_alone(line, sent) for sent in self._current]
        marks: list[Mark] = []
        offset = 0
        for part in parts:
            marks += [Mark(offset + mark.offset, mark.error) for mark in part.marks]
            offset += len(part.octets)
        return ReceivedOctets(b"".join(p.octets for p in parts), [end for p in parts for end in p.ends], tuple(marks))

    def _truths(self, current: Sequence[Transmission], received: ReceivedOctets) -> tuple[Sent, ...]:
        if len(current) == 1:
            return (self._truth(current[0], received.octets == current[0].meant),)
        collided = _overlap(current, self.line)
        truths = []
        for sent in current:
            if collided and any(_overlap((sent, other), self.line) for other in current if other is not sent):
                truths.append(self._truth(sent.hit("collision"), self._survived(sent, received)))
            else:
                truths.append(self._truth(sent, _alone(self.line, sent).octets == sent.meant))
        return tuple(truths)

    def _survived(self, sent: Transmission, received: ReceivedOctets) -> bool:
        """Whether a transmission came through a collision: all its octets, right and in step, between others or not."""
        first = bisect_left(received.ends, sent.start + self.line.char)
        count = len(sent.meant)
        ends = range(sent.start + self.line.char, sent.end(self.line) + 1, self.line.char)
        return received.octets[first : first + count] == sent.meant and [*received.ends[first : first + count]] == [
            *ends
        ]

    def _truth(self, sent: Transmission, intact: bool) -> Sent:
        return Sent(sent.party, sent.start, sent.end(self.line), sent.meant, intact, sent.faults)


def _alone(line: LineSettings, sent: Transmission) -> ReceivedOctets:
    """A transmission that nothing ran into."""
    char = line.char
    first = sent.start + char
    ends = range(first, first + len(sent.octets) * char, char)
    whole = (1 << line.data_bits) - 1
    if not sent.flips:
        octets = sent.octets if line.data_bits == 8 else bytes(octet & whole for octet in sent.octets)
        return ReceivedOctets(octets, ends, ())
    changed = bytearray(octet & whole for octet in sent.octets)
    marks: list[Mark] = []
    for offset, mask in sorted(sent.flips.items()):
        if offset < len(changed):
            changed[offset] ^= mask & whole
            seen = mask if line.parity in "EO" else mask & ~whole  # mark and space parity say nothing of the data
            if line.parity != "N" and seen.bit_count() & 1:
                marks.append(Mark(offset, LineError.PARITY))
    return ReceivedOctets(bytes(changed), ends, tuple(marks))


def _overlap(current: Sequence[Transmission], line: LineSettings) -> bool:
    if len(current) == 1:
        return False
    end = current[0].end(line)
    for sent in current[1:]:
        if sent.start < end:
            return True
        end = max(end, sent.end(line))
    return False


Factory = Callable[[], Sequence[Party]]
"""Makes fresh stations for one run; a module-level function, so that another process can call it too."""
