"""The rules of one Modbus station, in words. Pure: `StationRecord` in, findings out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

from dissectors.chances import is_silent_by_chance
from dissectors.findings import EVIDENCE_MAX, Finding, Severity, Tally, counted, found, times, together
from dissectors.frame import Flaw
from dissectors.late_speakers import reaching
from dissectors.line import MS
from dissectors.modbus.bus_record import BusRecord
from dissectors.modbus.exception_meanings import EXCEPTIONS, MAKER_EXCEPTION, USED_ALIKE, VENDOR_EXCEPTION
from dissectors.modbus.finding_words import note_if, of_few, of_two, request_words, share_words, without_check
from dissectors.modbus.functions import EXCEPTIONS as EXCEPTION_NAMES
from dissectors.modbus.header import code_number
from dissectors.modbus.response_groups import AnsweredRequest
from dissectors.modbus.rules import RULES
from dissectors.modbus.rules_foreign import foreign_answers
from dissectors.modbus.station_record import AWAY_LEAST, STRAY, Key, Requested, StationRecord
from dissectors.modbus.struck_octet import falls_there_by_chance
from dissectors.modbus.talked_over import second_voice
from dissectors.words import duration, fine_milliseconds, percent
from dissectors.wrong_checks import Habit

FLAWS = {
    Flaw.CHECK_SWAPPED: "MB011",
    Flaw.FIRST_MISSING: "MB012",
    Flaw.FIRST_SPOILT: "MB012",
    Flaw.LAST_MISSING: "MB006",
    Flaw.LAST_TWO_MISSING: "MB006",
    Flaw.LAST_SPOILT: "MB006",
}
"""The rule about each kind of damage that is always the same."""

_AWAY_SHARE, _ANSWERED_BETWEEN = 0.9, 20
"""So much of what a station left unanswered stands in rows where it was away; and of several, answers for each."""

SPOILT = (Flaw.FIRST_SPOILT, Flaw.LAST_SPOILT)
"""Those that noise makes as well; it takes no octet away."""

_NOT_THERE = (1, 2, 3)  # exceptions that tell a program that tries what a device can do
_PROBED = 8  # times that something else is asked for each try
_NEARLY_ALL_LEAST = 10  # damaged answers
_GARBLED_LEAST = 5  # damaged answers that are no frame at all
_SYSTEM_LEAST = 3  # of one kind, before it is a system
_SECOND_RARE = 10  # answers for each second one, where these are rare
_REPEATS_COST = 0.02
_REPEATS_LEAST = 3  # fewer are no habit, however short the capture


def of_station(
    seen: BusRecord, unit: int, station: StationRecord, timeout: int | None, is_common: bool
) -> Iterator[Finding]:
    name = f"station {unit}"
    if station.text_damage.change is None:  # else see `of_text_changes`
        yield from _damage(seen, unit, name, station, is_common)
    yield from _exceptions(seen, name, unit, station)
    if station.unfit.count and not station.has_own_protocol:
        why, _ = station.unfit_words.most_common(1)[0] if station.unfit_words else ("", 0)
        words = f"{station.unfit.count} of {counted(station.answered, 'answer')} not as asked for: {why}"
        yield station.unfit.found(RULES["MB010"], name, words, note_if(station.unfit.count == 1))
    yield from _times(name, station, timeout, seen, is_common)
    if station.twice.count:
        words = f"a second answer came to {counted(station.twice.count, 'request')}"
        yield _twice(name, station, words, _may_be_late(station))
    if station.undecided.count:
        words = f"{counted(station.undecided.count, 'frame')} may be the answer or the request again"
        yield station.undecided.found(RULES["MB403"], name, words)
    yield from _two_times(name, station)
    if station.reserved.count and not seen.has_numbers(unit):
        yield station.reserved.found(
            RULES["MB205"], name, f"{counted(station.reserved.count, 'frame')} from or to this address"
        )


def _damage(seen: BusRecord, unit: int, name: str, station: StationRecord, is_common: bool) -> Iterator[Finding]:
    """What came in place of its answers: what it does each time, and, where that is not nearly all, what damages it."""
    foreign = foreign_answers(seen, name, station)
    miscounted = None if foreign else _miscounted(name, station)
    systematic = [*_flawed(seen, name, station), *(one for one in (foreign, miscounted) if one)]
    yield from systematic
    if 4 * sum(finding.count for finding in systematic) < 3 * station.damaged.count:
        yield from _damaged(seen, unit, station, is_common)


def of_missing(seen: BusRecord, unit: int, station: StationRecord, is_scanned: bool) -> Iterator[Finding]:
    """Requests to a station that nothing answered. `is_scanned`: they were those of a search."""
    name, missing = f"station {unit}", station.missing
    if not missing.count:
        return
    if is_absent(station):
        if missing.count > 1 and not is_scanned:
            words = f"no answer to any of {station.asked} requests"
            stray = station.damaged.count
            words += f"; octets that are no good answer followed {times(stray)}" if stray else ""
            heard = [one for one in seen.stations.values() if not is_absent(one)]
            failed, of = sum(one.missing.count + one.damaged.count for one in heard), sum(one.asked for one in heard)
            is_chance = is_silent_by_chance(station.asked, failed, of, len(heard) + 1)
            words += f"; {failed} of {of} to the others have no good one either" if is_chance else ""
            yield missing.found(RULES["MB001"], name, words, note_if(is_chance))
        else:
            again = f", sent {times(missing.count)}" if missing.count > 1 else ""
            words = f"no answer to the only request{again}"
            if not is_scanned:
                yield missing.found(RULES["MB001"], name, words, Severity.NOTE)
        return
    silent = station.silent
    if silent.count >= AWAY_LEAST and station.answered and station.last_heard is not None:
        since = seen.now - station.last_heard
        words = f"no answer to its last {silent.count} requests; last heard {duration(since)} before the end"
        yield silent.found(RULES["MB003"], name, words)
    ignored = [(key, request) for key, request in sorted(station.requests.items(), key=str) if _is_ignored(request)]
    if station.answered >= 3 and silent.count < AWAY_LEAST and not station.has_own_protocol:
        for key, request in ignored:
            if 10 * request.echoed >= 9 * request.tries:
                words = f"{counted(request.tries, 'request')} to {request_words(key)}, all given back whole"
                yield request.missing.found(RULES["MB010"], name, words)
                continue
            words = f"no answer to any of {request.tries} requests to {request_words(key)}; it answers others"
            yield request.missing.found(RULES["MB004"], name, words)
    else:
        ignored = []
    explained = sum(request.missing.count for _, request in ignored)
    if silent.count >= AWAY_LEAST and station.answered:
        explained += silent.count
    left = 0 if station.has_own_protocol else missing.count - explained
    if left > 0:
        away = station.away
        between = _ANSWERED_BETWEEN * station.times_away if station.times_away > 1 else 1
        if station.answered >= between and away.count >= AWAY_LEAST and _AWAY_SHARE * left <= away.count <= left:
            yield _was_away(name, station)
            left -= away.count
    if left > 0:
        words = f"no answer to {left} of {counted(station.asked, 'request')}"
        words += seen.when(missing, station.asked, left)
        finding = missing.found(RULES["MB002"], name, words, note_if(seen.rare(left, station.asked, missing)))
        yield replace(finding, count=left)


def _was_away(name: str, station: StationRecord) -> Finding:
    """A station that left nearly all that it left unanswered in a row, or a few, and was heard again: no single frames
    were lost, and no damage of the line explains it."""
    away, often = station.away, station.times_away
    long, of = duration(station.away_for), counted(station.asked, "request")
    rows = f"a row within {long}; then it answered again"
    rows = f"{often} rows of {long} in all; it was heard again each time" if often > 1 else rows
    words = f"no answer to {away.count} of {of}, in {rows}"
    return replace(
        away.found(RULES["MB003"], name, words, Severity.WARNING),
        means="the station was off, restarted or cut off for that time",
        next="its supply, plug and terminals, its watchdog and its own log at that time",
    )


_RARELY = 20
"""Of so many requests at most one may be answered by a copy that a late read made of its repeat."""


def is_absent(station: StationRecord) -> bool:
    """Whether no good frame ever came from it, and no more than stray damage in place of answers."""
    # a late read puts the repeat of a write where its answer would be
    answered = station.answered - (station.copies if _RARELY * station.copies <= station.asked else 0)
    heard = answered or station.late.count or station.twice.count or station.undecided.count > station.asked
    return bool(station.missing.count) and not heard and STRAY * station.damaged.count <= station.asked


def _is_ignored(request: Requested) -> bool:
    return request.turns >= 3 and request.missing.count == request.tries


def _damaged(seen: BusRecord, unit: int, station: StationRecord, is_common: bool) -> Iterator[Finding]:
    name = f"station {unit}"
    damaged, ends = station.damaged, station.last_octet
    if not damaged.count or is_absent(station):
        return
    rare = seen.rare(damaged.count, station.asked, damaged)
    is_chance = falls_there_by_chance(seen, name, ends.count, damaged.count)
    if ends.count >= 3 and 2 * ends.count >= damaged.count and not is_chance:
        words = f"{ends.count} of {counted(station.asked, 'answer')} right but for the last octet"
        yield ends.found(RULES["MB006"], name, words, note_if(rare))
        if 4 * ends.count >= 3 * damaged.count:
            return
    second = second_voice(seen, unit, station)
    if second is not None:
        yield second
    details = []
    if station.cut:
        details.append(f"{station.cut} ended early")
    if station.garbled:
        details.append(f"{station.garbled} no frame at all")
    words = f"{damaged.count} of {counted(station.asked, 'answer')} damaged"
    words += f" ({', '.join(details)})" if details else ""
    if station.asked >= 20:
        words += f"; that is {share_words(damaged.count, station.asked)} of all, with 95% confidence"
    words += seen.when(damaged, station.asked)
    finding = damaged.found(RULES["MB005"], name, words, note_if(rare or is_common))
    finding = of_few(finding) if damaged.count < _SYSTEM_LEAST else finding
    if (longer := station.talked_over.count - station.cut) > 1 and 2 * longer >= damaged.count:
        finding = of_two(finding, longer)
    if damaged.count >= _NEARLY_ALL_LEAST and 10 * damaged.count >= 9 * station.asked:  # noise leaves some
        means = f"{finding.means}; or two stations with this address, whose answers fall on each other"
        following = f"switch the station off and see whether something still answers; {finding.next}"
        finding = replace(finding, means=means, next=following)
    if _is_nothing_of_this_line(station):
        means = f"the device has another baud rate, or speaks another protocol; or {finding.means}"
        following = f"baud rate, parity and protocol in the device's settings; {finding.next}"
        finding = replace(finding, means=means, next=following)
    yield finding


def _may_be_late(station: StationRecord) -> bool:
    """Whether second answers may all be to tries before: no more than came late, or, where they are rare, than came
    late or were left. Two stations answer nearly each time."""
    twice, late, left = station.twice.count, station.late.count, station.missing.count
    return twice <= late or (twice <= late + left and _SECOND_RARE * twice <= station.answered)


def _is_nothing_of_this_line(station: StationRecord) -> bool:
    """Whether it never answered, and nearly all that came is no frame at all: noise leaves some of it."""
    count = station.damaged.count
    return not station.answered and count >= _GARBLED_LEAST and 10 * station.garbled >= 9 * count


def _twice(name: str, station: StationRecord, words: str, slow: bool) -> Finding:
    """Two different answers are two stations'; the same octets again may be a converter's, or one station's."""
    twice, rule = station.twice, RULES["MB201"]
    different = twice.count - station.same_twice
    if different:
        words += f", {times(different)} another than the first"
        return twice.found(rule, name, words, note_if(twice.count == 1 or slow))
    words += ", each time octet for octet the first one again"
    severity = Severity.NOTE if twice.count == 1 or slow else Severity.WARNING
    means = "two stations with this address and the same values, or one device or converter that sends twice"
    return replace(twice.found(rule, name, words, severity), means=means)


