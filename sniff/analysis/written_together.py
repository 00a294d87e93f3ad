"""Findings about what one request writes: many registers that it may not write are one thing that is wrong. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from dissectors.findings import Tally

NAMED = 4
"""So many of the things written are named."""

VERBS = {
    "PR002": "written, though they are reserved",
    "PR003": "written, though they are read only",
}
"""By rule: what is said of several things that were always written together."""


@dataclass(frozen=True, slots=True)
class Written:
    """One thing of a device that a master wrote, which it may not. `key` is whose finding it is, `thing` its name."""

    key: tuple[str, object, str]
    thing: str
    tally: Tally


def together(written: Iterable[Written]) -> Iterator[tuple[Written, str]]:
    """Each thing that was written alone, and the first of those that were always written in the same requests, with
    what is seen of them all; of one alone nothing is said here ("")."""
    groups: dict[tuple[object, ...], list[Written]] = {}
    for one in written:
        code, subject, _ = one.key
        tally = one.tally
        groups.setdefault((code, subject, tally.count, tally.first, tally.last, *tally.evidence), []).append(one)
    for group in groups.values():
        named = ", ".join(one.thing for one in group[:NAMED])
        more = f" and {len(group) - NAMED} more" if len(group) > NAMED else ""
        yield group[0], f"{named}{more} {VERBS[group[0].key[0]]}" if len(group) > 1 else ""
