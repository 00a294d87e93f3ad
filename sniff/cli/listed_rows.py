"""Rows of a capture for commands that list them, with those of a second protocol from where it is proven.

A bus with one protocol is read once. Where a second one turns up on the way, the capture is read anew from its begin,
and listed on from the first row that may be one of its frames.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator

from dissectors import registry
from dissectors.profiles import Devices
from dissectors.tracker import Transaction
from sniff.bus.offline import settled, settled_in_bulk
from sniff.bus.second_proof import SecondProof
from sniff.bus.second_protocol import Judged, of_both
from sniff.cli import filtering
from sniff.cli.progress import Watched
from sniff.engine.capture import Capture
from sniff.engine.engine import Row
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Session
from sniff.engine.verdict_join import JudgedRow, Wanted


def _every_row(row: Row, transaction: Transaction | None) -> bool:
    return True


class ListedRows:
    """Rows that -Y accepts (`wanted`; None: all), each with the dissector of its protocol. `noting`: shows every row to
    somebody who wants to know of all. Raises CaptureError as the capture does, when all before the damage was given."""

    def __init__(
        self,
        args: argparse.Namespace,
        capture: Capture,
        session: Session,
        proof: SecondProof,
        wanted: Wanted | None,
        noting: Callable[[Wanted | None], Wanted | None] = lambda wanted: wanted,
    ) -> None:
        self._args, self._session = args, session
        self._watched = Watched(capture, prints=True)
        self._proof, self._wanted, self._noting = proof, noting(wanted), noting

    def all(self, devices: Devices | None) -> Iterator[Judged]:
        """All of them. `devices`: say what rows mean to them."""
        yield from self._of_first(devices)
        yield from self.of_both(devices)

    def of_both(self, devices: Devices | None) -> Iterator[Judged]:
        """Those from where a second protocol is proven."""
        name = self._proof.name
        if registry.is_of_lines(name):
            filters = self._args.filter
            of_second = filtering.of_second(self._args, self._session, name) if filters else _every_row
            asked = None if of_second is None else self._noting(of_second)
            items = self._settled(devices, None, None)
            yield from of_both(items, self._session, name, self._wanted or _every_row, asked, self._proof.since)

    def _of_first(self, devices: Devices | None) -> Iterator[Judged]:
        """Those before."""
        proof, dissector = self._proof, dissector_for(self._session)
        if proof.name and not proof.since:
            return
        for item in self._settled(devices, self._wanted, proof):
            if proof.name and item.row.no >= proof.since:
                return
            yield item, dissector

    def _settled(
        self, devices: Devices | None, wanted: Wanted | None, proof: SecondProof | None
    ) -> Iterator[JudgedRow]:
        if self._args.reference:
            return settled(self._watched.items(), self._session, devices, wanted, proof)
        return settled_in_bulk(self._watched, self._session, devices, wanted, proof)
