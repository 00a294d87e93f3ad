"""Late N2 stations: those that most likely answer into what the master sends next, in words. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from dissectors.chances import is_rare
from dissectors.findings import Finding, Severity, counted, together
from dissectors.impatience import impatience
from dissectors.late_speakers import MASTER, NOBODY, Heard, LateSpeakers, is_behind, late_speakers, told
from dissectors.n2.record import N2StationRecord
from dissectors.n2.rules import RULES
from dissectors.n2.wording import N2Evidence
from dissectors.perhaps_late import perhaps_late


def of_late_speakers(heard: N2Evidence, late: LateSpeakers) -> Iterator[Finding]:
    """Those whose frames are hit are not to blame for their damage."""
    whole = {f"station {address}": one.answered for address, one in heard.stations.items()}
    whole[MASTER] = whole[NOBODY] = heard.master.frames - heard.master.bad.count
    known = {address: Heard(one.answered, one.late.count, one.missing.count) for address, one in heard.stations.items()}
    told_of: set[int] = set()
    for one in late_speakers(late, whole, known):
        told_of.add(one.station)
        made = one.window.damage.found(RULES["N2014"], f"station {one.station}", told(one))
        yield replace(made, stations=(one.station, *sorted({*one.stations_hit, *one.silenced} - {one.station})))
    for address, station in sorted(heard.stations.items()):
        if address not in told_of and _is_behind(heard, station):
            seen = (
                f"{station.behind.count} of {counted(heard.master.bad.count, 'damaged command')} came directly behind "
            )
            seen += "a command to it that nothing had followed"
            told_of.add(address)
            yield station.behind.found(RULES["N2014"], f"station {address}", seen)
    yield from _of_impatience(heard, late, known)
    perhaps = perhaps_late(late, whole, known) if not told_of else None
    if perhaps is not None and not is_rare(perhaps.struck, perhaps.of + perhaps.of_elsewhere, heard.span):
        yield perhaps.told_of(RULES["N2014"])


def _of_impatience(heard: N2Evidence, late: LateSpeakers, known: Mapping[int, Heard]) -> Iterator[Finding]:
    """A master that gives up before most of its stations answer."""
    shown = impatience(late, known)
    if shown is None:
        return
    stations = ", ".join(map(str, shown.late))
    seen = f"{counted(shown.answers, 'answer')} of stations {stations} came after the master had gone on"
    if shown.damaged:
        seen += f"; {shown.overdue} of {counted(shown.damaged, 'damaged frame')} stand where an answer was overdue"
    tally = together(heard.stations[address].late for address in shown.late)
    severity = Severity.NOTE if is_rare(shown.in_vain, heard.master.frames, heard.span) else None
    yield tally.found(RULES["N2017"], MASTER, seen, severity)


def _is_behind(heard: N2Evidence, station: N2StationRecord) -> bool:
    """Whether damaged commands stand behind unanswered ones to a station that is there, more than chance explains."""
    is_there = station.answered or station.late.count or station.sent.bad.count
    silent = station.missing.count + station.late.count
    return bool(is_there) and is_behind(station.behind.count, heard.master.bad.count, silent, heard.master.frames)