def _flawed(seen: BusRecord, name: str, station: StationRecord) -> Iterator[Finding]:
    """Damage of one kind that most damaged answers of a station share."""
    by_code: dict[str, list[tuple[Flaw, Tally]]] = {}
    for flaw, tally in station.flaws.items():
        by_code.setdefault(FLAWS[flaw], []).append((flaw, tally))
    for code, parts in sorted(by_code.items()):
        count = sum(tally.count for _, tally in parts)
        if code == "MB012" and seen.cut_by_master:
            continue
        if count < _SYSTEM_LEAST or 2 * count < station.damaged.count:
            continue
        spoilt = sum(tally.count for flaw, tally in parts if flaw in SPOILT)
        if count < _SYSTEM_LEAST + spoilt and falls_there_by_chance(seen, name, count, station.damaged.count):
            continue
        flaw, tally = max(parts, key=lambda part: part[1].count)
        words = f"{count} of {counted(station.asked, 'answer')} good but for one thing: {flaw.value}"
        if count == station.damaged.count == station.asked:
            words += ", every time"
        flawed = replace(
            tally.found(
                RULES[code], name, words, note_if(seen.rare(count, station.asked, together(one for _, one in parts)))
            ),
            count=count,
        )
        # the first of a habit is not put right
        is_always = count >= station.damaged.count - 1 and station.damaged.count == station.asked
        yield without_check(flawed, flaw) if is_always else flawed


