"""The words of the findings about an N2 bus."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

from dissectors.chances import at_least, is_rare, is_silent_by_chance
from dissectors.findings import Finding, Severity, Tally, counted, times, together
from dissectors.frame import Flaw
from dissectors.last_silence import fallen_silent
from dissectors.line import MS, NS_PER_S
from dissectors.n2 import meanings
from dissectors.n2.blame import blamed
from dissectors.n2.commands import error_name
from dissectors.n2.masters import HASTE, Masters
from dissectors.n2.objects import REGIONS, attribute_name, number, object_name
from dissectors.n2.record import Damages, N2StationRecord
from dissectors.n2.repeats import is_repeated_by_all, repeats_of_all
from dissectors.n2.rules import RULES
from dissectors.n2.unheard import SOON
from dissectors.strikes import Strikes
from dissectors.words import duration

SLOW = SOON
"""Answers after which an NAE with the shortest timeout would have given up, ns."""

OVERRIDE_AGE = 600 * NS_PER_S
"""After 10 minutes an override should have been renewed or released; the F510's do not expire (its manual, 1.2.2)."""

ALIKE = 3
"""So many frames of one sender damaged in the same way are no chance, where 4 in 5 of its damaged ones are."""

ALIKE_OFF = 6
"""The same of checksums that are wrong by one and the same number: single bits are often wrong by the same."""

TRIES = 11
"""Most commands of one turn to a station: a first one and the most retries that an NAE can be given (3 to 10)."""

_OF_DAMAGE = 20  # damaged commands for each thing that one master would not do: noise makes some look so
_INTO_ANSWERS = 3
_SELDOM = 0.002

SCAN = 8
"""So many addresses that are only asked who they are, and are not there, are a scan."""


@dataclass(frozen=True, slots=True)
class N2Evidence:
    """All that was gathered up to `now` (ns), within `span` ns."""

    now: int
    span: int
    master: Damages
    stations: Mapping[int, N2StationRecord]
    masters: Masters
    soon: Tally  # commands that came sooner than the master goes on behind an answer
    stray: Tally
    strikes: Strikes
    clocked: bool  # the master sends by a clock: that it goes on says nothing of an answer

    @property
    def speaks_into_answers(self) -> bool:
        """Whether so many damaged commands stand where an answer is due as chance does not explain."""
        struck, silent = self.masters.damaged.count, 0
        for one in self.stations.values():
            silent += one.missing.tally().count + one.unheard.tally().count + one.late.count
        if self.clocked or struck < _INTO_ANSWERS or silent >= self.master.frames:
            return False
        return at_least(struck, self.master.bad.count, silent / self.master.frames) < _SELDOM

    def missing(self, station: N2StationRecord) -> Tally:
        """Commands to it that no answer followed, as far as is known."""
        parts = [station.missing.tally(), *([station.unheard.tally()] if self.clocked else [])]
        return together([one for one in parts if one.count] or parts[:1])

    def late_of(self, address: int) -> int:
        """How many answers of a station came after the master had gone on, as far as that is known."""
        other = self.stations.get(address)
        return 0 if other is None else other.late.count + other.slow.count

    def unheard(self, station: N2StationRecord) -> Tally:
        """Commands to it whose answer the master had."""
        return Tally() if self.clocked else station.unheard.tally()

    def is_rare(self, tally: Tally, of: int) -> bool:
        """Whether so few are not worth a warning."""
        return is_rare(tally.count, of, self.span, tally.quarters)

    def noted_if(self, rare: bool, finding: Finding) -> Finding:
        """The finding, only as a note where it is rare."""
        return replace(finding, severity=Severity.NOTE) if rare else finding


