"""An observer: whatever reads a bus. It is handed what the engine gives, in the order of the wire, and has a value."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol, Self

from sniff.engine.engine import Output
from sniff.engine.session import LineEvent


class Observer(Protocol):
    """Fed by `observe`, live or from a file."""

    def add(self, output: Output) -> None:
        """Take rows and the transactions that closed with them."""
        ...

    def add_line_event(self, event: LineEvent) -> None:
        """Take something that happened to the line, at its place among the rows."""
        ...


class Mergeable(Protocol):
    """An observer of a part of a bus, whose value can be put together with that of the part that follows."""

    def merge(self, later: Self) -> Self:
        """Both together, as a new value: what an observer of the whole would be."""
        ...


def observe(outputs: Iterable[Output | LineEvent], *observers: Observer) -> None:
    """Hand everything to every observer, in order. Raises what `outputs` raises, when all before it was handed on."""
    for item in outputs:
        if isinstance(item, LineEvent):
            for observer in observers:
                observer.add_line_event(item)
        else:
            for observer in observers:
                observer.add(item)
