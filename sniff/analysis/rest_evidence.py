"""Evidence of a second protocol on one bus, in the octets that no frame of the first holds. Pure, bounded."""

from __future__ import annotations

from collections.abc import Sequence

from dissectors import registry
from dissectors.frame import Chunk
from dissectors.line import NS_PER_S, LineSettings
from sniff.analysis.autodetect import CandidateEvidence
from sniff.engine.session import Session

SECOND_FRAMES = 2
SECOND_BITS = 40.0
"""Evidence from which on octets that are no frames of the first protocol are taken for frames of a second one."""


def second_in(
    rest: Sequence[Chunk], session: Session, others: Sequence[str], enough: float = SECOND_BITS
) -> tuple[str, int] | None:
    """The protocol among `others` that makes good frames of these stretches, each at its end, and how many; None where
    none has evidence enough (bits)."""
    found: list[tuple[float, str, int]] = []
    for name in others if rest else ():
        line = LineSettings.parse(registry.get(name).default_line) if session.line_is_assumed else session.line
        evidence = CandidateEvidence(line, (name,), session.adapter.latency)
        for chunk in rest:
            evidence.feed(chunk)
        evidence.advance(rest[-1].time + 10 * NS_PER_S)
        tally = evidence.tallies[name]
        if tally.frames >= SECOND_FRAMES and tally.bits >= enough:
            found.append((tally.bits, name, tally.frames))
    return max(found)[1:] if found else None