def worded(heard: N2Evidence) -> Iterator[Finding]:
    """All findings: the bus first, then station by station."""
    masters = heard.masters
    if masters.seen.count >= 2 and _OF_DAMAGE * masters.seen.count >= heard.master.bad.count:
        seen = f"{masters.seen.count} times what one master would not do: a command in the middle of another one, "
        seen += "or before its answer can have come"
        yield masters.seen.found(RULES["N2007"], "bus", seen)
    elif heard.speaks_into_answers:
        seen = f"{masters.damaged.count} of {counted(heard.master.bad.count, 'damaged command')} came while the answer "
        seen += f"to the one before was due, sooner than a master gives up ({duration(HASTE)})"
        yield masters.damaged.found(RULES["N2007"], "bus", seen)
    elif heard.soon.count:
        seen = f"{times(heard.soon.count)} a command followed another one, that nothing came to, sooner than three in "
        seen += "four follow an answer"
        yield heard.soon.found(RULES["N2007"], "bus", seen)
    if heard.stray.count:
        seen = f"{counted(heard.stray.count, 'answer')} came unasked"
        finding = meanings.of_unasked_answers(heard.stray.found(RULES["N2011"], "bus", seen))
        yield heard.noted_if(heard.is_rare(heard.stray, heard.master.frames), finding)
    yield from _alike(heard)
    yield from _damaged(heard)
    scanned = _scanned(heard)
    yield from _scan(heard, scanned)
    yield from _unheard(heard)
    silent = _silent(heard, scanned)
    if silent:
        yield _nobody(heard, silent)
    if is_repeated_by_all(heard.stations.values()):
        yield repeats_of_all(heard.stations.values())
    told = scanned | silent | _only_unheard(heard)
    for address in sorted(heard.stations):
        yield from _of_station(heard, f"station {address}", heard.stations[address], address in told)


# --- damage ---


def _senders(heard: N2Evidence) -> dict[str, Damages]:
    return {"master": heard.master} | {f"station {a}": heard.stations[a].sent for a in sorted(heard.stations)}


def _damaged(heard: N2Evidence) -> Iterator[Finding]:
    """Damaged frames, at their sender or at the bus."""
    senders = _senders(heard)
    frames = sum(sent.frames for sent in senders.values())
    found = blamed(senders, heard.strikes)
    among = [name for name, one in senders.items() if one.bad.count and name not in found]
    for subject, tally in found.items():
        of = senders[subject].frames if subject in senders else frames
        what = {"bus": "frame", "master": "command"}.get(subject, "answer")
        seen = f"{counted(tally.count, f'damaged {what}')} of {of}"
        is_everybodys = subject == "bus" and len(among) > 1 and tally.count >= ALIKE
        if subject == "bus":
            seen += ", of each sender about as much as it sends" if is_everybodys else "; too few to say whose they are"
        finding = meanings.of_damage(tally.found(RULES["N2004"], subject, seen), is_everybodys=is_everybodys)
        yield heard.noted_if(heard.is_rare(tally, of), finding)


_OF_DRIVERS = frozenset(Flaw) - {Flaw.CHECK_SWAPPED, Flaw.ONE_SPOILT, Flaw.ONE_MISSING}
"""What a driver makes that is switched on too late or off too soon: the station's own, or a converter's before it."""


def _alike(heard: N2Evidence) -> Iterator[Finding]:
    """Senders whose frames are damaged in one and the same way."""
    senders = {name: sent for name, sent in _senders(heard).items() if sent.frames}
    found = {name: flaw for name, sent in senders.items() if (flaw := _flaw(sent)) is not None}
    stations = [name for name, sent in senders.items() if name != "master" and (sent.frames >= ALIKE or sent.bad.count)]
    flaws = {found.get(name) or _only_flaw(senders[name]) for name in stations}
    if (
        found.keys() - {"master"}
        and len(flaws) == 1
        and (flaw := flaws.pop()) is not None
        and (len(stations) > 1 or flaw in _OF_DRIVERS)
    ):
        tallies = [senders[name].flaws[flaw] for name in stations]
        tally = Tally(sum(one.count for one in tallies), min(one.first for one in tallies))
        tally.last = max(one.last for one in tallies)
        tally.evidence = sorted(frame for one in tallies for frame in one.evidence)
        whose = "all stations" if len(stations) > 1 else f"{stations[0]}, the only one heard: its own or a converter's"
        seen = f"{_flaw_words(flaw)} in {counted(tally.count, 'answer')} of {whose}"
        yield meanings.of_flaw(tally.found(RULES["N2012"], "bus", seen), flaw, of_all=len(stations) > 1)
        found = {name: flaw for name, flaw in found.items() if name not in stations}
    for name, flaw in found.items():
        sent, tally = senders[name], senders[name].flaws[flaw]
        what = "command" if name == "master" else "answer"
        seen = f"{_flaw_words(flaw)} in {tally.count} of {counted(sent.frames, what)}"
        severity = Severity.ERROR if 2 * tally.count >= sent.frames else Severity.WARNING
        yield meanings.of_flaw(tally.found(RULES["N2012"], name, seen, severity), flaw)


