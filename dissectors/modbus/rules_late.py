"""The rules of answers that come too late for the master, in words: whose they are, and whom they hit. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from dissectors.findings import Finding, Severity, Tally, as_consequence, counted, together
from dissectors.impatience import impatience, window
from dissectors.late_speakers import MASTER, NOBODY, Heard, is_behind, late_speakers, told
from dissectors.modbus.bus_record import BusRecord
from dissectors.modbus.finding_words import note_if, units
from dissectors.modbus.rules import RULES
from dissectors.modbus.station_record import StationRecord
from dissectors.perhaps_late import perhaps_late
from dissectors.words import fine_milliseconds

_OUTLASTING_LEAST = 3
_SEEN_LATE = 3  # late answers from which on no damage is needed to show it


def of_late_speakers(seen: BusRecord) -> Iterator[Finding]:
    """Stations that answer into what follows: those that are hit are not to blame for their damage."""
    whole = {f"station {unit}": one.answered for unit, one in seen.stations.items()}
    whole[MASTER] = whole[NOBODY] = seen.requests - seen.damaged_requests.count
    heard = _heard(seen)
    named: set[int] = set()
    for one in late_speakers(seen.late_speakers, whole, heard):
        hit = one.stations_hit
        named |= {one.station, *hit}
        severity = None if heard[one.station].answers else Severity.ERROR  # all that it says is lost
        made = one.window.damage.found(RULES["MB106"], f"station {one.station}", told(one), severity)
        yield replace(made, stations=(one.station, *sorted({*hit, *one.silenced} - {one.station})))
    for unit, station in sorted(seen.stations.items()):
        behind, words = _directly_behind(seen, unit, station)
        if behind.count and unit not in named:
            named.add(unit)
            words += " came directly behind a request to it that nothing had answered"
            yield behind.found(RULES["MB106"], f"station {unit}", words)
        many = 4 * station.outlasting.count >= station.damaged.count
        if station.outlasting.count >= _OUTLASTING_LEAST and many and unit not in named:
            words = f"{counted(station.outlasting.count, 'answer')} not over when the master gave up, which then spoke"
            named.add(unit)
            yield station.outlasting.found(RULES["MB106"], f"station {unit}", f"{words} into them")
    perhaps = perhaps_late(seen.late_speakers, whole, heard) if not named else None
    is_shown = perhaps is not None and seen.stations[perhaps.station].late.count >= _SEEN_LATE  # by MB103
    if perhaps is not None and not is_shown and not seen.rare(perhaps.struck, perhaps.of + perhaps.of_elsewhere):
        yield perhaps.told_of(RULES["MB106"])


def of_impatience(seen: BusRecord, timeout: int | None) -> Iterator[Finding]:
    """A master that gives up before most of its stations answer. `timeout`: its own, ns, None while unlearnt."""
    shown = impatience(seen.late_speakers, _heard(seen))
    if shown is None:
        return
    words = f"{counted(shown.answers, 'answer')} of {units(shown.late)} came after the master had given up"
    words += f"; it waits {fine_milliseconds(timeout)}" if timeout is not None else ""
    if shown.damaged:
        words += f"; {shown.overdue} of {counted(shown.damaged, 'damaged frame')} stand where an answer was overdue"
    tally = together(seen.stations[unit].late for unit in shown.late)
    yield tally.found(RULES["MB107"], MASTER, words, note_if(seen.rare(shown.in_vain, seen.requests, tally)))


def _heard(seen: BusRecord) -> dict[int, Heard]:
    return {unit: Heard(one.answered, one.late.count, one.missing.count) for unit, one in seen.stations.items()}


def under_late_answers(made: Sequence[Finding], seen: BusRecord) -> Iterator[Finding]:
    """The findings; what the late answers of single stations leave behind, and not everything does, is under them: the
    requests that were left, what was damaged where they are as good as all that is due, and what came unasked."""
    warned = (one for one in made if one.code == "MB103" and one.severity >= Severity.WARNING)
    causes = {one.about.station: one for one in warned if one.about.station is not None}
    late = {unit: seen.stations[unit] for unit in causes}
    main = max(causes.values(), key=lambda one: one.count, default=None)
    missing = sum(one.missing.count for one in late.values())
    every = sum(one.missing.count for one in seen.stations.values() if one.answered)
    is_all = 4 * seen.late_speakers.overdue >= 3 * seen.late_speakers.struck and 4 * missing >= 3 * every
    in_vain = missing + sum(one.late.count for one in late.values())
    for one in made:
        cause: Finding | None = None
        if one.code == "MB002":
            who = _who_was_late(one, late, seen)
            cause = None if who is None else causes[who]
        elif is_all and (one.code in ("MB007", "MB009") or (one.code == "MB207" and one.count <= in_vain)):
            cause = main
        yield one if cause is None or one.severity > cause.severity else as_consequence(one, cause, RULES)


def _who_was_late(one: Finding, late: dict[int, StationRecord], seen: BusRecord) -> int | None:
    """The station whose late answers explain that requests to this one were left: its own, or another's that was due
    whenever nothing followed; None where there is none."""
    unit = one.about.station
    if unit is None:
        return None
    if unit in late:
        due, own = window(seen.late_speakers, unit), late[unit]
        return unit if one.count <= 2 * (own.late.count + due.damage.count + due.own) else None
    silent = (other for other in late if 4 * window(seen.late_speakers, other).silenced[unit] >= 3 * one.count)
    return next(silent, None)


def _directly_behind(seen: BusRecord, unit: int, station: StationRecord) -> tuple[Tally, str]:
    """The damage that stands directly behind waits for a station in vain, and no chance does it: requests, or those and
    its own answers to repeats, of one that was seen to be late; none, and no words, of all others."""
    due, silent = window(seen.late_speakers, unit), station.missing.count + station.late.count
    damaged = seen.late_speakers.damaged[MASTER]
    if station.answered and is_behind(due.behind.count, damaged, silent, seen.requests):
        return due.behind, f"{due.behind.count} of {counted(damaged, 'damaged request')}"
    if not 0 < station.late.count < _SEEN_LATE:
        return Tally(), ""
    own, of = due.own_behind, seen.late_speakers.damaged[f"station {unit}"]
    if is_behind(own.count, of, silent, station.asked, is_late=True):
        return own, f"{own.count} of its {counted(of, 'damaged answer')}"
    both, of = together((due.behind, own)), of + damaged
    if is_behind(both.count, of, silent, station.asked, is_late=True):
        return both, f"{both.count} of {counted(of, 'damaged frame')} of the master and itself"
    return Tally(), ""