def _miscounted(name: str, station: StationRecord) -> Finding | None:
    """Checks that are always wrong, in frames that are right otherwise."""
    habit = station.miscounted
    if habit is None:
        return None
    return wrongly_checked(name, habit, counted(station.asked, "answer"))


def wrongly_checked(name: str, habit: Habit, of: str, severity: Severity | None = None) -> Finding:
    """What a sender does with its checks. `of`: how many frames of its kind there were, in words."""
    finding = habit.tally.found(RULES["MB021"], name, f"{habit.count} of {of} {habit.told('check')}", severity)
    return replace(finding, count=habit.count, means=habit.mistake.means or finding.means)


def _exceptions(seen: BusRecord, name: str, unit: int, station: StationRecord) -> Iterator[Finding]:
    """Each request that is refused; one note for all that were only tried, beside those that are asked all the time."""
    tried: dict[int, list[tuple[Key, Tally]]] = {}
    for (key, code), tally in sorted(station.exceptions.items(), key=lambda item: str(item[0])):
        request = station.requests.get(key)
        if code in _NOT_THERE and request is not None and _PROBED * request.tries <= station.turns:
            tried.setdefault(code, []).append((key, tally))
        else:
            yield _exception(seen, unit, key, code, tally)
    for code, probes in tried.items():
        key, tally = probes[0]
        finding = _exception(seen, unit, key, code, tally)
        further = f", and to {counted(len(probes) - 1, 'other request')}" if len(probes) > 1 else ""
        words = f"{finding.seen}{further}; hardly asked beside what is polled"
        evidence = tuple(sorted(no for _, one in probes for no in one.evidence))
        made = tally.found(RULES["MB008"], name, words, Severity.NOTE)
        made = replace(made, count=sum(one.count for _, one in probes), evidence=evidence[:EVIDENCE_MAX])
        yield replace(made, last=max(one.last for _, one in probes), means=finding.means, next=finding.next)


