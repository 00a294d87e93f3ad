"""The rules of a Modbus line as a whole, in words. Pure: `BusRecord` in, findings out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from dissectors.findings import Finding, Severity, Tally, counted, found, times, together
from dissectors.late_speakers import MASTER
from dissectors.line import MS
from dissectors.modbus.bus_record import BusRecord
from dissectors.modbus.damage_shares import DamageShare, shares_of_damage, to_blame
from dissectors.modbus.finding_words import note_if, of_few, request_words, units
from dissectors.modbus.functions import MAX_UNIT
from dissectors.modbus.odd_ends import OddEnd
from dissectors.modbus.rules import RULES
from dissectors.modbus.rules_late import of_impatience, of_late_speakers, under_late_answers
from dissectors.modbus.rules_requests import of_damaged_requests, of_requests
from dissectors.modbus.rules_station import is_absent, of_missing, of_station
from dissectors.modbus.rules_text import of_text_changes
from dissectors.modbus.rules_unheard import of_unheard, under_what_is_missed
from dissectors.words import duration, fine_milliseconds, percent

_WASTE = 0.05
_HABIT = 10  # a sender that is too quick is so once in so many frames at least; what a computer holds up is rarer
_HABIT_LEAST = 6
_PAUSES_LEAST = 3
_CLOSE_LEAST = 3
_ODD_LEAST = 3
_MASTERS_LEAST = 3
_COMMON_LEAST = 3


def judge(seen: BusRecord, timeout: int | None) -> tuple[Finding, ...]:
    """All findings: the bus first, then station by station. `timeout`: the master's, ns, None while unlearnt."""
    damage, scanned, unheard = shares_of_damage(seen), seen.scanned(), seen.unheard()
    made = [
        *_of_bus(seen, "master" in damage.blamed, scanned, unheard),
        *_of_masters(seen),
        *_of_gaps(seen),
        *_of_ends(seen),
        *of_text_changes(seen),
        *_carried_over(seen),
        *_common_damage(seen, damage),
        *of_late_speakers(seen),
        *of_impatience(seen, timeout),
    ]
    for unit in sorted(seen.stations):
        station = seen.stations[unit]
        if unit not in unheard:
            made += of_missing(seen, unit, station, unit in scanned)
        made += of_station(seen, unit, station, timeout, f"station {unit}" not in damage.blamed)
    return tuple(under_late_answers(tuple(under_what_is_missed(seen, made)), seen))


# ---- the bus


def _of_bus(seen: BusRecord, is_blamed: bool, scanned: list[int], unheard: list[int]) -> Iterator[Finding]:
    yield from of_damaged_requests(seen, is_blamed)
    yield from of_requests(seen)
    yield from _of_search(seen, scanned)
    yield from of_unheard(seen, unheard)
    yield from _of_waiting(seen, {*scanned, *unheard})
    yield from _of_broadcasts(seen)
    told = {pair for pair, tally in seen.pairs.items() if tally.count >= 2 and seen.is_answered_elsewhere(*pair)}
    yield from _of_answers_elsewhere(seen, told)
    yield from _of_unasked(seen, told)
    yield from _cycle(seen)


def _of_search(seen: BusRecord, scanned: list[int]) -> Iterator[Finding]:
    """Addresses that the master looks for stations at."""
    if scanned:
        most = max(seen.stations[unit].turns for unit in scanned)
        often = "once" if most == 1 else f"up to {times(most)}"
        words = f"{len(scanned)} addresses asked {often} and silent, {scanned[0]} to {scanned[-1]}"
        first = min(seen.stations[unit].missing.first for unit in scanned)
        last = max(seen.stations[unit].missing.last for unit in scanned)
        yield found(RULES["MB402"], "bus", words, first=first, last=last, count=len(scanned))


def _of_waiting(seen: BusRecord, others: set[int]) -> Iterator[Finding]:
    """The time that absent stations cost, but for `others`."""
    absent = {
        unit: station
        for unit, station in seen.stations.items()
        if is_absent(station) and station.missing.count > 1 and unit not in others
    }
    waited = sum(station.waited for station in absent.values())
    if waited and seen.timing.has_times:
        share = waited / seen.span
        words = f"{percent(share, 0)} of the time ({duration(waited)}) went into waiting for {units(absent)}"
        severity = Severity.WARNING if share > _WASTE else None
        yield together(one.missing for one in absent.values()).found(RULES["MB105"], "bus", words, severity)


