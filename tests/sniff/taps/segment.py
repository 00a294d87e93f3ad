"""A line with a stretch between two taps: what each of them hears, and faults of the stretch."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, field

from dissectors.bacnet.envelope import frame
from dissectors.line import Timing
from dissectors.modbus.envelope import seal_rtu
from tests.bus_delivery import MS, Wire

Way = Callable[[bytes, random.Random], bytes]
"""What of a frame arrives at the far end."""


def whole(octets: bytes, dice: random.Random) -> bytes:
    return octets


def dead(octets: bytes, dice: random.Random) -> bytes:
    return b""


def bit_errors(share: float) -> Way:
    def way(octets: bytes, dice: random.Random) -> bytes:
        if dice.random() >= share:
            return octets
        at = dice.randrange(len(octets))
        return octets[:at] + bytes([octets[at] ^ 1 << dice.randrange(8)]) + octets[at + 1 :]

    return way


def without_begin(share: float, count: int = 1) -> Way:
    return lambda octets, dice: octets[count:] if dice.random() < share else octets


def without_end(share: float, count: int = 2) -> Way:
    return lambda octets, dice: octets[:-count] if dice.random() < share else octets


def lost(share: float) -> Way:
    return lambda octets, dice: b"" if dice.random() < share else octets


def rewritten(share: float) -> Way:
    """A gateway that changes a value and seals it again."""

    def way(octets: bytes, dice: random.Random) -> bytes:
        if dice.random() >= share or octets[1] != 3 or len(octets) == 8:
            return octets
        return seal_rtu(octets[:3] + bytes([octets[3] ^ 0x40]) + octets[4:-2])

    return way


@dataclass
class Segment:
    """Stations 1 … 4 behind tap A with the master, 5 … 8 behind tap B. `onward`: from A to B; `back`: from B to A.

    `at_a`, `at_b`: what the taps' own wiring does to everything. `delay`: ns from one to the other.
    """

    onward: Way = whole
    back: Way = whole
    at_a: Way = whole
    at_b: Way = whole
    delay: int = 0
    jitter: int = 0
    seed: int = 1
    wires: tuple[Wire, Wire] = field(default_factory=lambda: ([], []))

    def run(self, timing: Timing, polls: int = 1200) -> tuple[Wire, Wire]:
        """Octets at either tap, as (end ns, octet)."""
        dice = random.Random(self.seed)
        now, counter = 100 * MS, 0
        for poll in range(polls):
            unit = poll % 8 + 1
            near = unit <= 4
            asked = seal_rtu(bytes([unit, 3, 0, unit, 0, 2]))
            now = self.send(asked, now, True, timing, dice)
            reached = asked if near else self.onward(asked, random.Random(f"{self.seed} {poll}"))
            if reached == asked:
                counter += dice.randint(0, 3)
                answer = seal_rtu(bytes([unit, 3, 4]) + counter.to_bytes(4, "big"))
                now = self.send(answer, now + dice.randint(3, 9) * MS, near, timing, dice)
                now += dice.randint(10, 20) * MS
            else:
                now += 120 * MS
        return self.wires

    def send(self, octets: bytes, begin: int, from_a: bool, timing: Timing, dice: random.Random) -> int:
        here, there = (0, 1) if from_a else (1, 0)
        arrived = (self.onward if from_a else self.back)(octets, dice)
        later = self.delay + (dice.randint(0, self.jitter) if self.jitter else 0)
        for tap, came, start in ((here, octets, begin), (there, arrived, begin + later)):
            heard = (self.at_a, self.at_b)[tap](came, dice)
            skipped = len(octets) - len(heard) if octets.endswith(heard) and heard != octets else 0
            for place, octet in enumerate(heard, 1 + skipped):
                self.wires[tap].append((start + place * timing.char, octet))
        return begin + len(octets) * timing.char + 2 * later


def ring(segment: Segment, timing: Timing, rounds: int = 400) -> tuple[Wire, Wire]:
    """The same with a token ring: masters 1 … 3 behind tap A, 4 … 6 behind tap B; a token that does not arrive is
    passed again."""
    dice, now = random.Random(segment.seed), 100 * MS
    for number in range(rounds * 6):
        holder, follower = number % 6 + 1, (number + 1) % 6 + 1
        for _ in range(2):
            fate = f"{segment.seed} {number} {now}"
            from_a, to_a = holder <= 3, follower <= 3
            way = segment.onward if from_a else segment.back
            token = frame(0, follower, holder)
            arrives = from_a == to_a or way(token, random.Random(fate)) == token
            now = segment.send(token, now + dice.randint(1, 4) * MS, from_a, timing, random.Random(fate))
            if arrives:
                break
            now += 25 * MS
    return segment.wires
