"""What was remembered of a Modbus line, judged and put into words. Pure: `Evidence` in, findings out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from dissectors.findings import Finding, Severity, Tally, counted, found, times
from dissectors.modbus.evidence import Evidence
from dissectors.modbus.judgement_words import MS, ms, note_if, request_words, seconds, units, wilson
from dissectors.modbus.rules import RULES
from dissectors.modbus.station_judgement import is_absent, of_station

_HASTE = 100 * MS  # no master gives up sooner on a station that is alive, unless it always waits as long
_WASTE = 0.05


def judge(seen: Evidence, timeout: int | None) -> tuple[Finding, ...]:
    """All findings: the bus first, then station by station. `timeout`: the master's, ns, None while unlearnt."""
    made = [*_of_bus(seen), *_of_masters(seen), *_of_gaps(seen)]
    common = _common_damage(seen)
    made += common
    for unit in sorted(seen.stations):
        made += of_station(seen, unit, seen.stations[unit], timeout, bool(common))
    return tuple(made)


# ---- the bus


def _of_bus(seen: Evidence) -> Iterator[Finding]:
    requests = sum(station.asked for station in seen.stations.values()) + seen.damaged_requests.count
    damaged = seen.damaged_requests
    if damaged.count:
        words = f"{damaged.count} of {counted(requests, 'request')} damaged"
        yield damaged.found(RULES["MB009"], "master", words, note_if(seen.rare(damaged.count, requests)))
    absent = {
        unit: station for unit, station in seen.stations.items() if is_absent(station) and station.missing.count > 1
    }
    waited = sum(station.waited for station in absent.values())
    if waited:
        share = waited / seen.span
        words = f"{share:.0%} of the time ({seconds(waited)}) went into waiting for {units(absent)}"
        severity = Severity.WARNING if share > _WASTE else None
        first = min(station.missing.first for station in absent.values())
        last = max(station.missing.last for station in absent.values())
        count = sum(station.missing.count for station in absent.values())
        evidence = tuple(sorted(no for station in absent.values() for no in station.missing.evidence))
        yield found(
            RULES["MB105"], "bus", words, first=first, last=last, count=count, evidence=evidence, severity=severity
        )
    broadcast = seen.answers_to_broadcast
    if broadcast.count or seen.noise_after_broadcast.count >= 3:
        tally = broadcast if broadcast.count else seen.noise_after_broadcast
        what = counted(tally.count, "frame") if broadcast.count else f"octets that are no frame, {times(tally.count)},"
        words = f"{what} directly after a broadcast"
        yield tally.found(RULES["MB204"], "bus", words, note_if(tally.count == 1))
    for (asked, answered), tally in sorted(seen.pairs.items()):
        if tally.count >= 2:
            words = f"{tally.count} requests to station {asked} answered by station {answered}"
            repeated = seen.repeated_elsewhere[asked]
            words += f"; the master asked again {times(repeated)}" if repeated else "; the master never asked again"
            yield tally.found(RULES["MB206"], f"station {asked}", words, note_if(not repeated))
    unasked = seen.unasked
    if unasked.count:
        words = f"{unasked.count} of {counted(seen.answers, 'answer')} came unasked"
        many = unasked.count >= 3 and 100 * unasked.count >= seen.answers
        yield unasked.found(RULES["MB207"], "bus", words, Severity.WARNING if many else None)
    yield from _cycle(seen)


def _of_masters(seen: Evidence) -> Iterator[Finding]:
    """Requests into the wait of another: sooner than the station asked can answer, or after ever other waits."""
    alive = {unit: s for unit, s in seen.stations.items() if s.answered >= 3 and 2 * s.answered > s.asked}
    hasty = [row for row in seen.hasty if row[1] in alive and row[0] < _HASTE]
    gaps = sorted(row[0] for row in hasty)
    if len(hasty) < 3:
        return
    steady = gaps[-1] - gaps[0] <= max(gaps[-1] // 5, 2 * MS + seen.timing.latency)
    medians = [block.low for unit in {row[1] for row in hasty} if (block := alive[unit].times.median()) is not None]
    if steady and medians and gaps[0] > max(medians):  # one master with a short timeout
        return
    tally = Tally()
    for _, _, time, before, no in hasty:
        tally.add(time, before, no)
    words = f"{len(hasty)} requests came while another one waited for a station that answers"
    if gaps[len(gaps) // 2] < 10 * MS:
        words += f", half of them within {ms(gaps[len(gaps) // 2])}"
    yield tally.found(RULES["MB203"], "bus", words)


def _of_gaps(seen: Evidence) -> Iterator[Finding]:
    timing = seen.timing
    for sender, tally in sorted(seen.close.items()):
        if tally.count >= 3:
            words = f"{tally.count} frames began less than {ms(timing.t35)} after the frame before"
            yield tally.found(RULES["MB301"], sender, words)
    for sender, tally in sorted(seen.paused.items()):
        if tally.count >= 3 and seen.judges_pauses:
            words = f"{tally.count} frames with over {ms(timing.t15)} of silence inside"
            yield tally.found(RULES["MB302"], sender, words)
    if not seen.judges_pauses and seen.stations:
        words = (
            f"the adapter may hold octets back for {ms(timing.latency)}; limits are {ms(timing.t15)} inside a frame "
            f"and {ms(timing.t35)} between frames"
        )
        yield found(RULES["MB303"], "adapter", words, first=seen.first or 0, last=seen.now)


def _common_damage(seen: Evidence) -> list[Finding]:
    """Whether the stations' answers are damaged alike."""
    asked = {unit: station for unit, station in seen.stations.items() if station.asked >= 5 and station.answered}
    struck = {unit: station for unit, station in asked.items() if station.damaged.count >= 2}
    if len(struck) < 2:
        return []
    total = sum(station.asked for station in asked.values())
    damaged = sum(station.damaged.count for station in asked.values())
    rate = damaged / total
    for station in asked.values():
        low, high = wilson(station.damaged.count, station.asked)
        if not low <= rate <= high:
            return []
    tally = Tally()
    for station in struck.values():
        for no in station.damaged.evidence:
            tally.add(station.damaged.first, no)
    words = f"{damaged} of {total} answers damaged ({rate:.1%}), of {units(struck)} alike"
    if seen.damaged_requests.count:
        words += f"; {counted(seen.damaged_requests.count, 'request')} too"
    finding = tally.found(RULES["MB007"], "bus", words, note_if(seen.rare(damaged, total)))
    last = max(station.damaged.last for station in struck.values())
    return [replace(finding, count=damaged, last=last)]


def _cycle(seen: Evidence) -> Iterator[Finding]:
    usual = seen.cycles.usual()
    if usual is None or len(usual[2]) < 4:
        return
    unit, key, periods = usual
    low, median, high = (periods[len(periods) * part // 100] for part in (5, 50, 95))
    words = f"the master comes back to station {unit} ({request_words(key)}) every {seconds(median)}"
    if high - low > max(median // 50, 2 * seen.timing.latency, MS):
        words += f"; 9 of 10 times after {seconds(low)} to {seconds(high)}"
    yield found(RULES["MB401"], "bus", words, first=seen.first or 0, last=seen.now, count=len(periods))
