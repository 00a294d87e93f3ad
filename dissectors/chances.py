"""Chances: how likely it is that so much of what falls anywhere falls on one, and what is too rare to say. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from math import erfc, exp, lgamma, log, log1p, sqrt

from dissectors.busiest import is_fault

_EXACT_MOST = 400
_NEGLIGIBLE = 1e-12

SELDOM, SELDOM_ALONE = 0.01, 0.05
"""Chance below which it is none that any sender has so much of all damage; that any has all of it."""

MINUTE = 60_000_000_000  # ns
TOLERABLE = 2
"""Disturbances a minute that Johnson Controls calls tolerable."""

FEW = 100
"""One in so many is worth a warning, however rare."""


def at_least(count: int, of: int, share: float) -> float:
    """How likely `count` or more of `of` fall on who has that share (0 … 1): the upper tail of the binomial.

    Exact, but for what is no surprise among more than 400, which goes by the normal law: that has too thin a tail
    where little was to be expected. 1.0 where it is sure.
    """
    if count <= 0 or share >= 1:
        return 1.0
    if share <= 0 or count > of:
        return 0.0
    if of > _EXACT_MOST and count <= of * share:
        return erfc((count - 0.5 - of * share) / sqrt(2 * of * share * (1 - share))) / 2
    whole, hit, missed = lgamma(of + 1), log(share), log1p(-share)
    total = 0.0
    for k in range(count, of + 1):
        term = exp(whole - lgamma(k + 1) - lgamma(of - k + 1) + k * hit + (of - k) * missed)
        total += term
        if k > of * share and term <= total * _NEGLIGIBLE:  # from there on each is less than the one before
            break
    return min(1.0, total)


def is_by_chance(count: int, of: int, share: float, senders: int) -> bool:
    """Whether what falls anywhere strikes one of so many senders as often as that, now and then: of many one is always
    struck most. `share`: 0 … 1, of what all of them sent. Where nobody else is struck, that speaks for itself."""
    return senders * at_least(count, of, share) >= (SELDOM_ALONE if count == of else SELDOM)


def is_silent_by_chance(asked: int, failed: int, of: int, stations: int) -> bool:
    """Whether any of so many stations that are there would have no good answer to `asked` requests, now and then, on a
    bus where those that are heard have none to `failed` of `of`."""
    return failed > 0 and stations * (failed / of) ** asked >= SELDOM


def is_rare(count: int, of: int, span: int, quarters: Mapping[int, int] | None = None) -> bool:
    """Whether so few in `span` ns are not worth a warning: one; or under 1 in 100 and not surely over two a minute.

    Of few counted ones chance makes more: up to four in one minute, eight in two, 28 in ten. `quarters`: when they
    came; what is rare over a night was none where it was a fault for a quarter of an hour.
    """
    if quarters is not None and is_fault(quarters, of, span):
        return False
    usual = TOLERABLE * max(1, -(-span // MINUTE))
    return count == 1 or (FEW * count < of and count <= usual + 2 * sqrt(usual))
