"""A saved capture through the engine: rows with their settled verdicts, in the order of the wire."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import closing
from typing import TYPE_CHECKING, Protocol, TypeVar

from dissectors.profiles import Devices
from sniff.engine.capture import CaptureError
from sniff.engine.engine import Output
from sniff.engine.follow_settings import SessionEngine, dissector_for
from sniff.engine.observer import Observer, observe, observe_tables
from sniff.engine.read_source import ReadSource
from sniff.engine.session import Item, LineEvent, Session
from sniff.engine.verdict_join import JudgedRow, VerdictJoin, Wanted
from sniff.engine.whole_capture import whole

if TYPE_CHECKING:
    from sniff.analysis.point_reader import PointReader
    from sniff.bus.second_proof import SecondProof
    from sniff.engine.column_join import SettledRows
    from sniff.engine.table import Table

Given = TypeVar("Given", covariant=True)


def outputs(items: Iterable[Item], session: Session) -> Iterator[Output | LineEvent]:
    """Run items through a new engine, as `whole` does."""
    yield from whole(SessionEngine(session), items)


def survey(capture: ReadSource, session: Session, *observers: Observer, reference: bool = False) -> None:
    """Hand a whole capture to observers, many rows at a time where they take them so. `reference`: one by one, for
    comparison; the same comes of it. Raises CaptureError as the capture does, when all before the damage was handed
    on."""
    if reference:
        observe(outputs(capture.items(), session), *observers)
        return
    from sniff.bus import two_processes
    from sniff.engine.bulk import tables_of

    items = tables_of(capture, session)
    if not two_processes.divides(session, observers):
        observe_tables(items, *observers)
        return
    with closing(two_processes.divided(items, observers, capture)) as made:
        observe_tables(made, *observers)


def settled(
    items: Iterable[Item],
    session: Session,
    devices: Devices | None = None,
    wanted: Wanted | None = None,
    proof: SecondProof | None = None,
) -> Iterator[JudgedRow]:
    """Run items through a new engine; give the rows that are `wanted` (by default all) with their verdicts.

    With `devices`, also what they mean to them; with `proof`, each when it is known whether it may be a second
    protocol's. Raises CaptureError as `outputs` does.
    """
    from sniff.bus.second_proof import proving

    points = None if devices is None else _points(session, devices)
    settling = VerdictJoin(points, wanted)
    try:
        for output in proving(outputs(items, session), proof):
            if not isinstance(output, Output):
                continue
            for one in (output,) if points is None else output.one_by_one():
                if points is not None:
                    points.remember(one)
                yield from settling.add(one)
    except CaptureError:
        yield from settling.flush()
        raise
    yield from settling.flush()


def settled_in_bulk(
    capture: ReadSource,
    session: Session,
    devices: Devices | None = None,
    wanted: Wanted | None = None,
    proof: SecondProof | None = None,
) -> Iterator[JudgedRow]:
    """The same as `settled`, by way of tables: rows that a filter leaves out never become objects, unless something
    is to be said of devices."""
    from sniff.engine.table_join import TableJoin

    if devices is None:
        return _joined(capture, session, TableJoin(wanted), proof)
    return _joined(capture, session, _Spoken(_points(session, devices), wanted), proof)


def _points(session: Session, devices: Devices) -> PointReader:
    from sniff.analysis.point_reader import PointReader  # with all that says values: for who has devices

    return PointReader(dissector_for(session), devices)


class _Joining(Protocol[Given]):
    """Takes tables in order and gives their rows with what became of them."""

    def add(self, table: Table) -> Iterator[Given]:
        """Take the table that follows; give what is settled by it."""
        ...

    def flush(self) -> Iterator[Given]:
        """Give all that is left."""
        ...


class _Spoken:
    """Joins rows of tables with their verdicts and with what they mean to devices."""

    def __init__(self, points: PointReader, wanted: Wanted | None) -> None:
        self._points = points
        self._settling = VerdictJoin(points, wanted)

    def add(self, table: Table) -> Iterator[JudgedRow]:
        """Take the table that follows; give the rows that are settled by it."""
        for output in table.outputs():
            self._points.remember(output)
            yield from self._settling.add(output)

    def flush(self) -> Iterator[JudgedRow]:
        """Give all that is left."""
        yield from self._settling.flush()


def settled_columns(capture: ReadSource, session: Session, proof: SecondProof | None = None) -> Iterator[SettledRows]:
    """All rows of `settled`, as columns. Raises CaptureError as `settled` does."""
    from sniff.engine.column_join import ColumnJoin

    return _joined(capture, session, ColumnJoin(), proof)


def _joined(
    capture: ReadSource, session: Session, joining: _Joining[Given], proof: SecondProof | None
) -> Iterator[Given]:
    """What a join gives of all tables of a capture; raises what the capture does, when all before it was given."""
    from sniff.bus.second_proof import proving
    from sniff.engine.bulk import tables_of

    try:
        for item in proving(tables_of(capture, session), proof):
            if not isinstance(item, LineEvent):
                yield from joining.add(item)
    except CaptureError:
        yield from joining.flush()
        raise
    yield from joining.flush()
