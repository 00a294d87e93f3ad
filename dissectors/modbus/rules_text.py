"""Frames of which something on the way took octets for text, in words: of the port that was read, or of one. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from dissectors.findings import Finding, counted, together
from dissectors.late_speakers import MASTER
from dissectors.modbus.bus_record import BusRecord
from dissectors.modbus.finding_words import units
from dissectors.modbus.rules import RULES
from dissectors.modbus.text_changes import TextChange

_OF_ONE: Final = (
    "a converter or gateway in front of this station takes octets for text; or, where nobody else sends them,"
)
_OF_ONE_NEXT: Final = "line ends, flow control and transparent mode of the converter in front of this station; else"


def of_text_changes(seen: BusRecord) -> Iterator[Finding]:
    """One finding of the bus where it befalls several, or all there are; else one of the station."""
    changes = {unit: one.text_damage.change for unit, one in seen.stations.items()}
    others = sum(one.answered > 0 or one.damaged.count > 0 for one in seen.stations.values()) - 1
    for change in TextChange:
        struck = sorted(unit for unit, its in changes.items() if its is change)
        of_master = bool(seen.text_damage.shows(change)) if struck else seen.text_damage.change is change
        if len(struck) == 1 and others and not of_master:
            yield _of_one(seen, change, struck[0])
        elif struck or of_master:
            yield _of_all(seen, change, struck, of_master)


def _of_one(seen: BusRecord, change: TextChange, unit: int) -> Finding:
    damaged = seen.stations[unit].damaged
    words = _words(change, counted(damaged.count, "damaged answer"))
    finding = damaged.found(RULES["MB023"], f"station {unit}", words)
    return replace(finding, means=f"{_OF_ONE} {finding.means}", next=f"{_OF_ONE_NEXT} {finding.next}")


def _of_all(seen: BusRecord, change: TextChange, struck: list[int], of_master: bool) -> Finding:
    requests = (seen.damaged_requests,) if of_master else ()
    tally = together((*(seen.stations[unit].damaged for unit in struck), *requests))
    whose = [*((MASTER,) if of_master else ()), *((units(struck),) if struck else ())]
    words = _words(change, f"{counted(tally.count, 'damaged frame')} of {' and '.join(whose)}")
    return replace(tally.found(RULES["MB023"], "bus", words), stations=tuple(struck))


def _words(change: TextChange, what: str) -> str:
    return f"{change.value}: {what}, and nearly all that were compared are good once that is undone"
