"""All that a judge remembers, as values that can be compared: what two ways of feeding it must leave alike."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Mapping
from typing import Any


def memory(thing: Any) -> Any:
    """A judge, or anything in it."""
    if isinstance(thing, Mapping):
        order = list(thing.items()) if not isinstance(thing, Counter) else [pair for pair in thing.items() if pair[1]]
        return [(memory(key), memory(value)) for key, value in order]
    if isinstance(thing, list | tuple | deque):
        return [memory(one) for one in thing]
    if isinstance(thing, float):
        return repr(thing)  # also of what is no number
    if isinstance(thing, set | frozenset):
        return sorted(map(repr, thing))
    names = getattr(thing, "__slots__", None) or getattr(thing, "__dict__", None)
    if callable(thing):
        return "asked for words"
    if names is None or not type(thing).__module__.startswith("dissectors"):
        return thing
    return type(thing).__name__, [(name, _in_any_order(name, memory(getattr(thing, name)))) for name in names]


def _in_any_order(name: str, value: Any) -> Any:
    """Of what is only ever asked for by sender, station or bucket the order says nothing."""
    return sorted(value, key=repr) if name in _BY_KEY and isinstance(value, list) else value


_BY_KEY = ("spacing", "close", "paused", "_times", "buckets", "tops")
