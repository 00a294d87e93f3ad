"""A message for a topic of a recording, before its file gives the topic a channel."""

from __future__ import annotations

from dataclasses import dataclass

_U64 = 1 << 64


@dataclass(frozen=True, slots=True)
class Message:
    """One MCAP message before it has a channel number; times in ns, 0 … 2⁶⁴-1."""

    topic: str
    log_time: int
    publish_time: int
    sequence: int
    data: bytes


def stamp(time: int) -> int:
    """A time as MCAP can hold it."""
    return min(max(time, 0), _U64 - 1)