def _exception(seen: BusRecord, unit: int, key: Key, code: int, tally: Tally) -> Finding:
    """What the manual of the device says of the code stands before the standard."""
    maker, request = seen.maker_words(unit, code), seen.stations[unit].requests.get(key)
    otherwise = MAKER_EXCEPTION if maker else VENDOR_EXCEPTION
    severity, means, following = otherwise if maker and code not in USED_ALIKE else EXCEPTIONS.get(code, otherwise)
    meaning = maker or EXCEPTION_NAMES.get(code) or "a code of the vendor's"
    of = tally.count if request is None else request.tries
    some = "the only request" if of == 1 else f"{tally.count} of {of} requests"
    words = f"exception {code_number(code)} ({meaning}) to {some} to {request_words(key)}{seen.when(tally, of)}"
    return replace(tally.found(RULES["MB008"], f"station {unit}", words, severity), means=means, next=following)


def _times(
    name: str, station: StationRecord, timeout: int | None, seen: BusRecord, is_common: bool
) -> Iterator[Finding]:
    times_, slow = station.times, station.slow
    if slow.count >= 3 and 100 * slow.count >= station.slow_of:
        since = "" if station.slow_of == station.answered else " since the timeout is known"
        against = "500 ms" if timeout is None else f"70% of the master's timeout of {fine_milliseconds(timeout)}"
        words = f"{slow.count} of {counted(station.slow_of, 'answer')}{since} took longer than {against}"
        words += f", the longest at least {fine_milliseconds(times_.longest)}"
        yield slow.found(RULES["MB101"], name, words, note_if(timeout is None))
    quarters = times_.quarters()
    if quarters:
        first, last = quarters[0], quarters[-1]
        rises = all(20 * b.nominal >= 19 * a.nominal for a, b in pairwise(quarters))
        quickest_too = 2 * (last.least - first.least) > last.nominal - first.nominal  # not only more of a second kind
        risen = [rise for same in station.same.values() if (rise := same.rose()) is not None]
        each_too = 2 * sum(rise > 5 * MS for rise in risen) > len(risen)  # not only other requests than before
        longer = 2 * last.low > 3 * first.high and last.low - first.high > 5 * MS
        if rises and quickest_too and longer and each_too:
            rose = f"from {fine_milliseconds(first.nominal)} to {fine_milliseconds(last.nominal)}"
            words = f"median response time rose {rose}"
            yield found(
                RULES["MB102"], name, words, first=seen.first or 0, last=station.last_heard or 0, count=times_.count
            )
    if station.late.count:
        words = f"{counted(station.late.count, 'answer')} came after the master had given up"
        waits = f"; it waits {fine_milliseconds(timeout)}" if timeout is not None else ""
        words += waits + seen.when(station.late, station.asked)
        severity = note_if(seen.rare(station.late.count, station.asked, station.late))
        yield reaching(station.late.found(RULES["MB103"], name, words, severity), seen.late_speakers)
    if station.answered and station.repeats.count:
        share = station.repeats_cost / seen.span
        words = (
            f"{counted(station.repeats.count, 'request')} sent again; from one try to the next "
            f"{duration(station.repeats_cost)} passed in all, {percent(share)} of the time of the bus"
        )
        costly = share > _REPEATS_COST and station.repeats.count >= _REPEATS_LEAST and not is_common
        yield station.repeats.found(RULES["MB104"], name, words, Severity.WARNING if costly else None)


