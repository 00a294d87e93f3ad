"""Stations and faults that misbehave in ways the simulation has no ready-made value for."""

from __future__ import annotations

from dataclasses import dataclass, replace
from random import Random
from typing import ClassVar

from dissectors.line import LineSettings
from dissectors.modbus.envelope import seal_ascii, seal_rtu, unseal
from dissectors.modbus.simulated import Bank, ModbusServer
from dissectors.n2.simulated import Follower
from dissectors.simulated import Send, Station
from dissectors.simulated_faults import Fault, Transmission

MS = 1_000_000


class Wrapped:
    """A station around another one; a subclass changes what it says."""

    def __init__(self, inner: Station) -> None:
        self.inner = inner

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        return self.change(now, octets, self.inner.hear(now, octets, quiet))

    def wake(self, now: int) -> tuple[Send, ...]:
        return self.inner.wake(now)

    def next_wake(self) -> int | None:
        return self.inner.next_wake()

    def change(self, now: int, octets: bytes, sends: tuple[Send, ...]) -> tuple[Send, ...]:
        return sends


class Dies(Wrapped):
    """Silent from a time on, and alive again after a while if `until` says so."""

    def __init__(self, inner: Station, at: int, until: int | None = None) -> None:
        super().__init__(inner)
        self.at, self.until = at, until

    def change(self, now: int, octets: bytes, sends: tuple[Send, ...]) -> tuple[Send, ...]:
        return () if now >= self.at and (self.until is None or now < self.until) else sends


class Drifts(Wrapped):
    """Answers later and later: `per_second` ns more for each second of the run."""

    def __init__(self, inner: Station, per_second: int) -> None:
        super().__init__(inner)
        self.per_second = per_second

    def change(self, now: int, octets: bytes, sends: tuple[Send, ...]) -> tuple[Send, ...]:
        more = now * self.per_second // 1_000_000_000
        return tuple(replace(send, at=send.at + more) for send in sends)


class Resets(Wrapped):
    """An N2 follower that loses power for a moment at a time."""

    def __init__(self, inner: Follower, at: int) -> None:
        super().__init__(inner)
        self.follower, self.at, self.done = inner, at, False

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        if now >= self.at and not self.done:
            self.follower.reset()
            self.done = True
        return super().hear(now, octets, quiet)


class Shows(ModbusServer):
    """A server whose holding registers are those of another one, but for some that show what they are told."""

    def __init__(self, inner: ModbusServer, values: dict[int, int]) -> None:
        super().__init__(inner.unit, _Shown(inner.holding, values), delay=inner.delay, functions=inner.functions)


@dataclass(frozen=True, slots=True)
class _Shown:
    bank: Bank
    values: dict[int, int]

    def read(self, address: int) -> int:
        return self.values[address] if address in self.values else self.bank.read(address)

    def write(self, address: int, value: int) -> None:
        self.bank.write(address, value)


class Ignores(Wrapped):
    """Does not answer one Modbus function."""

    def __init__(self, inner: Station, function: int, is_ascii: bool = False) -> None:
        super().__init__(inner)
        self.function, self.is_ascii = function, is_ascii

    def change(self, now: int, octets: bytes, sends: tuple[Send, ...]) -> tuple[Send, ...]:
        request = unseal(octets, self.is_ascii)
        return () if request is not None and request[1] == self.function else sends


class AnswersBroadcasts(Wrapped):
    """Repeats what was written to all, as if it had been asked alone; as `unit`, or with address 0."""

    def __init__(self, inner: Station, unit: int, delay: int = 8 * MS, is_ascii: bool = False) -> None:
        super().__init__(inner)
        self.unit, self.delay, self.is_ascii = unit, delay, is_ascii

    def change(self, now: int, octets: bytes, sends: tuple[Send, ...]) -> tuple[Send, ...]:
        request = unseal(octets, self.is_ascii)
        if request is None or request[0] != 0:
            return sends
        seal = seal_ascii if self.is_ascii else seal_rtu
        return (Send(now + self.delay, seal(bytes((self.unit,)) + request[1:])),)


class AnswersAs(Wrapped):
    """Puts another unit into its answers, or drops the last register of what was read."""

    def __init__(self, inner: Station, unit: int | None = None, drop: int = 0) -> None:
        super().__init__(inner)
        self.unit, self.drop = unit, drop

    def change(self, now: int, octets: bytes, sends: tuple[Send, ...]) -> tuple[Send, ...]:
        changed = []
        for send in sends:
            answer = unseal(send.octets, False) or b"\0\0"
            if self.unit is not None:
                answer = bytes((self.unit,)) + answer[1:]
            if self.drop and answer[1] == 3 and answer[2] > self.drop:
                answer = answer[:2] + bytes((answer[2] - self.drop,)) + answer[3 : -self.drop]
            changed.append(replace(send, octets=seal_rtu(answer)))
        return tuple(changed)


@dataclass(frozen=True, slots=True)
class Of:
    """A fault that strikes one party only."""

    party: str
    fault: Fault

    @property
    def name(self) -> str:
        return self.fault.name

    def strike(self, sent: Transmission, now: int, line: LineSettings, dice: Random) -> tuple[Transmission, ...]:
        return self.fault.strike(sent, now, line, dice) if sent.party == self.party else (sent,)


@dataclass(frozen=True, slots=True)
class OfLong:
    """A fault that strikes only what is longer than `over` octets."""

    over: int
    fault: Fault

    @property
    def name(self) -> str:
        return self.fault.name

    def strike(self, sent: Transmission, now: int, line: LineSettings, dice: Random) -> tuple[Transmission, ...]:
        return self.fault.strike(sent, now, line, dice) if len(sent.octets) > self.over else (sent,)


@dataclass(frozen=True, slots=True)
class Pauses:
    """A party that stops for `pause` ns in the middle of its frames; the line is silent meanwhile."""

    rate: float
    pause: int
    name: ClassVar[str] = "pause"

    def strike(self, sent: Transmission, now: int, line: LineSettings, dice: Random) -> tuple[Transmission, ...]:
        size = len(sent.octets)
        if size < 4 or dice.random() >= self.rate:
            return (sent,)
        cut = dice.randrange(2, size - 1)
        rest = replace(sent, octets=sent.octets[cut:], start=sent.start + cut * line.char + self.pause)
        return (replace(sent, octets=sent.octets[:cut]), rest)
