"""How strongly octets that were carried by something speak for a field bus, and for which."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from dissectors import registry
from dissectors.frame import Check, Chunk, Frame
from dissectors.line import LineSettings, Timing
from dissectors.manifest import Dissector
from sniff.formats.records import FOREIGN_LATENCY

LEAST_BITS, COVERED_LEAST = 14.0, 0.5
"""Evidence in good frames, and their share of the octets, from which on a connection is a bus."""
_MOST_BITS = 24.0


@dataclass(frozen=True, slots=True)
class Evidence:
    """The protocol whose good frames say most. `covered`: their share of the octets."""

    protocol: str
    bits: float
    covered: float


def evidence_of(sample: Iterable[Chunk], besides: Iterable[Dissector] = ()) -> Evidence | None:
    """What the first octets speak for, of all protocols of lines and those named `besides`; None where none says
    enough."""
    chunks = list(sample)
    octets = sum(len(chunk.octets) for chunk in chunks)
    best: Evidence | None = None
    for one in (*registry.usable(), *besides):
        framer = one.framer(Timing(LineSettings.parse(one.default_line), FOREIGN_LATENCY))
        events = [event for chunk in chunks for event in framer.feed(chunk)] + framer.close()
        good = [event for event in events if isinstance(event, Frame) and _is_good(event, one.name)]
        bits = sum(min(_MOST_BITS, one.bits(frame)) for frame in good)
        covered = sum(len(frame.octets) for frame in good)
        if bits >= LEAST_BITS and covered >= COVERED_LEAST * octets and (best is None or bits > best.bits):
            best = Evidence(one.name, bits, covered / max(1, octets))
    return best


def _is_good(frame: Frame, protocol: str) -> bool:
    """A check may be absent only where the network has one."""
    return frame.damage is None and (frame.check is Check.GOOD or (frame.ok and protocol in registry.RELATIVES))
