"""A Modbus master for a virtual bus: it asks in turn, waits, repeats, goes on. Octets and times in, and out.

    PollingMaster([read_holding(1, 0x2520, 1)], LineSettings.parse("19200,8E1"))

It implements `dissectors.simulated.Station`, and speaks RTU, or ASCII when told so. Requests are unit and PDU as
octets; the envelope is put on last.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence

from dissectors.line import MS, LineSettings
from dissectors.modbus.envelope import seal_ascii, seal_rtu, unseal
from dissectors.modbus.functions import BROADCAST, EXCEPTION_BIT
from dissectors.simulated import Send


def read_holding(unit: int, start: int, quantity: int) -> bytes:
    """A request as unit and PDU: function 3."""
    return struct.pack(">BBHH", unit, 3, start, quantity)


def write_register(unit: int, address: int, value: int) -> bytes:
    """A request as unit and PDU: function 6."""
    return struct.pack(">BBHH", unit, 6, address, value)


def write_registers(unit: int, start: int, values: Sequence[int]) -> bytes:
    """A request as unit and PDU: function 16."""
    return struct.pack(f">BBHHB{len(values)}H", unit, 16, start, len(values), 2 * len(values), *values)


Request = bytes | Callable[[int], bytes]
"""Unit and PDU, or what gives them at the time (ns) of asking."""


class PollingMaster:
    """Asks in turn, for ever: one request, its answer or the timeout, repeats, a pause, the next one.

    `interval`: ns from the begin of one round to the next (a round that takes longer is followed at once).
    `pause`: ns from an answer to the next request. `timeout`: ns from the end of a request. `retries`: how often an
    unanswered request is repeated. `turnaround`: ns of pause after a broadcast.
    """

    def __init__(
        self,
        requests: Sequence[Request],
        line: LineSettings,
        *,
        is_ascii: bool = False,
        start: int = 0,
        interval: int = 1_000 * MS,
        pause: int = 10 * MS,
        timeout: int = 500 * MS,
        retries: int = 2,
        turnaround: int = 100 * MS,
    ) -> None:
        if not requests:
            raise ValueError("a master needs at least one request")
        self.requests = tuple(requests)
        self.line = line
        self.is_ascii = is_ascii
        self.interval, self.pause, self.timeout = interval, pause, timeout
        self.retries, self.turnaround = retries, turnaround
        self.answered = self.excepted = self.failed = self.repeated = 0
        self._round = start  # when this round began
        self._turn = 0  # which request is next, or under way
        self._attempt = 0
        self._asked: bytes | None = None  # unit and PDU of the request under way
        self._wake: int | None = start

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        """Take an answer: the first good frame from the unit asked ends the request."""
        answer = unseal(octets, self.is_ascii)
        asked = self._asked
        if asked is None or answer is None or answer[0] != asked[0] or answer[1] & ~EXCEPTION_BIT != asked[1]:
            return ()
        if answer[1] & EXCEPTION_BIT:
            self.excepted += 1
        else:
            self.answered += 1
        self._go_on(now + self.pause)
        return ()

    def wake(self, now: int) -> tuple[Send, ...]:
        """Ask, or give up."""
        if self._wake is None or now < self._wake:
            return ()
        if self._asked is not None:
            if self._attempt > self.retries or self._asked[0] == BROADCAST:
                self.failed += self._asked[0] != BROADCAST
                self._go_on(now)
                if self._wake > now:
                    return ()
            else:
                self.repeated += 1
        if self._asked is None:
            request = self.requests[self._turn]
            self._asked = request(now) if callable(request) else request
        self._attempt += 1
        octets = seal_ascii(self._asked) if self.is_ascii else seal_rtu(self._asked)
        wait = self.turnaround if self._asked[0] == BROADCAST else self.timeout
        self._wake = now + len(octets) * self.line.char + wait
        return (Send(now, octets),)

    def next_wake(self) -> int | None:
        """When it will ask or give up next, ns."""
        return self._wake

    def _go_on(self, at: int) -> None:
        """On to the next request, not before `at`; after the last one, to the next round."""
        self._asked, self._attempt = None, 0
        self._turn += 1
        if self._turn == len(self.requests):
            self._turn = 0
            self._round = max(self._round + self.interval, at)
            at = self._round
        self._wake = at
