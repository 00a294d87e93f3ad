"""Line ends that a terminal changed: octets with LF where their sender said CR, or without the CR. Pure.

A port that was not set raw changes CR into LF as it reads (`icrnl`, which is how ports are when nobody set them), or
drops it (`igncr`). Protocols of text end with CR, so that not one frame is good then, whatever else is right.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, pairwise

from dissectors.frame import Chunk

LEAST = 3
"""Line feeds from which on octets are asked."""

_TWO = re.compile(rb"\n\n")


@dataclass(frozen=True, slots=True)
class LineEnds:
    """Octets as they were sent, if it was a terminal. `how`: what is done to them; `why`: what was done before."""

    how: str
    why: str
    chunks: list[Chunk]


def as_sent(sample: Sequence[Chunk]) -> Iterator[LineEnds]:
    """What the octets may have been, where there are line feeds and not one CR."""
    octets = b"".join(chunk.octets for chunk in sample)
    if b"\r" in octets or octets.count(b"\n") < LEAST:
        return
    changed = "a port that was not set raw changed CR into LF (icrnl)"
    if _TWO.search(octets) is not None:
        yield LineEnds("with CR LF for each LF LF", changed, _cut(_TWO.sub(b"\r\n", octets), sample))
    whole = [replace(chunk, octets=chunk.octets.replace(b"\n", b"\r\n"), marks=()) for chunk in sample]
    yield LineEnds(
        "with CR LF for each LF", "a port that was not set raw dropped CR (igncr); or LF alone is what was sent", whole
    )
    yield LineEnds("with CR for each LF", changed, _cut(octets.replace(b"\n", b"\r"), sample))


def _cut(octets: bytes, sample: Sequence[Chunk]) -> list[Chunk]:
    """As many octets, in the same reads."""
    places = [0, *accumulate(len(chunk.octets) for chunk in sample)]
    return [replace(chunk, octets=octets[a:b]) for chunk, (a, b) in zip(sample, pairwise(places), strict=True)]
