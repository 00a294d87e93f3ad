"""Consequences of one finding as they are read: what the same rule says of several stations is told once. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from dissectors.findings import Finding
from dissectors.subject import About

_TOGETHER_LEAST = 3
_NAMED = 16
"""Stations that are named; of more it is said how many there are."""


def folded(consequences: Iterable[Finding]) -> Iterator[tuple[str, Finding]]:
    """Consequences of one cause, in their order: of whom, in words, and what is told of it. Of stations about which one
    rule has found something each, the finding that was seen most often stands for all, at the place of the first."""
    made = list(consequences)
    alike: dict[tuple[str, str], list[Finding]] = {}
    for one in made:
        if one.about.kind is About.STATION and not one.about.part:
            alike.setdefault((one.code, one.about.noun), []).append(one)
    told = {id(one): group for group in alike.values() if len(group) >= _TOGETHER_LEAST for one in group}
    for one in made:
        group = told.get(id(one))
        if group is None:
            yield one.subject, one
        elif one is group[0]:
            yield _words(group), max(group, key=lambda other: other.count)


def _words(group: Sequence[Finding]) -> str:
    noun = group[0].about.noun
    addresses = sorted(one.about.station or 0 for one in group)
    named = ", ".join(map(str, addresses[:_NAMED])) + (" …" if len(addresses) > _NAMED else "")
    return f"{len(group)} {noun}{'s' * noun.islower()} ({named})"