def _two_times(name: str, station: StationRecord) -> Iterator[Finding]:
    """Two groups of response times to the same request, of the request that shows them best."""
    found_ = [(key, groups) for (key, _), same in station.same.items() if (groups := same.groups()) is not None]
    if not found_:
        return
    key, groups = max(found_, key=lambda pair: (pair[1].apart, pair[1].smaller))
    quick, slow = groups.quick, groups.slow
    words = (
        f"answers to one request ({request_words(key)}) take either {_range(quick)} ({times(len(quick))}) or "
        f"{_range(slow)} ({times(len(slow))}), in turns"
    )
    agreeing = ["the slow ones never say what the quick ones say"] if groups.apart else []
    if station.twice.count > station.same_twice:
        agreeing.append(f"a second answer came to {counted(station.twice.count, 'request')}")
    mixed = station.talked_over.count
    if mixed >= 2:
        agreeing.append(f"{mixed} answers had other octets mixed in")
    tally = Tally()
    for answer in sorted((*quick[:4], *slow[:4]), key=lambda answer: answer.no):
        tally.add(answer.time, answer.no)
    finding = tally.found(RULES["MB208"], name, "; ".join((words, *agreeing)), Severity.WARNING if agreeing else None)
    everything = sorted(answer.time for answer in (*quick, *slow))
    yield replace(finding, first=everything[0], last=everything[-1], count=len(everything))


def _range(answers: Sequence[AnsweredRequest]) -> str:
    """Where the times of a group lie, from the shortest to the longest nominal reading."""
    least, most = fine_milliseconds(answers[0].latency.nominal), fine_milliseconds(answers[-1].latency.nominal)
    return least if least == most else f"{least} to {most}"
