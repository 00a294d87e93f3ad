"""Signs of a second master: what no single one would do.

A command that no answer followed says little: a master may be impatient, its answer may not have been heard here. So
only this counts:

- a command that begins in the middle of another one, without the silence of a master that gave up
- a command that follows another one sooner than the station asked ever answered, and than any master gives up
- an answer that came in its usual time, and yet after the next command
- damaged commands, far more often than elsewhere, where the answer to the one before is due: two spoke at once
- commands behind others with nothing between, most of them sooner than the master goes on behind an answer: what an
  adapter does to a time it does to both
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Final

from dissectors.chances import at_least
from dissectors.findings import Tally
from dissectors.frame import Damage, Frame
from dissectors.n2.commands import Command
from dissectors.n2.header import BROADCAST
from dissectors.n2.record import N2StationRecord
from dissectors.tracker import Transaction

HASTE: Final = 100_000_000
"""No master gives up sooner, ns (the shortest timeout of an NAE is 250 ms)."""

KNOWN: Final = 8
"""Answers of a station after which its shortest time says something."""

_NEXT_KEPT = 64
_NEXT_LEAST = 5
_SELDOM = 0.002

_BEGIN = 3  # octets of a command: start and address
_SAME = 6  # octets of two commands: start, address, command and what it asks


@dataclass(frozen=True, slots=True)
class OpenCommand:
    """The command of an open transaction."""

    row: int
    frame: Frame
    command: Command


@dataclass(slots=True)
class Masters:
    """Fed the commands; `seen` counts what one master would not do, `damaged` damaged commands to others that came
    before a master gives up. `char`: ns that a character takes."""

    char: int
    seen: Tally = field(default_factory=Tally)
    damaged: Tally = field(default_factory=Tally)
    _last: OpenCommand | None = None  # the newest command, while nothing has come after it
    _next: deque[tuple[int, OpenCommand, OpenCommand]] = field(default_factory=lambda: deque(maxlen=_NEXT_KEPT))
    # ns between good commands to others, of which the first had no answer

    def see_other(self) -> None:
        """Something that is no command came, or may have come."""
        self._last = None

    def see_command(self, asked: OpenCommand, station: N2StationRecord | None) -> None:
        """Take a command; `station`: that of the command before."""
        last, self._last = self._last, asked
        if last is None:
            return
        frame = last.frame
        longest = asked.frame.start - (frame.end - frame.slack)
        if longest >= HASTE:
            return
        if frame.damage is Damage.RESTARTED and asked.frame.ok and frame.repair is None:
            self.seen.add(asked.frame.start, last.row, asked.row)  # one flipped bit makes a `6` a `>`: it must be good
            return
        if not frame.ok or last.command.address == BROADCAST:
            return
        if frame.end - frame.start > 2 * len(frame.octets) * self.char + frame.slack:
            return  # a silence is in it: behind an echo that was cut short an `A` is its check by chance
        if frame.octets[:_SAME] == asked.frame.octets[:_SAME]:  # a repeat, or an echo that something ran into
            return
        if station is None or station.quickest is None or station.answered < KNOWN:
            return
        if asked.frame.ok:
            self._next.append((max(0, asked.frame.start - frame.end), last, asked))
        if longest < station.quickest:
            self.seen.add(asked.frame.start, last.row, asked.row)

    def sooner_than(self, pause: int | None) -> Tally:
        """The commands that came sooner than a pause of the master, than which three in four are longer, where so many
        did so as no chance makes of answers that were not heard; else none."""
        soon = Tally()
        for gap, last, asked in self._next if pause is not None else ():
            if pause is not None and gap < pause:
                soon.add(asked.frame.start, last.row, asked.row)
        is_chance = soon.count < _NEXT_LEAST or at_least(soon.count, len(self._next), 1 / 4) >= _SELDOM
        return Tally() if is_chance else soon

    def see_damaged(self, last: OpenCommand, no: int, frame: Frame) -> None:
        """Take a damaged command, and the one before it, that nothing has come after."""
        is_at_once = frame.start - (last.frame.end - last.frame.slack) < HASTE
        is_echo = last.frame.octets[:_BEGIN] == frame.octets[:_BEGIN]
        if is_at_once and not is_echo and last.frame.ok and last.command.address != BROADCAST:
            self.damaged.add(frame.start, last.row, no)

    def see_late(self, transaction: Transaction, station: N2StationRecord) -> None:
        """Take an answer that came after the next command: directly behind that one, else the master had something that
        it took for the answer, a late one to its first try perhaps, and went on."""
        latency = transaction.latency
        if transaction.response != (transaction.request or 0) + 2:
            return
        if latency is not None and latency.high < HASTE and station.answered >= KNOWN:
            self.seen.add(transaction.start, transaction.response)

    @property
    def is_at_rest(self) -> bool:
        """Whether something has come after the newest command."""
        return self._last is None

    @property
    def newest(self) -> OpenCommand | None:
        """The newest command, while nothing has come after it."""
        return self._last

    @property
    def last_station(self) -> int | None:
        """Whom the newest command asked, while nothing has come after it."""
        return self._last.command.address if self._last is not None else None
