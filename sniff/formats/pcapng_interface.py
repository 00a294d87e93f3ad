"""An interface of a pcapng file: whose packets, in which unit of time."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Interface:
    """What a section says of an interface."""

    link_type: int
    resolution: tuple[int, int] = (1000, 1)  # ns per tick as a fraction
    offset: int = 0  # s
    longest: int = 1 << 32  # octets of a packet that are kept
