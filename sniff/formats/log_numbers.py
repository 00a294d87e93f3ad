"""How a log writes numbers that are octets: as pairs of hexadecimal digits, or with the digits they need. Pure."""

from __future__ import annotations

from collections.abc import Sequence

from sniff.formats.log_octets import PAIRS_ONLY
from sniff.formats.log_rewriting import is_of_characters

_MOSTLY = 0.8
_TELLING = 4
"""Numbers of a run that tell how it is written: fewer may all have two digits."""


def base_of(numbers: Sequence[Sequence[str]]) -> int:
    """How numbers are written: in pairs of hexadecimal digits in most lines (PAIRS_ONLY), or in as many digits as they
    have; then in decimal where one has three of them, or none is a letter. Pairs without a letter are decimal, too,
    where most lines are then frames in characters.
    """
    alone = [tokens[0] for tokens in numbers if len(tokens) == 1]
    runs = [tokens for tokens in numbers if len(tokens) > 1]
    if len(alone) > _MOSTLY * len(numbers) and not runs:  # an octet a line
        runs = [alone]
    runs = [tokens for tokens in runs if len(tokens) >= _TELLING] or runs
    mixed = [tokens for tokens in runs if len(tokens) >= _TELLING and _is_unpadded(tokens)]
    if 2 * len(mixed) <= len(runs):
        return 10 if _are_of_characters(runs) else PAIRS_ONLY
    tokens = [token for run in mixed for token in run]
    if any(len(token) == 3 for token in tokens):
        return 10
    return 16 if any(not token.isdigit() for token in tokens) else 10


def _is_unpadded(tokens: Sequence[str]) -> bool:
    """Whether numbers have as many digits as they need, or three each: then one digit is no half of a pair."""
    if all(len(token) == 3 for token in tokens):
        return True
    return any(len(token) != 2 for token in tokens) and not any(len(token) > 1 and token[0] == "0" for token in tokens)


def _are_of_characters(runs: Sequence[Sequence[str]]) -> bool:
    """Whether most runs are frames in characters, read as decimals, and none can be read so only in hexadecimal."""
    if any(not token.isdigit() or len(token) != 2 for tokens in runs for token in tokens):
        return False
    return 2 * sum(is_of_characters(bytes(map(int, tokens))) for tokens in runs) > len(runs)
