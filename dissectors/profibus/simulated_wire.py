"""Good telegrams in a burst, in order, as a simulated station hears them."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

from dissectors.profibus.envelope import is_sound, length_of
from dissectors.profibus.telegram import HIGHEST, SC, SD4, Telegram, parse


@lru_cache(maxsize=1024)  # every station hears every burst, and cycles repeat
def telegrams_of(octets: bytes) -> tuple[tuple[bytes, Telegram], ...]:
    """Octets and parts of the telegrams of a burst; total."""
    return tuple(_telegrams(octets))


def _telegrams(octets: bytes) -> Iterator[tuple[bytes, Telegram]]:
    at = 0
    while at < len(octets):
        length = _length(octets, at)
        if length:
            raw = octets[at : at + length]
            yield raw, parse(raw)
        at += length or 1


def _length(octets: bytes, at: int) -> int:
    if octets[at] == SC:
        return int(len(octets) == 1)
    if octets[at] == SD4:
        return 3 if len(octets) >= at + 3 and max(octets[at + 1 : at + 3]) <= HIGHEST else 0
    length = length_of(octets, at) or 0
    return length if is_sound(octets[at : at + length]) else 0
