"""Ways in which a PROFIBUS sender makes its sum (FCS) wrongly, as `dissectors.wrong_checks` asks. Pure."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import reduce
from operator import xor
from typing import Final

from dissectors.checksums import sum8
from dissectors.frame import Frame
from dissectors.profibus.envelope import length_of
from dissectors.profibus.telegram import ED, body_of
from dissectors.wrong_checks import ALIKE, BY_ANOTHER_RULE, NOT_MADE, Mistake, Way

_SUMS: Final[dict[Mistake, Callable[[bytes], int]]] = {
    Mistake("which is the exclusive or of the octets", BY_ANOTHER_RULE): lambda body: reduce(xor, body, 0),
    Mistake("which is the two's complement of the sum", BY_ANOTHER_RULE): lambda body: -sum(body),
    Mistake("which is the one's complement of the sum", BY_ANOTHER_RULE): lambda body: ~sum(body),
}
"""What a sender may take for the sum of what is checked."""


def ways(frame: Frame) -> Iterator[tuple[Way, int]]:
    """How the sum of a damaged telegram is wrong, and what would be right; nothing where a line error was reported, or
    more is wrong with it."""
    octets = frame.octets
    if frame.ok or frame.marks or len(octets) < 6 or octets[-1] != ED or length_of(octets) != len(octets):
        return
    body, received = body_of(octets), octets[-2]
    right = sum8(body)
    if received == right:
        return
    for mistake, made in _SUMS.items():
        if made(body) & 0xFF == received:
            yield Way(mistake), right
    yield Way(ALIKE, received - right & 0xFF), right
    if received in (0, 0xFF):
        yield Way(NOT_MADE, received), right