def _of_broadcasts(seen: BusRecord) -> Iterator[Finding]:
    """What answers where nobody may."""
    broadcast = seen.answers_to_broadcast
    if not broadcast.count and seen.noise_after_broadcast.count < 3:
        return
    tally = broadcast if broadcast.count else seen.noise_after_broadcast
    what = counted(tally.count, "frame") if broadcast.count else f"octets that are no frame, {times(tally.count)},"
    words = f"{what} directly after a broadcast"
    if seen.broadcast_answers:
        words += f", from {units(seen.broadcast_answers)}"
    new = [unit for unit in seen.broadcast_answers if unit not in seen.stations or not seen.stations[unit].asked]
    if new:
        words += f"; {units(new)} {'was' if len(new) == 1 else 'were'} never asked for anything"
    yield tally.found(RULES["MB204"], "bus", words, note_if(tally.count == 1))


def _of_answers_elsewhere(seen: BusRecord, told: set[tuple[int, int]]) -> Iterator[Finding]:
    """Who answers for another: `told`, pairs of who was asked and who answered."""
    for (asked, answered), tally in sorted(seen.pairs.items()):
        if (asked, answered) in told:
            words = f"{tally.count} requests to station {asked} answered by station {answered}"
            repeated = seen.repeated_elsewhere[asked]
            words += f"; the master asked again {times(repeated)}" if repeated else "; the master never asked again"
            elsewhere = tally.found(RULES["MB206"], f"station {asked}", words, note_if(not repeated))
            to_any = f"{asked} is this maker's address for whoever is there; or {RULES['MB206'].means}"
            yield replace(elsewhere, means=to_any) if asked > MAX_UNIT else elsewhere


def _of_unasked(seen: BusRecord, told: set[tuple[int, int]]) -> Iterator[Finding]:
    """Answers that nobody asked for, but for those that are told as another's."""
    by_chance = [tally for pair, tally in seen.pairs.items() if tally.count >= 2 and pair not in told]
    unasked = together((seen.unasked, *by_chance))
    makers = sum(one.unasked for one in seen.stations.values() if one.has_own_protocol)
    if unasked.count > makers:
        words = f"{unasked.count - makers} of {counted(seen.answers, 'answer')} came unasked"
        of_themselves = seen.unasked.count - seen.unasked_behind_noise - makers
        many = of_themselves >= 3 and 100 * of_themselves >= seen.answers
        found_unasked = unasked.found(RULES["MB207"], "bus", words, Severity.WARNING if many else None)
        yield replace(found_unasked, count=unasked.count - makers)


