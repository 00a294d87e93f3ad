"""An observer: whatever reads a bus. It is handed what the engine gives, in the order of the wire, and has a value."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from sniff.engine.engine import Output
from sniff.engine.session import LineEvent

if TYPE_CHECKING:
    from sniff.engine.table import Table


class Observer(Protocol):
    """Fed by `observe`, live or from a file."""

    def add(self, output: Output) -> None:
        """Take rows and the transactions that closed with them."""
        ...

    def add_line_event(self, event: LineEvent) -> None:
        """Take something that happened to the line, at its place among the rows."""
        ...


@runtime_checkable
class TableObserver(Protocol):
    """An observer that takes many rows at once."""

    def add_table(self, table: Table) -> None:
        """Take rows and transactions; the same as one after the other."""
        ...


def observe_tables(items: Iterable[Table | LineEvent], *observers: Observer) -> None:
    """The same with tables; those who only take row by row get them so. Raises what `items` raises."""
    by_table = [one for one in observers if isinstance(one, TableObserver)]
    by_row = [one for one in observers if not isinstance(one, TableObserver)]
    for item in items:
        if isinstance(item, LineEvent):
            for observer in observers:
                observer.add_line_event(item)
            continue
        for observer in by_table:
            observer.add_table(item)
        if by_row:
            for output in item.outputs():
                for row_observer in by_row:
                    row_observer.add(output)


def observe(outputs: Iterable[Output | LineEvent], *observers: Observer) -> None:
    """Hand everything to every observer, in order. Raises what `outputs` raises, when all before it was handed on."""
    for item in outputs:
        if isinstance(item, LineEvent):
            for observer in observers:
                observer.add_line_event(item)
        else:
            for observer in observers:
                observer.add(item)
