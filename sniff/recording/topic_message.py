"""A message for a topic of a recording, before its file gives the topic a channel."""

from __future__ import annotations

from dataclasses import dataclass

from sniff.recording.derived_message import DerivedMessage

_U64 = 1 << 64


@dataclass(frozen=True, slots=True)
class Message:
    """One MCAP message before it has a channel number; times in ns, 0 … 2⁶⁴-1."""

    topic: str
    log_time: int
    publish_time: int
    sequence: int
    data: bytes


def of_derived(one: DerivedMessage, sequences: dict[str, int]) -> Message:
    """The message of a result, with the next number of its topic, which is counted in `sequences`."""
    number = sequences.get(one.topic, 0)
    sequences[one.topic] = (number + 1) % (1 << 32)
    return Message(one.topic, stamp(one.log_time), stamp(one.publish_time), number, one.data)


def stamp(time: int) -> int:
    """A time as MCAP can hold it."""
    return min(max(time, 0), _U64 - 1)