def _of_masters(seen: BusRecord) -> Iterator[Finding]:
    """Requests into the wait of another, sooner than the station asked has ever answered.

    An answer that this tap missed cannot have come before, and a master that never waits sends after the same time
    always: both are left out. So is what turned out to be a late answer, and no request.
    """
    hasty, broken_in = seen.too_hasty(seen.hasty), seen.too_hasty(seen.broken_in)
    gaps = sorted(row[0] for row in (*hasty, *broken_in))
    same = MS + seen.timing.latency
    habitual = max((sum(abs(one - gap) <= same for one in gaps) for gap in gaps), default=0)
    may_be_habit = not broken_in and len(gaps) >= _HABIT_LEAST and 4 * habitual > 3 * len(gaps)
    if len(gaps) < _MASTERS_LEAST or may_be_habit:
        yield from list(_asked_twice(seen)) or _crossed(seen)
        return
    tally = Tally()
    for _, _, time, before, no, _ in sorted((*hasty, *broken_in), key=lambda row: row[2]):
        tally.add(time, before, no)
    many = f"over {len(gaps)}" if seen.too_many else len(gaps)
    words = f"{many} requests came while another one waited for a station that answers, but never so soon"
    if gaps[len(gaps) // 2] < 10 * MS:
        words += f"; half of them within {fine_milliseconds(gaps[len(gaps) // 2])}"
    yield tally.found(RULES["MB203"], "bus", words)


def _asked_twice(seen: BusRecord) -> Iterator[Finding]:
    """Requests that came twice at once, and had two answers: no echo is answered, and no master repeats so soon.

    Not where copies are usual, as behind a repeater, or where answers come twice to requests that do not.
    """
    twice = seen.asked_twice
    usual = _HABIT * twice.count > seen.requests or 2 * twice.count < seen.echoes
    if twice.count < _MASTERS_LEAST or usual or any(station.twice.count for station in seen.stations.values()):
        return
    words = f"{counted(twice.count, 'request')} came twice, one directly behind the other, and had two answers each"
    yield twice.found(RULES["MB203"], "bus", words)


def _crossed(seen: BusRecord) -> Iterator[Finding]:
    """Requests between another and its answer, which came no later than answers do: where the adapter's reads hide how
    soon a request came, the order of the frames still tells. A master that never waits sends all its requests so, and
    one whose timeout is too short the next of its list."""
    crossed = seen.crossed_by_another
    if crossed.count >= _MASTERS_LEAST and _HABIT * crossed.count < seen.requests:
        words = f"{counted(crossed.count, 'request')} came between another one and its answer, which was not late"
        yield crossed.found(RULES["MB203"], "bus", words)


def _of_gaps(seen: BusRecord) -> Iterator[Finding]:
    timing = seen.timing
    yield from _too_close(seen)
    paused = seen.paused if seen.judges_pauses else {}
    hits = {sender: tally.count for sender, tally in paused.items()}
    blamed = to_blame(hits, {sender: max(1, seen.frames[sender]) for sender in hits}) if len(hits) > 1 else set(hits)
    common = [paused[sender] for sender in sorted(hits) if sender not in blamed]
    if len(common) > 1 and sum(tally.count for tally in common) >= _PAUSES_LEAST:
        count = sum(tally.count for tally in common)
        words = f"{count} frames of {len(common)} senders with over {fine_milliseconds(timing.t15)} of silence inside"
        evidence = tuple(sorted(no for tally in common for no in tally.evidence))
        yield found(
            RULES["MB304"], "adapter", words, first=seen.first or 0, last=seen.now, count=count, evidence=evidence
        )
    for sender, tally in sorted((sender, paused[sender]) for sender in blamed):
        if tally.count - seen.held_back[sender] < _PAUSES_LEAST:
            continue
        words = f"{tally.count} frames with over {fine_milliseconds(timing.t15)} of silence inside"
        yield tally.found(RULES["MB302"], sender, words)
    if not seen.judges_pauses and seen.stations and timing.has_times:
        words = (
            f"the adapter may hold octets back for {fine_milliseconds(timing.latency)}; limits are "
            f"{fine_milliseconds(timing.t15)} inside a frame and {fine_milliseconds(timing.t35)} between frames"
        )
        yield found(RULES["MB303"], "adapter", words, first=seen.first or 0, last=seen.now)


def _too_close(seen: BusRecord) -> Iterator[Finding]:
    """Frames directly behind others: of those whose habit it is; where all stations do so, so speaks this bus."""
    habits: dict[str, Tally] = {}
    for sender in sorted(seen.close):
        tally = seen.close_frames(sender)
        count, frames = tally.count, seen.frames[sender]
        if seen.timing.is_told:
            is_habit = count >= _CLOSE_LEAST and _HABIT * count >= frames
        else:  # an adapter makes as many silences longer as shorter
            is_habit = count >= _HABIT_LEAST and 3 * count >= 2 * frames
        if is_habit:
            habits[sender] = tally
    limit = fine_milliseconds(seen.timing.t35)
    if len(habits) > 1 and seen.frames.keys() - habits.keys() <= {MASTER}:
        among = together(habits.values())
        words = f"{among.count} frames began less than {limit} after the frame before, whoever sends"
        yield among.found(RULES["MB301"], "bus", words, Severity.NOTE)
        return
    for sender, tally in habits.items():
        words = f"{tally.count} frames began less than {limit} after the frame before"
        yield tally.found(RULES["MB301"], sender, words)


def _of_ends(seen: BusRecord) -> Iterator[Finding]:
    """Frames that end otherwise than with CR LF: of those who end so while others do not; where all do, it is how this
    bus speaks, or what is between it and us makes it so."""
    for end in OddEnd:
        habits = {
            sender: tally
            for (how, sender), tally in sorted(seen.odd_ends.items(), key=lambda item: item[0][1])
            if how is end and tally.count >= _ODD_LEAST and _HABIT * tally.count >= seen.frames[sender]
        }
        if habits and len(habits) == len(seen.frames):
            if len(habits) > 1:
                among = together(habits.values())
                words = f"{counted(among.count, 'frame')} end with {end.value}, whoever sends"
                yield _of_end(end, among.found(RULES["MB019"], "bus", words, Severity.NOTE))
                continue
            if end is OddEnd.LF_ALONE:
                continue  # not one frame is good, and a terminal may have taken CR away: see LN003
        for sender, tally in habits.items():
            words = f"{tally.count} of {counted(seen.frames[sender], 'frame')} end with {end.value}"
            is_all = sender == "master" and 10 * tally.count >= 9 * seen.requests
            is_in_vain = is_all and (end.is_damage or not seen.answers)  # who should have answered is not to blame
            yield _of_end(end, tally.found(RULES["MB019"], sender, words, Severity.ERROR if is_in_vain else None))


def _of_end(end: OddEnd, finding: Finding) -> Finding:
    """The finding with what such an end means; the rule speaks of CR alone."""
    if end is OddEnd.CR_ALONE:
        return finding
    if end is OddEnd.CR_CR_LF:
        means = "a converter or a terminal server on the way makes CR LF of each LF; or the device sends CR twice"
        following = "newline translation in whatever is on the way; the device's end characters"
    else:
        means = "the device ends its frames as lines of text, or something on the way takes CR away"
        following = "the device's end characters; newline translation in whatever is on the way"
    return replace(finding, means=means, next=following)


def _common_damage(seen: BusRecord, damage: DamageShare) -> list[Finding]:
    """What is damaged of senders none of which surely has more of it than its share."""
    hits, struck = damage.common, [int(sender.split()[1]) for sender in damage.common if sender != "master"]
    damaged = sum(hits.values())
    if not struck or damaged < _COMMON_LEAST:
        return []
    asked = sum(seen.stations[unit].asked for unit in struck)
    answers = damaged - hits.get("master", 0)
    tally = together(seen.stations[unit].damaged for unit in struck)
    words = f"{answers} of {counted(asked, 'answer')} of {units(struck)} damaged ({percent(answers / max(1, asked))})"
    if "master" in hits:
        words += f", and {counted(hits['master'], 'request')}"
    among = len(hits) > 1
    words += ": of each about as much as it sends" if among else ": too few, and too close together, to say whose"
    finding = tally.found(RULES["MB007"], "bus", words, note_if(seen.rare(damaged, asked, tally)))
    return [replace(finding if among else of_few(finding), count=answers, stations=() if among else tuple(struck))]


def _carried_over(seen: BusRecord) -> Iterator[Finding]:
    """Answers that end where the next one should begin."""
    carried = seen.carried_over
    if not carried.is_habit(sum(one.damaged.count for one in seen.stations.values())):
        return
    words = f"{counted(carried.tally.count, 'answer')} of {units(carried.units)} began in place of one answer and ended"
    finding = carried.tally.found(RULES["MB024"], "bus", f"{words} in place of the next; put together they are good")
    finding = replace(finding, stations=tuple(sorted(carried.units)))
    yield finding if carried.is_across else replace(finding, means=f"{finding.means}; or {_HELD_BACK}")


_HELD_BACK = "a device that keeps the end of each answer until it sends again"


def _cycle(seen: BusRecord) -> Iterator[Finding]:
    usual = seen.cycles.usual()
    if usual is None or len(usual[2]) < 4 or not seen.timing.has_times:
        return
    unit, key, periods = usual
    low, median, high = (periods[len(periods) * part // 100] for part in (5, 50, 95))
    whom = f"station {unit}" if unit else "address 0"  # which is no station's
    words = f"the master comes back to {whom} ({request_words(key)}) every {duration(median)}"
    if high - low > max(median // 50, 2 * seen.timing.latency, MS):
        words += f"; 9 of 10 times after {duration(low)} to {duration(high)}"
    yield found(RULES["MB401"], "bus", words, first=seen.first or 0, last=seen.now, count=len(periods))
