"""What this tap does not hear: the rule of such answers, which the master's doings tell, and what comes of it. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from dissectors.findings import Finding, Severity, as_consequence, counted, together
from dissectors.modbus.bus_record import BusRecord
from dissectors.modbus.finding_words import note_if, units
from dissectors.modbus.rules import RULES

_NOT_HEARD = "answers that this tap does not hear: a signal too weak here, or reads that the recording lost"


def of_unheard(seen: BusRecord, unheard: Sequence[int]) -> Iterator[Finding]:
    """One finding for all stations whose answers are missing here."""
    if not unheard:
        return
    stations = [seen.stations[unit] for unit in unheard]
    missing, asked = together(one.missing for one in stations), sum(one.asked for one in stations)
    count = missing.count
    if seen.hears_nobody and len(stations) > 1:
        words = (
            f"no answer heard from anybody: {counted(count, 'request')} to {units(unheard)}, none of them sent again"
        )
        severity: Severity | None = Severity.ERROR
    else:
        words = (
            f"no answer heard to {count} of {counted(asked, 'request')} to {units(unheard)}; the master went on as "
            "after an answer, neither waiting nor asking again"
        )
        words += seen.when(missing, asked)
        severity = note_if(seen.rare(count, asked, missing))
    finding = missing.found(RULES["MB020"], "bus", words, severity)
    never = [unit for unit in unheard if seen.stations[unit].last_heard is None]
    if never and not seen.hears_nobody:  # nothing that it sent proves that it is there
        finding = replace(finding, means=f"{_NOT_HEARD}; or {units(never)} off, of a master that waits no longer")
    yield finding


def under_what_is_missed(seen: BusRecord, made: Sequence[Finding]) -> Iterator[Finding]:
    """The findings; what a tap makes of good stations when it hears the master badly stands under that.

    Where requests arrive damaged here, a station that leaves out no more than that may have got as many of them
    damaged. Where most answers come unasked, a confirmed write stands for a request, and the next answer does not fit.
    """
    graves = {one.code: one for one in made if one.severity >= Severity.WARNING}
    damaged, unasked = graves.get("MB022"), graves.get("MB207")
    if unasked is not None and 2 * unasked.count <= seen.answers:
        unasked = None
    for one in made:
        if damaged is not None and one.code == "MB002" and one.count <= seen.damaged_here.count:
            yield as_consequence(one, damaged, RULES)
        elif unasked is not None and one.code in _OF_WRONG_REQUESTS:
            yield as_consequence(one, unasked, RULES)
        else:
            yield one


_OF_WRONG_REQUESTS = ("MB010", "MB206")