def _flaw(sent: Damages) -> Flaw | int | None:
    """The flaw that nearly all damaged frames of a sender have."""
    for flaw, tally in sent.flaws.items():
        least = ALIKE if isinstance(flaw, Flaw) else ALIKE_OFF
        if tally.count >= least and 5 * tally.count >= 4 * sent.bad.count:
            return flaw
    return None


def _only_flaw(sent: Damages) -> Flaw | int | None:
    """The flaw that all frames of a sender of few have."""
    flaws = [flaw for flaw, tally in sent.flaws.items() if tally.count == sent.frames]
    return flaws[0] if len(flaws) == 1 else None


def _flaw_words(flaw: Flaw | int) -> str:
    return f"always the same: {flaw.value if isinstance(flaw, Flaw) else f'checksum {flaw:02X}h too large'}"


# --- who is not there ---


def _scanned(heard: N2Evidence) -> frozenset[int]:
    """Addresses that are only asked who they are, and are not there, where they are many."""
    absent = [address for address, one in heard.stations.items() if one.asked and not one.answered]
    scanned = frozenset(a for a in absent if heard.stations[a].only_identify and heard.missing(heard.stations[a]).count)
    return scanned if len(scanned) >= SCAN else frozenset()


def _scan(heard: N2Evidence, scanned: frozenset[int]) -> Iterator[Finding]:
    if not scanned:
        return
    tally = Tally()
    for address in sorted(scanned):
        one = heard.missing(heard.stations[address])
        tally.add(one.first, *one.evidence[:1])
        tally.last = max(tally.last, one.last)
    seen = f"{len(scanned)} addresses were asked who they are, and did not answer"
    yield tally.found(RULES["N2005"], "master", seen, Severity.NOTE)


def _only_unheard(heard: N2Evidence) -> frozenset[int]:
    """Stations that are there, and of which this tap hears nothing."""
    return frozenset(
        address
        for address, one in heard.stations.items()
        if not one.answered and heard.unheard(one).count > heard.missing(one).count
    )


def _unheard(heard: N2Evidence) -> Iterator[Finding]:
    """Answers that the master had, and this tap did not hear."""
    missed = {address: tally for address, one in heard.stations.items() if (tally := heard.unheard(one)).count}
    if not missed:
        return
    tally, asked = together(missed.values()), sum(heard.stations[address].asked for address in missed)
    whose = ", ".join(map(str, sorted(missed)[:MANY_POINTS])) + (" and more" if len(missed) > MANY_POINTS else "")
    seen = f"{tally.count} of {counted(asked, 'answer')} (of {'station' if len(missed) == 1 else 'stations'} {whose}) "
    seen += (
        f"{'was' if asked == 1 else 'were'} not heard: the master went on to another command, sooner than it gives up"
    )
    yield heard.noted_if(heard.is_rare(tally, asked), tally.found(RULES["N2015"], "bus", seen))


_STRAY = 4
"""Of so many commands to nobody who is heard one may be followed by octets that are no good frame."""


def _silent(heard: N2Evidence, scanned: frozenset[int]) -> frozenset[int]:
    """All stations that were asked, where they are several and none was heard at all but for stray octets."""
    asked = {address: one for address, one in heard.stations.items() if one.asked and address not in scanned}
    if len(asked) < 2 or heard.stray.count:
        return frozenset()
    if any(
        one.answered or one.late.count or _STRAY * one.sent.bad.count > one.asked for one in heard.stations.values()
    ):
        return frozenset()
    return frozenset(address for address, one in asked.items() if heard.missing(one).count > heard.unheard(one).count)


