"""A capture read whole, with all that a test asks about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from dissectors.findings import Finding
from dissectors.frame import Frame
from dissectors.manifest import Dissector
from dissectors.profiles import Devices
from dissectors.tracker import Transaction
from sniff.analysis.points import Point
from sniff.analysis.summary import Summary
from sniff.analysis.told_protocol import detected
from sniff.bus.model import BusModel
from sniff.bus.offline import survey
from sniff.devices import noted, noted_devices
from sniff.engine.capture import CaptureError
from sniff.engine.engine import Output, Row
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Completeness, LineEvent, Session
from sniff.engine.verdict_join import JudgedRow
from sniff.formats import read
from sniff.formats.several_buses import SeveralBuses


@dataclass(frozen=True, slots=True)
class CaptureReading:
    """Everything that this program finds in a capture.

    `rows`: frames and noise in the order of the wire, each with its transaction. `transactions`: in the order of
    closing. `nodes`, `counts`: statistics. `findings`, `points`: as `check` and `points` give them. `devices`: profiles
    by address, as the capture names them (`# device: 3=teco-e510` of a text capture); `unknown_devices`: those among
    them that are not known here.
    """

    path: Path
    session: Session
    dissector: Dissector
    rows: tuple[JudgedRow, ...]
    transactions: tuple[Transaction, ...]
    line_events: tuple[LineEvent, ...]
    counts: Summary
    completeness: Completeness
    findings: tuple[Finding, ...] = ()
    points: tuple[Point, ...] = ()
    devices: Mapping[str, str] = field(default_factory=dict)
    unknown_devices: tuple[str, ...] = ()

    @property
    def frames(self) -> tuple[Row, ...]:
        """Frames without the noise."""
        return tuple(item.row for item in self.rows if isinstance(item.row.event, Frame))

    @property
    def nodes(self) -> dict[int, Any]:
        """Stations by address (`sniff.analysis.nodes.Node`)."""
        return {node.address: node for node in self.counts.nodes.present()}


def read_capture(path: str | Path, said: Devices | None = None) -> CaptureReading:
    """Read a capture whole. `said`: devices, before those that it names. Raises CaptureError, UnknownProtocol."""
    place = Path(path)
    capture = read(place)
    if isinstance(capture, SeveralBuses):
        raise CaptureError(
            f"{place}: {len(capture.buses)} buses in it ({capture.listed}), and a test is of one; take it out: "
            f"sniff485 convert {place.name} NAME.mcap --bus NAME"
        )
    session = capture.session = detected(capture.session)
    dissector = dissector_for(session)
    known, unknown = noted(session)
    devices = (said or Devices()).over(noted_devices(session))
    model, kept = BusModel(session, dissector, devices), _Kept()
    survey(capture, session, model, kept)
    closed = {transaction.id: transaction for transaction in kept.transactions}
    return CaptureReading(
        path=place,
        session=session,
        dissector=dissector,
        rows=tuple(
            JudgedRow(row, closed.get(row.placement.tx) if row.placement is not None else None) for row in kept.rows
        ),
        transactions=tuple(closed.values()),
        line_events=tuple(kept.events),
        counts=model.summary,
        completeness=capture.completeness(),
        findings=model.findings(),
        points=tuple(model.points),
        devices=known,
        unknown_devices=unknown,
    )


class _Kept:
    """Everything that a capture gives, one after the other."""

    def __init__(self) -> None:
        self.rows: list[Row] = []
        self.transactions: list[Transaction] = []
        self.events: list[LineEvent] = []

    def add(self, output: Output) -> None:
        """Keep rows and transactions."""
        self.rows.extend(output.rows)
        self.transactions.extend(output.transactions)

    def add_line_event(self, event: LineEvent) -> None:
        """Keep it."""
        self.events.append(event)
