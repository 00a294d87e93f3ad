"""Stations whose answers are wrong in one certain way each time, and masters that stop."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from random import Random
from typing import Any, ClassVar

from dissectors.line import LineSettings
from dissectors.modbus.envelope import seal_ascii, seal_rtu, unseal
from dissectors.modbus.simulated_master import PollingMaster, Request
from dissectors.simulated import Send, Station
from dissectors.simulated_faults import Fault, Transmission
from tests.faults.stations import Wrapped

MS = 1_000_000

Rewrite = Callable[[bytes, bytes], bytes]
"""Octets of the request and of its answer → what the station sends instead; the answer itself where it does well."""


class Rewrites(Wrapped):
    """Sends something else than the right answer, in a share of all cases."""

    def __init__(self, inner: Station, rewrite: Rewrite, share: float = 1.0) -> None:
        super().__init__(inner)
        self.rewrite, self.share = rewrite, share
        self.dice = Random(4)

    def change(self, now: int, octets: bytes, sends: tuple[Send, ...]) -> tuple[Send, ...]:
        return tuple(
            replace(send, octets=self.rewrite(octets, send.octets)) if self.dice.random() < self.share else send
            for send in sends
        )


def swapped_check(request: bytes, answer: bytes) -> bytes:
    """The high octet of the CRC first."""
    return answer[:-2] + answer[-1:] + answer[-2:-1]


class SwapsChecks(Wrapped):
    """A master that sends the high octet of the CRC first."""

    def wake(self, now: int) -> tuple[Send, ...]:
        return tuple(replace(send, octets=swapped_check(b"", send.octets)) for send in super().wake(now))


def other_check(request: bytes, answer: bytes) -> bytes:
    """The CRC begun with 0 and not with FFFF."""
    check = 0
    for octet in answer[:-2]:
        check ^= octet
        for _ in range(8):
            check = check >> 1 ^ (0xA001 if check & 1 else 0)
    return answer[:-2] + check.to_bytes(2, "little")


def copied_before(request: bytes, answer: bytes) -> bytes:
    """The request once more, the answer directly behind it."""
    return request + answer


def other_function(request: bytes, answer: bytes, *, is_ascii: bool = False) -> bytes:
    """Reads of holding registers answered with the function code of input registers."""
    inside = unseal(answer, is_ascii)
    if inside is None or inside[1] != 3:
        return answer
    return (seal_ascii if is_ascii else seal_rtu)(inside[:1] + b"\x04" + inside[2:])


def other_value(request: bytes, answer: bytes, *, is_ascii: bool = False) -> bytes:
    """A written register confirmed with a value one less."""
    inside = unseal(answer, is_ascii)
    if inside is None or inside[1] != 6:
        return answer
    value = int.from_bytes(inside[4:6], "big")
    return (seal_ascii if is_ascii else seal_rtu)(inside[:4] + ((value - 1) & 0xFFFF).to_bytes(2, "big"))


def other_quantity(request: bytes, answer: bytes) -> bytes:
    """Written registers confirmed with one register less."""
    inside = unseal(answer, False)
    if inside is None or inside[1] != 16:
        return answer
    return seal_rtu(inside[:4] + (int.from_bytes(inside[4:6], "big") - 1).to_bytes(2, "big"))


class TakesReadsOnly(Wrapped):
    """Obeys what is as long as a request to read and nothing else: not the answer of another one with its number."""

    def __init__(self, inner: Station, is_ascii: bool = False) -> None:
        super().__init__(inner)
        self.size = 17 if is_ascii else 8

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        return super().hear(now, octets, quiet) if len(octets) == self.size else ()


class Blinks(Wrapped):
    """Off for `off` ns every `every` ns: it sends nothing then, answers and what it begins itself alike."""

    def __init__(self, inner: Station, every: int, off: int) -> None:
        super().__init__(inner)
        self.every, self.off = every, off

    def change(self, now: int, octets: bytes, sends: tuple[Send, ...]) -> tuple[Send, ...]:
        return () if now > self.every and now % self.every < self.off else sends


class Halts(Wrapped):
    """A master whose program stands still from `at` to `until`."""

    def __init__(self, inner: Station, at: int, until: int) -> None:
        super().__init__(inner)
        self.at, self.until = at, until

    def wake(self, now: int) -> tuple[Send, ...]:
        return () if self.at <= now < self.until else self.inner.wake(now)

    def next_wake(self) -> int | None:
        due = self.inner.next_wake()
        return self.until if due is not None and self.at <= due < self.until else due


class Unhurried(PollingMaster):
    """A master whose pauses are longer by up to `spread` ns, each time another time."""

    def __init__(self, requests: Sequence[Request], line: LineSettings, spread: int, seed: int, **more: Any) -> None:
        super().__init__(requests, line, **more)
        self.spread, self.dice = spread, Random(f"unhurried {seed}")

    def _go_on(self, at: int) -> None:
        super()._go_on(at + self.dice.randrange(self.spread))


class ByTheClock(PollingMaster):
    """A master that asks every `tick` ns, however soon it is answered, and asks nothing again."""

    def __init__(self, requests: Sequence[Request], line: LineSettings, tick: int, **more: Any) -> None:
        super().__init__(requests, line, **{**more, "timeout": tick // 2, "retries": 0})
        self.tick, self.began = tick, 0

    def wake(self, now: int) -> tuple[Send, ...]:
        sends = super().wake(now)
        self.began = now if sends else self.began
        return sends

    def _go_on(self, at: int) -> None:
        super()._go_on(max(at, self.began + self.tick))


class OnTheTick(Wrapped):
    """A master that sends at multiples of `tick` ns, and at no other time."""

    def __init__(self, inner: Station, tick: int) -> None:
        super().__init__(inner)
        self.tick = tick

    def wake(self, now: int) -> tuple[Send, ...]:
        return () if now % self.tick else self.inner.wake(now)

    def next_wake(self) -> int | None:
        due = self.inner.next_wake()
        return None if due is None else -(-due // self.tick) * self.tick


class ScansOnce(PollingMaster):
    """Asks in turn; from `at` on it looks once for whom else there is, each of `scan` in one round, then goes on."""

    def __init__(self, requests: Sequence[Request], line: LineSettings, scan: Sequence[bytes], at: int, **more: Any):
        super().__init__(requests, line, **more)
        self.usual, self.scan, self.at = self.requests, tuple(scan), at

    def _go_on(self, at: int) -> None:
        super()._go_on(at)
        if self._turn == 0:
            self.requests = self.usual
            if self.scan and at >= self.at:
                self.requests, self.scan = self.scan, ()


@dataclass(frozen=True, slots=True)
class Trimmed:
    """A driver that is switched on too late or off too early: the first or the last octets are never on the line."""

    party: str
    first: int = 0
    last: int = 0
    rate: float = 1.0
    shorter: int = 0
    """Strikes only what has at most this many octets; 0: all."""
    name: ClassVar[str] = "trimmed"

    def strike(self, sent: Transmission, now: int, line: LineSettings, dice: Random) -> tuple[Transmission, ...]:
        size = len(sent.octets)
        if sent.party != self.party or size <= self.first + self.last or (self.shorter and size > self.shorter):
            return (sent,)
        if dice.random() >= self.rate:
            return (sent,)
        kept = sent.octets[self.first : size - self.last]
        return (sent.hit(self.name, octets=kept, start=sent.start + self.first * line.char),)


@dataclass(frozen=True, slots=True)
class SpoiltFirst:
    """A driver that is switched on in the middle of its first octet: what is left of it reads as another one."""

    party: str
    rate: float = 1.0
    name: ClassVar[str] = "spoilt-first"

    def strike(self, sent: Transmission, now: int, line: LineSettings, dice: Random) -> tuple[Transmission, ...]:
        if sent.party != self.party or not sent.octets or dice.random() >= self.rate:
            return (sent,)
        kept = dice.randrange(1, line.data_bits)  # bits that the line showed 1 for, as nobody drove it
        mask = ~sent.octets[0] & ((1 << kept) - 1)
        return (sent.hit(self.name, flips={**sent.flips, 0: mask}) if mask else sent,)


@dataclass(frozen=True, slots=True)
class When:
    """A fault that strikes only what `holds` of the octets is true of."""

    holds: Callable[[bytes], bool]
    fault: Fault

    @property
    def name(self) -> str:
        return self.fault.name

    def strike(self, sent: Transmission, now: int, line: LineSettings, dice: Random) -> tuple[Transmission, ...]:
        return self.fault.strike(sent, now, line, dice) if self.holds(sent.octets) else (sent,)
