"""What strikes a whole line by the clock, and what of it a sniffer hears."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from random import Random
from typing import ClassVar

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from dissectors.simulated_faults import NOISE, Transmission
from sniff.engine.session import Item
from sniff.simulation.collision import low_times, receive
from sniff.simulation.scenarios import Scenario, simulate
from sniff.simulation.tap import TapModel
from tests.faults.case import Heard

S = 1_000_000_000


@dataclass(frozen=True, slots=True)
class AtTimes:
    """Bits inverted in octets that end while something disturbs the line: `wide` ns in each `period` ns.

    `rate`: probability for each such octet. `loose`: most ns by which each disturbance comes sooner or later.
    """

    period: int
    wide: int
    rate: float = 0.5
    loose: int = 0
    name: ClassVar[str] = "at-times"

    def strike(self, sent: Transmission, now: int, line: LineSettings, dice: Random) -> tuple[Transmission, ...]:
        """Invert one bit of each octet that is hit."""
        flips = dict(sent.flips)
        bits = line.data_bits + (line.parity != "N")
        for offset in range(len(sent.octets)):
            end = sent.start + (offset + 1) * line.char
            shift = Random(end // self.period).randrange(-self.loose, self.loose + 1) if self.loose else 0
            if (end + shift) % self.period < self.wide and dice.random() < self.rate:
                flips[offset] = flips.get(offset, 0) ^ 1 << dice.randrange(bits)
        return (sent.hit(self.name, flips=flips),) if flips else (sent,)


@dataclass(frozen=True, slots=True)
class PutBehind:
    """A sender whose program puts the same octets behind all that it sends."""

    party: str
    octets: bytes
    name: ClassVar[str] = "put-behind"

    def strike(self, sent: Transmission, now: int, line: LineSettings, dice: Random) -> tuple[Transmission, ...]:
        """Add them."""
        if sent.party != self.party or not sent.octets:
            return (sent,)
        return (sent.hit(self.name, octets=sent.octets + self.octets),)


@dataclass(frozen=True, slots=True)
class Anywhere:
    """A few random octets anywhere in the silence behind a transmission, `rate` for each."""

    rate: float
    name: ClassVar[str] = "anywhere"

    def strike(self, sent: Transmission, now: int, line: LineSettings, dice: Random) -> tuple[Transmission, ...]:
        """Add them."""
        if not sent.octets or dice.random() >= self.rate:
            return (sent,)
        octets = dice.randbytes(dice.randint(1, 2))
        start = sent.end(line) + dice.randint(1, 20) * line.char
        return (sent, Transmission(NOISE, start, octets, octets, faults=(self.name,)))


def with_settings(
    settings: str, spans: tuple[tuple[float, float], ...], plan: Scenario, seconds: float, tap: TapModel
) -> Heard:
    """The line heard bit by bit with the settings of the bus; what is sent during `spans` (s) is sent with others."""
    session, _ = simulate(plan, seconds, tap)
    other = LineSettings.parse(settings)

    def items() -> Iterator[Item]:
        for burst in plan.wire().run(int(seconds * S)):
            if burst.octets:
                within = any(begin * S <= burst.start < end * S for begin, end in spans)
                sent = other if within else plan.line
                received = receive(plan.line, low_times(sent, burst.start, burst.octets, {}))
                if received.octets:
                    yield Chunk(max(received.ends), received.octets, received.marks)

    return session, items()


def paused(spans: tuple[tuple[float, float], ...], plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """The same bus with pauses (begin, length, s) in which nobody speaks: what follows comes later."""
    session, heard = simulate(plan, seconds, tap)

    def items() -> Iterator[Item]:
        first: int | None = None
        for item in heard:
            first = item.time if first is None else first
            later = sum(length for begin, length in spans if item.time - first >= begin * S)
            yield replace(item, time=item.time + int(later * S))

    return session, items()


def as_protocol(protocol: str, plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """Read as something that it is not."""
    session, items = simulate(plan, seconds, tap)
    return replace(session, protocol=protocol), items


def by_other_uart(settings: str, plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """Heard by a UART with other settings that reports no errors."""
    session, _ = simulate(plan, seconds, tap)
    other = LineSettings.parse(settings)

    def items() -> Iterator[Item]:
        for burst in plan.wire().run(int(seconds * S)):
            if burst.octets:
                received = receive(other, low_times(plan.line, burst.start, burst.octets, {}))
                yield Chunk(max(received.ends), received.octets)

    return replace(session, line=other), items()


def masked(mask: int, plan: Scenario, seconds: float, tap: TapModel) -> Heard:
    """Received with fewer data bits, by an adapter that reports no errors."""
    session, heard = simulate(plan, seconds, tap)
    table = bytes(value & mask for value in range(256))
    items = (replace(one, octets=one.octets.translate(table)) if isinstance(one, Chunk) else one for one in heard)
    return session, items
