"""Buses among the channels of a logic analyser. Pure.

| two channels | one bus |
|---|---|
| hold the same characters at the same times (A and B; RO hears what DI says) | yes; one of them adds nothing |
| have the same settings and never talk at once, although chance would have made them (RX and TX) | yes, joined |
| the same, too short to tell, with names that say it (RX and TX, RO and DI) | yes, joined |
| anything else | no: a bus each |
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from sniff.formats.uart import Characters, Uart

if TYPE_CHECKING:
    from dissectors.columns import Times

HELD_LEAST = 0.9
TALKED_OVER_MOST = 0.01
CHANCE_MOST = 0.01
_SILENCE = 3  # characters of silence between two stretches of talk
_SIDES = (("rx", "tx"), ("rxd", "txd"), ("ro", "di"), ("in", "out"))


@dataclass(slots=True)
class HeardChannel:
    """A channel that holds characters; those of a sample."""

    channel: int
    name: str
    uart: Uart
    sample: Characters


@dataclass(slots=True)
class WaveBus:
    """Channels of one bus. `sides`: read and joined; `same`: names of those that add nothing."""

    sides: list[HeardChannel]
    same: list[str] = field(default_factory=list)

    @property
    def name(self) -> str:
        """Its channels, in the order of the file."""
        return "+".join(one.name for one in sorted(self.sides, key=lambda one: one.channel))

    @property
    def words(self) -> str:
        """Which channels it is made of, and why."""
        names = [one.name for one in sorted(self.sides, key=lambda one: one.channel)]
        said = f"channel {names[0]}" if len(names) == 1 else f"channels {' and '.join(names)}: sides of one line"
        return said + (f"; the same on {', '.join(self.same)}" if self.same else "")


def buses(heard: Sequence[HeardChannel]) -> list[WaveBus]:
    """The buses, that with most characters first."""
    found: list[WaveBus] = []
    for one in sorted(heard, key=lambda one: -len(one.sample)):
        for bus in found:
            if any(_is_held(one, other) for other in bus.sides):
                bus.same.append(one.name)
                break
        else:
            for bus in found:
                if all(_are_sides(one, other) for other in bus.sides):
                    bus.sides.append(one)
                    break
            else:
                found.append(WaveBus([one]))
    return found


def _is_held(less: HeardChannel, more: HeardChannel) -> bool:
    """Whether the second holds the characters of the first."""
    mine, other = less.sample, more.sample
    if not len(other):
        return False
    bit = less.uart.bit
    at = np.clip(np.searchsorted(other.starts, mine.starts - int(bit)), 0, len(other) - 1)
    is_same = (np.abs(other.starts[at] - mine.starts) < bit) & (other.octets[at] == mine.octets)
    return float(is_same.mean()) >= HELD_LEAST


def _are_sides(one: HeardChannel, other: HeardChannel) -> bool:
    """Whether they talk in turn, as the two ends of one conversation do."""
    if one.uart.line != other.uart.line:
        return False
    a, b = one.sample, other.sample
    if float(_at_once(a, b).mean()) > TALKED_OVER_MOST or float(_at_once(b, a).mean()) > TALKED_OVER_MOST:
        return False
    return _chance(one, other) <= CHANCE_MOST or _named_as_sides(one.name, other.name)


def _at_once(some: Characters, others: Characters) -> Times:
    """Which characters are said while another of the others is."""
    after = np.searchsorted(others.ends, some.starts, "right")
    held = after < len(others)
    at_once = np.zeros(len(some), bool)
    at_once[held] = others.starts[after[held]] < some.ends[held]
    found: Times = at_once
    return found


def _chance(one: HeardChannel, other: HeardChannel) -> float:
    """How likely two lines that know nothing of each other never talk at once."""
    few, many = sorted((_talks(one), _talks(other)), key=lambda talks: len(talks[0]))
    begin = min(int(few[0][0]), int(many[0][0]))
    span = max(int(few[1][-1]), int(many[1][-1])) - begin
    lengths = float((few[1] - few[0]).mean() + (many[1] - many[0]).mean())
    share = min(0.999, len(many[0]) * lengths / max(1, span))
    return math.exp(len(few[0]) * math.log1p(-share))


def _talks(one: HeardChannel) -> tuple[Times, Times]:
    """Begins and ends of stretches of talk."""
    starts, ends = one.sample.starts, one.sample.ends
    cut = np.flatnonzero(starts[1:] - ends[:-1] > _SILENCE * one.uart.char)
    return starts[np.append(0, cut + 1)], ends[np.append(cut, len(ends) - 1)]


def _named_as_sides(one: str, other: str) -> bool:
    words = [set(re.split(r"[^a-z]+", name.lower())) for name in (one, other)]
    return any((a in words[0] and b in words[1]) or (b in words[0] and a in words[1]) for a, b in _SIDES)
