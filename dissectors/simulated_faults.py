"""Faults of a simulated bus, as frozen values that a simulated line applies.

Each fault takes one transmission and gives what replaces it: nothing (lost), a changed one, or itself with something
beside it. Which transmissions are hit is drawn from the dice that the line hands in, one seeded generator a fault, so
that a run can be repeated and switching one fault off leaves the others alone. `rate` is a probability, 0 … 1, for
each transmission unless said otherwise. `parties` names whom it concerns; empty means every party that answers
(`Party.answers`), or simply every party where the fault is the line's.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import log1p
from random import Random
from types import MappingProxyType
from typing import ClassVar, Protocol

from dissectors.frame import Place
from dissectors.line import LineSettings

NOISE = "(noise)"
"""Who sent what nobody sent."""

_NO_FLIPS: Mapping[int, int] = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class Transmission:
    """Octets that a driver puts on the line from `start` (ns) on, and what was done to them.

    `meant`: what the party wanted to send; `octets`: what its driver sent. `flips`: octet offset → mask of wrong bits
    over the data bits (from bit 0) and the parity bit (bit `data_bits`). `held`: ns for which the line is held at 0
    instead (a break), 0 for octets. `faults`: names of the faults that hit it.
    """

    party: str
    start: int
    meant: bytes
    octets: bytes
    answers: bool = False
    flips: Mapping[int, int] = field(default_factory=lambda: _NO_FLIPS)
    held: int = 0
    linger: int = 0
    faults: tuple[str, ...] = ()

    def end(self, line: LineSettings) -> int:
        """When the driver lets go, ns."""
        return self.start + (self.held or len(self.octets) * line.char)

    def hit(self, fault: str, **changes: object) -> Transmission:
        """This transmission with something changed by the fault of that name."""
        return replace(self, faults=(*self.faults, fault), **changes)  # type: ignore[arg-type]


class Fault(Protocol):
    """One way in which transmissions go wrong."""

    @property
    def name(self) -> str:
        """Stable lower-case name with hyphens, as it stands in the ground truth."""
        ...

    def strike(self, sent: Transmission, now: int, line: LineSettings, dice: Random) -> tuple[Transmission, ...]:
        """Give what becomes of `sent`; nothing it gives may begin before `now` (ns)."""
        ...


@dataclass(frozen=True, slots=True)
class BitFlips:
    """Bits inverted on the line; `rate` for each octet. A flip may hit the parity bit alone."""

    rate: float
    parties: tuple[str, ...] = ()
    name: ClassVar[str] = "bit-flip"

    def strike(self, sent: Transmission, now: int, line: LineSettings, dice: Random) -> tuple[Transmission, ...]:
        """Invert one bit of each octet that is hit."""
        if self.parties and sent.party not in self.parties:
            return (sent,)
        hits = _hits(self.rate, len(sent.octets), dice)
        if not hits:
            return (sent,)
        bits = line.data_bits + (line.parity != "N")
        flips = dict(sent.flips)
        for offset in hits:
            flips[offset] = flips.get(offset, 0) ^ 1 << dice.randrange(bits)
        return (sent.hit(self.name, flips=flips),)


@dataclass(frozen=True, slots=True)
class MarkParity:
    """Octets that arrive right but with a wrong parity bit, `rate` for each octet; nothing on a line without parity."""

    rate: float
    parties: tuple[str, ...] = ()
    name: ClassVar[str] = "parity"

    def strike(self, sent: Transmission, now: int, line: LineSettings, dice: Random) -> tuple[Transmission, ...]:
        """Invert the parity bit of each octet that is hit."""
        if line.parity == "N" or (self.parties and sent.party not in self.parties):
            return (sent,)
        hits = _hits(self.rate, len(sent.octets), dice)
        if not hits:
            return (sent,)
        flips = dict(sent.flips)
        for offset in hits:
            flips[offset] = flips.get(offset, 0) ^ 1 << line.data_bits
        return (sent.hit(self.name, flips=flips),)


@dataclass(frozen=True, slots=True)
class EarlyRelease:
    """A driver that lets go before its last octet is out: its remaining bits read 1."""

    rate: float
    parties: tuple[str, ...] = ()
    name: ClassVar[str] = "early-release"

    def strike(self, sent: Transmission, now: int, line: LineSettings, dice: Random) -> tuple[Transmission, ...]:
        """Set the last bits of the last octet."""
        if not _concerns(self.parties, sent) or not sent.octets or dice.random() >= self.rate:
            return (sent,)
        kept = dice.randrange(1, line.data_bits)
        high = (1 << line.data_bits) - (1 << kept)
        last = len(sent.octets) - 1
        mask = ~sent.octets[last] & high
        if not mask:
            return (sent,)
        return (sent.hit(self.name, flips={**sent.flips, last: mask}),)


@dataclass(frozen=True, slots=True)
class CutShort:
    """A party that stops in the middle of its frame."""

    rate: float
    parties: tuple[str, ...] = ()
    name: ClassVar[str] = "cut-short"

    def strike(self, sent: Transmission, now: int, line: LineSettings, dice: Random) -> tuple[Transmission, ...]:
        """Drop one octet or more from the end, never all."""
        if not _concerns(self.parties, sent) or len(sent.octets) < 2 or dice.random() >= self.rate:
            return (sent,)
        return (sent.hit(self.name, octets=sent.octets[: dice.randrange(1, len(sent.octets))]),)


@dataclass(frozen=True, slots=True)
class LostResponse:
    """Answers that never reach the line."""

    rate: float
    parties: tuple[str, ...] = ()
    name: ClassVar[str] = "lost"

    def strike(self, sent: Transmission, now: int, line: LineSettings, dice: Random) -> tuple[Transmission, ...]:
        """Take the transmission away; an empty one stays as the record of it."""
        if not _concerns(self.parties, sent) or dice.random() >= self.rate:
            return (sent,)
        return (sent.hit(self.name, octets=b"", flips=_NO_FLIPS),)


@dataclass(frozen=True, slots=True)
class LateResponse:
    """Answers that come `by` ns later than the station wanted."""

    rate: float
    by: int
    parties: tuple[str, ...] = ()
    name: ClassVar[str] = "late"

    def strike(self, sent: Transmission, now: int, line: LineSettings, dice: Random) -> tuple[Transmission, ...]:
        """Move the transmission."""
        if not _concerns(self.parties, sent) or dice.random() >= self.rate:
            return (sent,)
        return (sent.hit(self.name, start=sent.start + self.by),)


@dataclass(frozen=True, slots=True)
class DuplicateAddress:
    """A second device with the address of `party`: it answers too, `by` ns after the first one began.

    Shorter than the answer itself, the two collide; longer, the master is answered twice.
    """

    party: str
    by: int
    rate: float = 1.0
    name: ClassVar[str] = "duplicate"

    def strike(self, sent: Transmission, now: int, line: LineSettings, dice: Random) -> tuple[Transmission, ...]:
        """Add the other device's answer."""
        if sent.party != self.party or not sent.octets or dice.random() >= self.rate:
            return (sent,)
        twin = replace(sent, party=f"{sent.party}'", start=sent.start + self.by, faults=(self.name,))
        return (sent, twin)


