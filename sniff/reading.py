"""A saved capture through the engine: rows with their settled verdicts, in the order of the wire."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

from dissectors import registry
from dissectors.line import LineSettings
from dissectors.manifest import Dissector
from dissectors.profiles import Devices
from dissectors.tracker import Transaction
from sniff.analysis.points import PointReader
from sniff.engine import Output, Row
from sniff.formats import CaptureError
from sniff.session import ASSUMED, LINE_NOTE, Item, LineEvent, Session
from sniff.session_engine import SessionEngine

HELD = 20_000
"""Rows held back at most while waiting for the verdict of the oldest."""
REMEMBERED = 1000
"""Rows for which a closed transaction is still known after its last one: a row may be placed in it afterwards."""

Wanted = Callable[[Row, Transaction | None], bool]


@dataclass(frozen=True, slots=True)
class Settled:
    """A row with the transaction it belongs to (None: noise, or never closed), and what it says of its device."""

    row: Row
    transaction: Transaction | None
    words: str = ""


class Settling:
    """Holds rows until their transaction has closed, so that each can be shown with its verdict; keeps the order."""

    def __init__(self, points: PointReader | None = None, wanted: Wanted | None = None) -> None:
        """`points`, fed before this, says what rows mean to their devices. Only rows that are `wanted` are given."""
        self._points = points
        self._wanted = wanted
        self._rows: deque[Row] = deque()
        self._closed: dict[int, Transaction] = {}
        self._in_order: deque[Transaction] = deque()  # the same, as they closed

    def add(self, output: Output) -> Iterator[Settled]:
        """Take what the engine gave; give the rows that are settled by it."""
        self._rows.extend(output.rows)
        for transaction in output.transactions:
            self._closed[transaction.id] = transaction
            self._in_order.append(transaction)
        while self._rows and (len(self._rows) > HELD or self._is_settled(self._rows[0])):
            yield from self._pop()

    def flush(self) -> Iterator[Settled]:
        """Give all that is left."""
        while self._rows:
            yield from self._pop()

    def _is_settled(self, row: Row) -> bool:
        return row.placement is None or row.placement.tx in self._closed

    def _pop(self) -> Iterator[Settled]:
        row = self._rows.popleft()
        transaction = None if row.placement is None else self._closed.get(row.placement.tx)
        self._forget(row.no - REMEMBERED)
        if self._wanted is None or self._wanted(row, transaction):
            yield Settled(row, transaction, "" if self._points is None else self._points.words(row))

    def _forget(self, before: int) -> None:
        """Let go of what closed and has no row left that could ask for it."""
        while self._in_order and max(self._in_order[0].request or 0, self._in_order[0].response or 0) < before:
            del self._closed[self._in_order.popleft().id]


def line_is_assumed(session: Session) -> bool:
    """Whether neither the file nor the user says the line settings."""
    return session.line_is_assumed


def with_settings(session: Session, protocol: str | None = None, line: LineSettings | None = None) -> Session:
    """The session with what the user says instead of what the file says.

    A line that is only assumed becomes that of the protocol said. Raises registry.UnknownProtocol where it must know.
    """
    if line is not None:
        notes = {name: text for name, text in session.notes.items() if name != LINE_NOTE or text != ASSUMED}
        session = replace(session, notes=notes)
    elif protocol is not None and line_is_assumed(session):
        session = replace(session, line=LineSettings.parse(registry.get(protocol).default_line))
    said = [name for name, value in (("line", line), ("protocol", protocol)) if value is not None]
    unknown = tuple(name for name in session.unknown if name not in said)
    return replace(
        session,
        protocol=protocol or session.protocol,
        line=line or session.line,
        unknown=unknown,
        given=session.given or (bool(session.unknown) and not unknown),
    ).with_latency_of_reads()


def outputs(items: Iterable[Item], session: Session, pairing: bool = True) -> Iterator[Output | LineEvent]:
    """Run items through a new engine; line events pass through at their place. Raises CaptureError as `items` does,
    when all that was whole before the damage has been given. `pairing`: else no row is placed in a transaction."""
    engine = SessionEngine(session, pairing)
    try:
        for item in items:
            output = engine.take(item)
            if output:
                yield output
            if isinstance(item, LineEvent):
                yield item
    except CaptureError:
        yield engine.close()
        raise
    yield engine.close()


def settled(
    items: Iterable[Item], session: Session, devices: Devices | None = None, wanted: Wanted | None = None
) -> Iterator[Settled]:
    """Run items through a new engine; give the rows that are `wanted` (by default all) with their verdicts.

    Where the device is known, also what they mean to it. Raises CaptureError as `outputs` does.
    """
    points = PointReader(dissector_for(session), devices) if devices else None
    settling = Settling(points, wanted)
    try:
        for output in outputs(items, session):
            if isinstance(output, Output):
                if points is not None:
                    points.remember(output)
                yield from settling.add(output)
    except CaptureError:
        yield from settling.flush()
        raise
    yield from settling.flush()


def dissector_for(session: Session) -> Dissector:
    """The protocol of a session. Raises registry.UnknownProtocol."""
    return registry.get(session.protocol)


def engine_for(session: Session) -> SessionEngine:
    """A new engine for a session. Raises registry.UnknownProtocol."""
    return SessionEngine(session)
