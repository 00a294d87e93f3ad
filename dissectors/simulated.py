"""The contract of a simulated station: octets and times in, octets and times out. It touches no port, reads no clock.

A virtual bus carries stations of any protocol. Whoever drives them (the pseudo-terminal bus, or a test with a list of
events) keeps the clock and the line; a station only decides what it would say and when.

    bus                                   station
    a burst of another party ended  ───►  hear(now, octets, quiet)  ───►  what it will send in answer
    the time it asked for has come  ───►  wake(now)                 ───►  what it will send by itself
    when must I wake you?           ───►  next_wake()               ───►  a time, or None

Rules for both sides:

1. All times are int ns on one clock of the bus; it never runs backwards.
2. The bus calls `wake` at or after `next_wake()`, late rather than early, and asks `next_wake()` again after every
   `hear` and `wake`. A station that is woken too early sends nothing and keeps its timer.
3. A `Send` is a promise: it is put on the line at `at` (or as soon after as the driver can), whole, in the order given,
   whatever else is there by then; two stations that talk at once collide, which is for the bus to show.
4. A station does not hear itself. The end of its own transmission is `at` plus the line time of its octets.
5. Both calls are total: any octets, any times, no exception.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from dissectors.line import LineSettings, Timing
from dissectors.quick_values import quickly_made
from dissectors.simulated_faults import Fault


@quickly_made
@dataclass(frozen=True, slots=True)
class Send:
    """One transmission: `octets` back to back, their first begins at `at` (ns, the bus's clock). Never empty."""

    at: int
    octets: bytes


class Station(Protocol):
    """A party on a virtual bus: a server, a master that polls, a token-passing node."""

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        """Take a whole burst that another party transmitted; give what to send because of it (`at` >= `now`).

        `now`: ns, end of its last octet. `quiet`: whether it stood alone: silence before it as the protocol's framing
        wants it, and nothing ran into it. When False, `octets` is what a receiver on the line would have got.
        """
        ...

    def wake(self, now: int) -> tuple[Send, ...]:
        """Say that `now` (ns) has come; give what to send."""
        ...

    def next_wake(self) -> int | None:
        """When to call `wake` next (ns), or None to wait for traffic only. A time in the past means at once."""
        ...


@dataclass(frozen=True, slots=True)
class Party:
    """Somebody on the bus. `answers`: speaks only when asked, so "lost response" and the like can strike it."""

    name: str
    station: Station
    answers: bool = True


def no_gap(timing: Timing) -> int:
    """The silence before a frame of a protocol that wants none."""
    return 0


@dataclass(frozen=True, slots=True)
class SimulatedBus:
    """A bus to listen to in demonstrations and tests: who is on it and what usually goes wrong there.

    `parties(line, faults)`: makes them afresh for each run, in any process, so it is a function of a module (or a
    `partial` of one); `faults`: whether stations may misbehave, too. `line`: the settings of this bus; where empty, the
    protocol's usual ones. `gap`: ns of silence that the framing wants before a frame. `devices`: device profiles by
    address. `text`: who is there, in a line for people; `misbehaving`: what `faults` adds to it.
    """

    parties: Callable[[LineSettings, bool], Sequence[Party]]
    text: str = ""
    misbehaving: str = ""
    line: str = ""
    faults: tuple[Fault, ...] = ()
    gap: Callable[[Timing], int] = no_gap
    devices: Mapping[int, str] = field(default_factory=dict)