def _nobody(heard: N2Evidence, silent: frozenset[int]) -> Finding:
    """No station is heard: one thing that is wrong, at this place of the bus or behind the master."""
    each = [_missing(heard, "", heard.stations[address]) for address in sorted(silent)]
    tally = together([heard.missing(heard.stations[address]) for address in silent])
    asked = sum(heard.stations[address].asked for address in silent)
    seen = f"no answer to any of {asked} commands to {len(silent)} stations: only the master is heard"
    return tally.found(RULES["N2005"], "bus", seen, max(one.severity for one in each))


def _missing(heard: N2Evidence, name: str, station: N2StationRecord) -> Finding:
    tally, rule = heard.missing(station), RULES["N2005"]
    if not station.answered and not station.late.count:
        if station.asked <= (TRIES if station.turns <= 1 else 1):  # of another turn nobody knows yet what became
            tries = "the only command" if station.asked == 1 else f"the {station.asked} commands of one turn"
            return tally.found(rule, name, f"no answer to {tries}", Severity.NOTE)
        there = [one for one in heard.stations.values() if one.answered or one.late.count]
        failed = sum(heard.missing(one).count + one.sent.bad.count for one in there)
        of = sum(one.asked for one in there)
        is_chance = is_silent_by_chance(station.asked, failed, of, len(there) + 1)
        seen = f"no answer to any of {counted(station.asked, 'command')}"
        seen += f"; {failed} of {of} to the others have no good one either" if is_chance else ""
        return tally.found(rule, name, seen, Severity.NOTE if is_chance else Severity.ERROR)
    finding = tally.found(rule, name, f"no answer to {tally.count} of {counted(station.asked, 'command')}")
    finding = heard.noted_if(heard.is_rare(tally, station.asked), finding)
    is_unheard = heard.unheard(station).count > 0  # then it may be this tap alone that hears nothing of it
    return finding if is_unheard else fallen_silent(finding, station.silence, heard.now)


# --- stations ---


def _of_station(heard: N2Evidence, name: str, station: N2StationRecord, is_told: bool) -> Iterable[Finding]:
    if station.resets.count:
        seen = f"answered N00 {times(station.refused_while_reset)}: {counted(station.resets.count, 'reset')}"
        yield station.resets.found(RULES["N2001"], name, seen)
    elif station.resets_told.count:
        seen = f"reset {times(station.resets_told.count)}, as its master had told it to"
        yield meanings.of_ordered_reset(station.resets_told.found(RULES["N2001"], name, seen, Severity.NOTE))
    yield from _points(name, station)
    if station.slow.count:
        yield _slow(heard, name, station)
    if heard.missing(station).count and not is_told:
        yield _missing(heard, name, station)
    yield from _misfits(heard, name, station)
    yield from _overrides(heard, name, station)
    yield from _again(heard, name, station, is_repeated_by_all(heard.stations.values()))
    refused = sum(tally.count for tally in station.refused.values())
    is_all = refused >= REFUSED_LEAST and refused == station.answered
    for (code, title), tally in sorted(station.refused.items()):
        words = f"N{code} {error_name(code)}".rstrip()
        seen = f"{title} refused {times(tally.count)}: {words}" + ("; it obeys nothing" if is_all else "")
        finding = tally.found(RULES["N2009"], name, seen, Severity.WARNING if is_all else None)
        yield meanings.of_refusal(finding, code)
    if station.again.count:
        yield station.again.found(RULES["N2010"], name, f"identified again {times(station.again.count)}")


MISFITS_LEAST = 3
"""So many acknowledges without what was asked for, and 1 in 10 of all, are no late answer to something else."""