@dataclass(frozen=True, slots=True)
class Echo:
    """A repeater or adapter that gives back what a party sent: an exact copy `after` ns behind it."""

    parties: tuple[str, ...]
    after: int = 0
    rate: float = 1.0
    name: ClassVar[str] = "echo"

    def strike(self, sent: Transmission, now: int, line: LineSettings, dice: Random) -> tuple[Transmission, ...]:
        """Add the copy."""
        if sent.party not in self.parties or not sent.octets or dice.random() >= self.rate:
            return (sent,)
        copy = replace(sent, party=f"{sent.party} echo", start=sent.end(line) + self.after, faults=(self.name,))
        return (sent, copy)


@dataclass(frozen=True, slots=True)
class NoiseInGaps:
    """Stray octets in the silence around a transmission: missing bias, drivers that switch too early or too late.

    `most`: 1 … `most` octets at a time. `places`: directly before or after a transmission, or some characters after it.
    `values`: what they are; empty for anything. `spread`: for BETWEEN, most characters of silence before them.
    """

    rate: float
    most: int = 3
    places: tuple[Place, ...] = (Place.BEFORE, Place.BETWEEN, Place.AFTER)
    values: bytes = b"\x00\xff\xfe\xf8\xc0"
    spread: int = 8
    name: ClassVar[str] = "noise"

    def strike(self, sent: Transmission, now: int, line: LineSettings, dice: Random) -> tuple[Transmission, ...]:
        """Add noise beside the transmission; where there is no room before it, the transmission comes later."""
        if not sent.octets or dice.random() >= self.rate:
            return (sent,)
        count = dice.randint(1, self.most)
        octets = bytes(dice.choice(self.values) if self.values else dice.randrange(256) for _ in range(count))
        place = dice.choice(self.places)
        if place is Place.BEFORE:
            start = max(now, sent.start - count * line.char)
            sent = replace(sent, start=max(sent.start, start + count * line.char))
        else:
            start = sent.end(line)
            if place is Place.BETWEEN:
                start += dice.randint(2, max(2, self.spread)) * line.char
        return (sent, Transmission(NOISE, start, octets, octets, faults=(self.name,)))


@dataclass(frozen=True, slots=True)
class Break:
    """The line held low for `bits` bit times, some characters after a transmission."""

    rate: float
    bits: int = 25
    spread: int = 8
    name: ClassVar[str] = "break"

    def strike(self, sent: Transmission, now: int, line: LineSettings, dice: Random) -> tuple[Transmission, ...]:
        """Add the break; it reads as one octet 00."""
        if not sent.octets or dice.random() >= self.rate:
            return (sent,)
        start = sent.end(line) + dice.randint(2, max(2, self.spread)) * line.char
        held = max(line.bits(self.bits), line.char + 1)
        return (sent, Transmission(NOISE, start, b"\0", b"\0", held=held, faults=(self.name,)))


def _concerns(parties: tuple[str, ...], sent: Transmission) -> bool:
    return sent.party in parties if parties else sent.answers


def _hits(rate: float, count: int, dice: Random) -> list[int]:
    """Offsets hit among `count`, each with probability `rate`: jumps from hit to hit, one draw a hit."""
    if rate <= 0:
        return []
    if rate >= 1:
        return list(range(count))
    hits: list[int] = []
    scale = log1p(-rate)
    at = int(log1p(-dice.random()) / scale)
    while at < count:
        hits.append(at)
        at += 1 + int(log1p(-dice.random()) / scale)
    return hits
