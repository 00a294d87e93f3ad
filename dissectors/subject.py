"""The subject of a finding, as a value: a bus, its master, a station or a thing in it, a pair, an adapter, a port.

`str()` of it is how people are told: "station 3", "MAC 5", "drive 1", "station 1, AI 200", "0 → 27", "bus". Decisions
(health, what explains what) look at the value, never at the words.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum


class About(Enum):
    """Kinds of subjects."""

    BUS = "bus"
    MASTER = "master"
    STATION = "station"
    PAIR = "pair"  # two stations, or a way from one to the other
    ADAPTER = "adapter"
    PORT = "port"
    OTHER = "other"  # something that this program has no word for


@dataclass(frozen=True, slots=True)
class Subject:
    """What a finding is about.

    `station`: its address, of a pair that of the station that is told on: a token sent 5 → 9 and not used is 9's.
    `partner`: the other one of a pair. `noun`: what people call it ("station", "MAC", "drive"). `part`: a thing inside
    the station ("AI 200"). `name`: of a port, or of what is no station.
    """

    kind: About
    station: int | None = None
    partner: int | None = None
    noun: str = "station"
    part: str = ""
    name: str = ""

    def __str__(self) -> str:
        if self.kind is About.STATION:
            return f"{self.noun} {self.station}" + (f", {self.part}" if self.part else "")
        if self.kind is About.PAIR:
            return f"{self.partner} → {self.station}" + (f", {self.part}" if self.part else "")
        return self.name if self.kind in (About.PORT, About.OTHER) else self.kind.value

    @property
    def is_whole_bus(self) -> bool:
        """Whether it is no single station: what is said of it is said of all that share the line."""
        return self.kind in (About.BUS, About.MASTER)

    @property
    def reaches_all(self) -> bool:
        """Whether what is wrong with it may be seen at everybody: also what the adapter loses is lost to all."""
        return self.is_whole_bus or self.kind is About.ADAPTER

    def is_of(self, other: Subject) -> bool:
        """Whether what is wrong with `other` may be seen at this: the same thing, or one inside that station."""
        if self == other:
            return True
        return self.station is not None and self.station == other.station and not other.part


BUS = Subject(About.BUS)
MASTER = Subject(About.MASTER)
ADAPTER = Subject(About.ADAPTER)
_NAMED = {str(one): one for one in (BUS, MASTER, ADAPTER)}
_PAIR = re.compile(r"(\d{1,5}) → (\d{1,5})(?:, (.+))?", re.ASCII | re.DOTALL)
_STATION = re.compile(r"([^\W\d][\w-]*) (\d{1,5})(?:, (.+))?", re.ASCII | re.DOTALL)


def station(address: int, noun: str = "station", part: str = "") -> Subject:
    """A station, or a thing in it."""
    return Subject(About.STATION, address, noun=noun, part=part)


def pair(giver: int, taker: int) -> Subject:
    """The way from one station to another; it is the taker that is told on."""
    return Subject(About.PAIR, taker, giver)


def as_subject(words: str) -> Subject:
    """The subject whose `str()` these words are; total: what is none of ours is OTHER with these words for a name."""
    if words in _NAMED:
        return _NAMED[words]
    if match := _PAIR.fullmatch(words):
        return Subject(About.PAIR, int(match[2]), int(match[1]), part=match[3] or "")
    if match := _STATION.fullmatch(words):
        return Subject(About.STATION, int(match[2]), noun=match[1], part=match[3] or "")
    return Subject(About.OTHER, name=words)