def _misfits(heard: N2Evidence, name: str, station: N2StationRecord) -> Iterator[Finding]:
    """Acknowledges that do not hold what was asked for. What a station always gives at a length of its own is its way
    of writing it."""
    misfits = station.misfits
    mixed = together(tally for attribute, tally in misfits.odd.items() if attribute in misfits.fitting)
    bad = together((misfits.empty, mixed))
    if bad.count >= MISFITS_LEAST and 10 * bad.count >= misfits.reads:
        parts = [f"{misfits.empty.count} without a value"] if misfits.empty.count else []
        parts += [f"{mixed.count} of another length than else"] if mixed.count else []
        seen = f"{' and '.join(parts)} among {counted(misfits.reads, 'acknowledged read')}"
        yield bad.found(RULES["N2016"], name, seen)
    for (region, attribute), tally in sorted(misfits.odd.items()):
        if (region, attribute) not in misfits.fitting and tally.count >= MISFITS_LEAST:
            what = f"{REGIONS[region].title}: {attribute_name(region, attribute)}"
            seen = f"{what} always has another length than is known of it"
            yield tally.found(RULES["N2016"], name, seen, Severity.NOTE)


REFUSED_LEAST = 5
"""Refusals of a station that does nothing else, from which on that is a fault."""

MANY_POINTS = 4
"""From so many absent points of one station on it is one thing that is wrong: the list that the master has of it."""


def _points(name: str, station: N2StationRecord) -> Iterator[Finding]:
    if len(station.points) >= MANY_POINTS:
        whole = together(station.points.values())
        whole.evidence = whole.evidence[:MANY_POINTS]
        names = sorted({object_name(region, point) for region, point, _ in station.points})
        more = f" and {len(names) - MANY_POINTS} more" if len(names) > MANY_POINTS else ""
        seen = f"{', '.join(names[:MANY_POINTS])}{more}: N11 {times(whole.count)}"
        yield whole.found(RULES["N2002"], name, seen)
        return
    for (region, point, attribute), tally in sorted(station.points.items(), key=lambda item: str(item[0])):
        what = object_name(region, point)
        if attribute is not None:
            known = attribute_name(region, attribute)
            what += f" attribute {attribute}" + (f" ({known})" if known else "")
        seen = f"{what}: N11 {times(tally.count)}"
        yield tally.found(RULES["N2002"], f"{name}, {object_name(region, point)}", seen)


def _slow(heard: N2Evidence, name: str, station: N2StationRecord) -> Finding:
    """Slow answers; a warning only where they cost something, and are more than a busy computer makes."""
    seen = (
        f"{station.slow.count} of {counted(station.answered, 'answer')} took over {SLOW // MS} ms, "
        f"the longest at least {station.slowest // MS} ms"
    )
    harmless = any(not one.count or heard.is_rare(one, station.answered) for one in (station.late, station.slow))
    return heard.noted_if(harmless, station.slow.found(RULES["N2003"], name, seen))


def _overrides(heard: N2Evidence, name: str, station: N2StationRecord) -> Iterator[Finding]:
    for (region, point), override in sorted(station.overrides.items()):
        age = heard.now - override.time
        if age > OVERRIDE_AGE:
            value = "" if override.value is None else f" to {number(override.value)}"
            seen = f"{object_name(region, point)} overridden{value} for {age // (60 * NS_PER_S)} minutes"
            tally = Tally(1, override.time, heard.now, [override.row])
            yield tally.found(RULES["N2006"], f"{name}, {object_name(region, point)}", seen)


def _again(heard: N2Evidence, name: str, station: N2StationRecord, is_by_all: bool) -> Iterator[Finding]:
    """Answers that came a second time, or late."""
    # an N2 answer names nobody: what came soon behind commands to a station that is late may be that one's
    own = [tally for other, tally in station.beside.items() if tally.count > heard.late_of(other)]
    twice = together((station.twice, *own))
    if twice.count:
        seen = f"a second, different answer came to {counted(twice.count, 'command')}"
        yield heard.noted_if(twice.count == 1, twice.found(RULES["N2008"], name, seen))
    if station.repeated.count and not is_by_all:
        seen = f"the same answer came again to {counted(station.repeated.count, 'command')}"
        finding = station.repeated.found(RULES["N2013"], name, seen)
        yield heard.noted_if(heard.is_rare(station.repeated, station.answered), finding)
    if station.late.count:
        seen = f"{counted(station.late.count, 'answer')} came after the master had gone on"
        finding = meanings.of_late_answers(station.late.found(RULES["N2011"], name, seen))
        yield heard.noted_if(heard.is_rare(station.late, station.answered), finding)
