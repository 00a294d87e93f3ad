"""The rules of what a Modbus master sends, in words: damaged, cut, wrongly made or given back. Pure: `BusRecord` in,
findings out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from dissectors.findings import Finding, Severity, Tally, counted, found, times
from dissectors.frame import Flaw
from dissectors.late_speakers import MASTER, is_behind
from dissectors.modbus.bus_record import BusRecord
from dissectors.modbus.finding_words import note_if, units, without_check
from dissectors.modbus.functions import BROADCAST
from dissectors.modbus.rules import RULES
from dissectors.modbus.rules_impossible import of_impossible
from dissectors.modbus.rules_of_answers import RELAYED
from dissectors.modbus.rules_station import FLAWS, SPOILT, wrongly_checked
from dissectors.modbus.struck_octet import falls_there_by_chance
from dissectors.words import fine_milliseconds

_CUT_LEAST = 3
_CUT = (Flaw.LAST_MISSING, Flaw.LAST_TWO_MISSING)

_SPEAKS_BEHIND = (
    "something speaks behind that station's answers, into what the master sends next: a second, slower device with its "
    "address, or its own driver; else the request that always comes behind it is sent badly"
)
_WHO_SPEAKS_BEHIND = "unplug that station: whether something answers at its address still, and the damage is gone"


def _behind_whom(seen: BusRecord, requests: int) -> int | None:
    """The station behind whose good answers nearly all damaged requests stand, which no chance does; None where there
    is none. The master itself would damage its requests behind others, too."""
    damaged = seen.damaged_requests.count
    for unit, behind in seen.behind_answers.items():
        if is_behind(behind.count, damaged, seen.stations[unit].answered, requests):
            return unit
    return None


def of_damaged_requests(seen: BusRecord, is_blamed: bool) -> Iterator[Finding]:
    """Requests that came damaged, here or everywhere. `is_blamed`: whether more of the master's frames are damaged than
    of others."""
    requests = sum(station.asked for station in seen.stations.values()) + seen.damaged_requests.count
    damaged = seen.damaged_requests
    count = damaged.count - sum(one.damaged_requests for one in seen.stations.values() if one.has_own_protocol)
    if count > 0:
        words = f"{count} of {counted(requests, 'request')} damaged{seen.when(damaged, requests, count)}"
        severity = note_if(seen.rare(count, requests, damaged) or not is_blamed)
        whose = _behind_whom(seen, requests)
        made = damaged.found(RULES["MB009"], MASTER if whose is None else "bus", words, severity)
        if whose is not None:
            behind = seen.behind_answers[whose].count
            how_many = "all" if behind == damaged.count else str(behind)
            words += f", {how_many} of them directly behind an answer of station {whose}"
            made = replace(made, seen=words, stations=(whose,), means=_SPEAKS_BEHIND, next=_WHO_SPEAKS_BEHIND)
        yield replace(made, count=count)
    if not damaged.count or seen.damaged_here.count > damaged.count:
        yield from _damaged_here(seen, requests)
    yield from _cut_by_master(seen)


def _damaged_here(seen: BusRecord, requests: int) -> Iterator[Finding]:
    """Requests that only this tap hears damaged, since they were answered."""
    damaged, others = seen.damaged_here, sum(station.damaged.count for station in seen.stations.values())
    if damaged.count:
        words = f"{damaged.count} of {counted(requests, 'request')} damaged here, and answered all the same"
        words += seen.when(damaged, requests)
        rare = seen.rare(damaged.count, requests, damaged) or 4 * others > damaged.count
        yield damaged.found(RULES["MB022"], "bus", words, note_if(rare))


def _cut_by_master(seen: BusRecord) -> Iterator[Finding]:
    """The first octet of all answers that come soon enough: somebody else's driver still holds the line."""
    cut = seen.cut_by_master
    if not cut:
        return
    tally = Tally()
    for unit in cut:
        for no in seen.stations[unit].first_lost.evidence:
            tally.add(seen.stations[unit].damaged.first, no)
    count = sum(seen.stations[unit].first_lost.count for unit in cut)
    latest = max(seen.stations[unit].first_lost.last for unit in cut)
    words = f"first octet of {counted(count, 'answer')} lost, of {units(cut)}: all that answer within "
    words += fine_milliseconds(latest)
    if any(unit not in cut and one.times.count for unit, one in seen.stations.items()):
        words += "; slower ones are whole"
    finding = tally.found(RULES["MB012"], "master", words)
    last = max(seen.stations[unit].damaged.last for unit in cut)
    means = "the master's driver, or a converter's, still holds the line when quick stations begin to answer"
    following = "how soon the master's driver lets go after a request; the converter's turnaround time"
    yield replace(finding, count=count, last=last, means=means, next=following, stations=tuple(cut))


