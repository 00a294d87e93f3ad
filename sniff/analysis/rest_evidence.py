"""Evidence of a second protocol on one bus, in the octets that no frame of the first holds. Pure, bounded.

What the first leaves comes as *stretches*: octets with nothing good of the first between them. No frame of another
protocol reaches over one of the first; so a stretch that a protocol's sieve knows to hold nothing good is never framed.
"""

from __future__ import annotations

from collections.abc import Sequence

from dissectors import registry
from dissectors.frame import Chunk, Event, Frame
from dissectors.framer import Framer
from dissectors.line import NS_PER_S, LineSettings, Timing
from sniff.analysis.autodetect import CandidateEvidence
from sniff.engine.session import Session

SECOND_FRAMES = 2
SECOND_BITS = 40.0
"""Evidence from which on octets that are no frames of the first protocol are taken for frames of a second one."""

LATER = 10 * NS_PER_S
"""After so long a silence no protocol waits for more."""


def second_in(
    stretches: Sequence[Sequence[Chunk]], session: Session, others: Sequence[str], enough: float = SECOND_BITS
) -> tuple[str, int] | None:
    """The protocol among `others` that makes good frames of these stretches, each piece at its end, and how many; None
    where none has evidence enough (bits)."""
    found: list[tuple[float, str, int]] = []
    octets = [b"".join([chunk.octets for chunk in stretch]) for stretch in stretches]
    for name in others:
        dissector = registry.get(name)
        may_hold = map(dissector.sieve, octets)
        rest = [chunk for stretch, may in zip(stretches, may_hold, strict=True) if may for chunk in stretch]
        if not rest:
            continue
        line = LineSettings.parse(dissector.default_line) if session.line_is_assumed else session.line
        if not _has_frames(rest, dissector.framer(Timing(line, session.adapter.latency))):
            continue
        evidence = CandidateEvidence(line, (name,), session.adapter.latency)
        for chunk in rest:
            evidence.feed(chunk)
        evidence.advance(rest[-1].time + LATER)
        tally = evidence.tallies[name]
        if tally.frames >= SECOND_FRAMES and tally.bits >= enough and not dissector.neighbour(b"".join(octets)):
            found.append((tally.bits, name, tally.frames))
    return max(found)[1:] if found else None


def _has_frames(rest: Sequence[Chunk], framer: Framer) -> bool:
    """Whether there are good frames enough to look closer: noise, which most of it is, has hardly any."""
    good = 0
    for chunk in rest:
        good += _good(framer.feed(chunk))
        if good >= SECOND_FRAMES:
            return True
    return good + _good(framer.advance(rest[-1].time + LATER)) >= SECOND_FRAMES


def _good(events: Sequence[Event]) -> int:
    return sum(isinstance(event, Frame) and event.ok for event in events)
