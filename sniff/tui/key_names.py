"""Names of what keys do, by which a configuration gives it other keys: `[keys] mark = "ctrl+b"`.

The name is that of the action: "mark", "next_mark", "freeze"; of one that goes two ways "error" and "error-back"; of
one that shows a screen "switch-frames".
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from textual.binding import Binding, BindingType

from sniff.config import nearest

_ACTION = re.compile(r"(?:\w+\.)?(\w+)(?:\((.*)\))?")
KNOWN: set[str] = set()
"""All names that were given."""


def name_of(action: str) -> str:
    """The name of an action: `find_on(-1)` is "find_on-back"."""
    match = _ACTION.fullmatch(action)
    if match is None:
        return action
    name, argument = match[1], (match[2] or "").strip("'\" ")
    if argument in ("", "1"):
        return name
    if re.fullmatch(r"-\d+", argument):
        return f"{name}-back" if argument == "-1" else f"{name}-back{argument[1:]}"
    return f"{name}-{argument}"


def named(bindings: Iterable[BindingType]) -> list[BindingType]:
    """The bindings, each with the name of its action."""
    made: list[BindingType] = []
    for one in bindings:
        if isinstance(one, Binding) and one.id is None:
            one = replace(one, id=name_of(one.action))
        if isinstance(one, Binding) and one.id is not None:
            KNOWN.add(one.id)
        made.append(one)
    return made


def keymap(wanted: Mapping[str, str]) -> dict[str, str]:
    """The keys that a configuration gives to names that there are."""
    return {name: key for name, key in wanted.items() if name in KNOWN and key}


def complaints(wanted: Mapping[str, str]) -> Iterator[str]:
    """What is to be said of names that there are not."""
    known = tuple(sorted(KNOWN))
    return (f"[keys] unknown name {name!r}{nearest(name, known)}" for name in wanted if name not in known)