def of_requests(seen: BusRecord) -> Iterator[Finding]:
    """What is wrong with what the master sends, and what its own adapter makes of it."""
    yield from of_impossible(seen)
    yield from _to_nobody(seen)
    yield from _cut_echoes(seen)
    yield from _given_back_by_one(seen)
    yield from _relayed(seen)
    yield from _flawed(seen)
    yield from _wrongly_checked(seen)


def _to_nobody(seen: BusRecord) -> Iterator[Finding]:
    """Reads of address 0."""
    nobody = seen.to_nobody
    if nobody.count:
        words = f"{counted(nobody.count, 'read')} of address 0, which is no station's"
        following = RULES["MB017"].next
        if seen.for_nobody:
            words += f"; {units(seen.for_nobody)} answered {times(sum(seen.for_nobody.values()))}"
        found_here = nobody.found(RULES["MB017"], "master", words)
        if BROADCAST in seen.for_nobody:
            means = "a device whose address is 0, as some are delivered, or that takes 0 for whoever is there"
            found_here = replace(found_here, means=f"{found_here.means}; or {means}")
            following = "give the device an address of 1 … 247, and set that in the master"
        elif len(seen.for_nobody) == 1:
            following = f"set the unit number in the master to {next(iter(seen.for_nobody))}"
        yield replace(found_here, next=following)


def _cut_echoes(seen: BusRecord) -> Iterator[Finding]:
    """Requests that something gives back in part."""
    cut = seen.cut_echoes
    if cut.count >= _CUT_LEAST and 2 * cut.count >= seen.requests:
        words = f"{cut.count} of {counted(seen.requests, 'request')} came back at once, and not whole"
        yield cut.found(RULES["MB013"], "bus", words)


def _given_back_by_one(seen: BusRecord) -> Iterator[Finding]:
    """A station that gives requests to it back before it answers them."""
    echoed = {unit: s.echoed for unit, s in seen.stations.items() if s.asked >= 3}
    asked = {unit: seen.stations[unit].asked for unit in echoed}
    answering = [unit for unit in echoed if seen.stations[unit].answered]  # nobody is there to give anything back else
    copying = [unit for unit in answering if 9 * asked[unit] <= 10 * echoed[unit] <= 10 * asked[unit]]
    if len(copying) == 1 and len(echoed) > 1 and sum(echoed.values()) == echoed[copying[0]]:
        station = seen.stations[copying[0]]
        words = f"{station.echoed} of {counted(station.asked, 'request')} came back from it before its answer"
        first, last = seen.first or 0, station.last_heard or 0
        name = f"station {copying[0]}"
        yield found(RULES["MB018"], name, words, first=first, last=last, count=station.echoed)


def _relayed(seen: BusRecord) -> Iterator[Finding]:
    """Requests that a radio or repeater sends on, so that they are heard twice."""
    again = seen.repeated_after
    if again is not None:
        count = seen.again.tally.count
        words = (
            f"{counted(count, 'request')} came a second time {fine_milliseconds(again)} after the first, never a third"
        )
        relayed = seen.again.tally.found(RULES["MB018"], "bus", f"{words}, and were answered then")
        yield replace(relayed, means=RELAYED, next="which radio or repeater is on the way to this tap")


def _flawed(seen: BusRecord) -> Iterator[Finding]:
    """Damaged requests that one change makes good."""
    flaws, damaged = seen.requests_damaged_by, seen.damaged_requests.count
    # where not one is good and all that can be put right have one flaw, the others are two in one read
    of = 4 if damaged == seen.requests and len(flaws) == 1 else 2
    for flaw, tally in flaws.items():
        is_chance = flaw in SPOILT and falls_there_by_chance(seen, "master", tally.count, damaged)
        if tally.count >= _CUT_LEAST and of * tally.count >= damaged and not is_chance:
            words = f"{counted(tally.count, 'request')} good but for one thing: {flaw.value}"
            severity = note_if(seen.rare(tally.count, seen.requests, tally))
            # where not one is good no station can answer; writes that lack their end are not put right
            is_cut = flaw in _CUT and damaged >= seen.requests and 4 * tally.count >= 3 * damaged
            is_always = is_cut or tally.count == seen.requests
            if is_always:
                words += ", every time" if tally.count == seen.requests else f", of {damaged}; not one is good"
                severity = Severity.ERROR
            flawed = tally.found(RULES[FLAWS[flaw]], "master", words, severity)
            yield without_check(flawed, flaw) if is_always else flawed


def _wrongly_checked(seen: BusRecord) -> Iterator[Finding]:
    """Requests whose check is wrong in the same way each time."""
    habit = seen.miscounted_requests
    if habit is not None:
        is_in_vain = not any(station.asked for station in seen.stations.values())  # not one request is good
        severity = Severity.ERROR if is_in_vain else Severity.WARNING
        yield wrongly_checked("master", habit, counted(seen.requests, "request"), severity)
