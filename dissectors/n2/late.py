"""Late N2 stations: those that most likely answer into what the master sends next, in words. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from dissectors.findings import Finding
from dissectors.late_speakers import MASTER, NOBODY, Heard, LateSpeakers, late_speakers, told
from dissectors.n2.rules import RULES
from dissectors.n2.wording import N2Evidence


def of_late_speakers(heard: N2Evidence, late: LateSpeakers) -> Iterator[Finding]:
    """Those whose frames are hit are not to blame for their damage."""
    whole = {f"station {address}": one.answered for address, one in heard.stations.items()}
    whole[MASTER] = whole[NOBODY] = heard.master.frames - heard.master.bad.count
    known = {address: Heard(one.answered, one.late.count, one.missing.count) for address, one in heard.stations.items()}
    for one in late_speakers(late, whole, known):
        made = one.window.damage.found(RULES["N2014"], f"station {one.station}", told(one))
        yield replace(made, stations=(one.station, *sorted({*one.stations_hit, *one.silenced} - {one.station})))
