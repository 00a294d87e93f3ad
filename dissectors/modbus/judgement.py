"""What was remembered of a Modbus line, judged and put into words. Pure: `Evidence` in, findings out."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import sqrt

from dissectors.findings import Finding, Severity, Tally, found
from dissectors.line import NS_PER_S, Timing
from dissectors.modbus.functions import EXCEPTIONS as EXCEPTION_NAMES
from dissectors.modbus.functions import FUNCTIONS
from dissectors.modbus.rules import EXCEPTIONS, RULES, VENDOR_EXCEPTION
from dissectors.modbus.station_record import Cycles, Key, Requested, Station

MS = 1_000_000
SILENT_AT_END = 5
"""Unanswered requests in a row to the end, from which on a station that used to answer has fallen silent."""

_SENDERS_KEPT = 300
_HASTE = 100 * MS  # no master gives up sooner on a station that is alive, unless it always waits as long
_COLLATERAL = frozenset(("MB002", "MB003", "MB005", "MB007", "MB009", "MB103", "MB104", "MB201", "MB202", "MB302"))
_WASTE = 0.05
_REPEATS_COST = 0.02


@dataclass(slots=True)
class Evidence:
    """What was seen on the bus. Times are ns.

    `hasty`: requests after another that nothing had followed: (longest reading of the silence between, unit asked
    before, time, frame before, frame). `close`, `paused`: by sender. `pairs`: (unit asked, unit that answered).
    """

    timing: Timing
    first: int | None = None
    now: int = 0
    requests: int = 0
    answers: int = 0
    echoes: int = 0
    stations: dict[int, Station] = field(default_factory=dict)
    damaged_requests: Tally = field(default_factory=Tally)
    unasked: Tally = field(default_factory=Tally)
    answers_to_broadcast: Tally = field(default_factory=Tally)
    noise_after_broadcast: Tally = field(default_factory=Tally)
    hasty: list[tuple[int, int, int, int, int]] = field(default_factory=list)
    close: dict[str, Tally] = field(default_factory=dict)
    paused: dict[str, Tally] = field(default_factory=dict)
    pairs: dict[tuple[int, int], Tally] = field(default_factory=dict)
    cycles: Cycles = field(default_factory=Cycles)

    @property
    def span(self) -> int:
        """From the first octet to the last, ns; at least 1."""
        return max(1, self.now - (self.first or 0))

    def pair(self, pair: tuple[int, int]) -> Tally:
        """The record of one unit that answers for another."""
        return self.pairs.setdefault(pair, Tally()) if len(self.pairs) < _SENDERS_KEPT else self.unasked

    def gap_tally(self, by_sender: dict[str, Tally], sender: str) -> Tally:
        """The record of one sender's gaps."""
        return by_sender.setdefault(sender, Tally())

    def rare(self, count: int, of: int) -> bool:
        """Whether so few are not worth a warning: one, or under 1 in 100 and at most two a minute."""
        minutes = max(1, -(-self.span // (60 * NS_PER_S)))
        return count == 1 or (count <= 2 * minutes and 100 * count < of)


def judge(seen: Evidence, timeout: int | None) -> tuple[Finding, ...]:
    """All findings: the bus first, then station by station. `timeout`: the master's, ns, None while unlearnt."""
    masters = [*_of_masters(seen)]
    made = [*_of_bus(seen), *masters, *_of_gaps(seen)]
    common = _common_damage(seen)
    made += common
    for unit in sorted(seen.stations):
        made += _of_station(seen, f"station {unit}", seen.stations[unit], timeout, bool(common))
    if masters:  # they collide, and what comes of it is no finding of its own
        return tuple(_as_note(finding) if finding.code in _COLLATERAL else finding for finding in made)
    return tuple(made)


def _as_note(finding: Finding) -> Finding:
    return replace(finding, severity=min(finding.severity, Severity.NOTE))


# ---- the bus


def _of_bus(seen: Evidence) -> Iterator[Finding]:
    requests = sum(station.asked for station in seen.stations.values()) + seen.damaged_requests.count
    damaged = seen.damaged_requests
    if damaged.count:
        words = f"{damaged.count} of {requests} requests were damaged"
        yield damaged.found(RULES["MB009"], "master", words, _note_if(seen.rare(damaged.count, requests)))
    absent = {unit: station for unit, station in seen.stations.items() if _is_absent(station)}
    waited = sum(station.waited for station in absent.values())
    if waited:
        share = waited / seen.span
        words = f"{share:.0%} of the time ({seconds(waited)}) went into waiting for {_units(absent)}"
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
        what = "a frame" if broadcast.count else "octets that are no frame"
        words = f"{what} {times(tally.count)} directly after a broadcast"
        yield tally.found(RULES["MB204"], "bus", words, _note_if(tally.count == 1))
    for (asked, answered), tally in sorted(seen.pairs.items()):
        if tally.count >= 2:
            words = f"{tally.count} requests to {asked} were answered by {answered}"
            yield tally.found(RULES["MB206"], f"station {asked}", words)
    unasked = seen.unasked
    if unasked.count:
        words = f"{unasked.count} of {seen.answers} answers came unasked"
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
        if tally.count >= 3:
            words = f"{tally.count} frames with over {ms(timing.t15)} of silence inside"
            yield tally.found(RULES["MB302"], sender, words)
    if timing.latency >= timing.t15 and seen.stations:
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
    words = f"{damaged} of {total} answers are damaged ({rate:.1%}), alike on {_units(struck)}"
    if seen.damaged_requests.count:
        words += f"; {times(seen.damaged_requests.count)} a request too"
    finding = tally.found(RULES["MB007"], "bus", words, _note_if(seen.rare(damaged, total)))
    last = max(station.damaged.last for station in struck.values())
    return [replace(finding, count=damaged, last=last)]


def _cycle(seen: Evidence) -> Iterator[Finding]:
    usual = seen.cycles.usual()
    if usual is None or len(usual[1]) < 4:
        return
    octets, periods = usual
    low, median, high = (periods[len(periods) * part // 100] for part in (5, 50, 95))
    name = FUNCTIONS[octets[1]].name.replace("-", " ") if octets[1] in FUNCTIONS else f"function {octets[1]}"
    words = f"the master comes back to station {octets[0]} ({name}) every {seconds(median)}"
    if high - low > max(median // 50, 2 * seen.timing.latency, MS):
        words += f"; 90 of 100 times {seconds(low)} to {seconds(high)}"
    yield found(RULES["MB401"], "bus", words, first=seen.first or 0, last=seen.now, count=len(periods))


# ---- one station


def _of_station(seen: Evidence, name: str, station: Station, timeout: int | None, is_common: bool) -> Iterator[Finding]:
    yield from _missing(seen, name, station)
    yield from _damaged(seen, name, station, is_common)
    for (key, code), tally in sorted(station.exceptions.items(), key=lambda item: str(item[0])):
        yield _exception(name, station, key, code, tally)
    if station.unfit.count:
        why, _ = station.unfit_words.most_common(1)[0] if station.unfit_words else ("", 0)
        words = f"{station.unfit.count} of {station.answered} answers do not fit their requests: {why}"
        yield station.unfit.found(RULES["MB010"], name, words, _note_if(station.unfit.count == 1))
    yield from _times(name, station, timeout, seen, is_common)
    if station.twice.count:
        words = f"two answers to one request {times(station.twice.count)}"
        slow = station.twice.count <= station.late.count  # two tries, two answers: the first one came late
        yield station.twice.found(RULES["MB201"], name, words, _note_if(station.twice.count == 1 or slow))
    if station.reserved.count:
        yield station.reserved.found(RULES["MB205"], name, f"{station.reserved.count} frames name it")


def _missing(seen: Evidence, name: str, station: Station) -> Iterator[Finding]:
    missing = station.missing
    if not missing.count:
        return
    if _is_absent(station):
        if missing.count >= 2:
            words = f"no answer to any of {station.asked} requests"
            stray = station.damaged.count
            words += f"; noise followed {times(stray)}" if stray else ""
            yield missing.found(RULES["MB001"], name, words)
        else:
            yield missing.found(RULES["MB001"], name, "no answer to the only request", Severity.NOTE)
        return
    silent = station.silent
    if silent.count >= SILENT_AT_END and station.answered and station.last_heard is not None:
        since = seen.now - station.last_heard
        words = f"no answer to its last {silent.count} requests; last heard {seconds(since)} before the end"
        yield silent.found(RULES["MB003"], name, words)
    ignored = [(key, request) for key, request in sorted(station.requests.items(), key=str) if _is_ignored(request)]
    if station.answered >= 3 and silent.count < SILENT_AT_END:
        for key, request in ignored:
            words = f"{request.tries} times asked to {request_words(key)}, never answered; it answers other requests"
            yield request.missing.found(RULES["MB004"], name, words)
    else:
        ignored = []
    explained = sum(request.missing.count for _, request in ignored)
    if silent.count >= SILENT_AT_END and station.answered:
        explained += silent.count
    left = missing.count - explained
    if left > 0:
        words = f"{left} of {station.asked} requests were followed by nothing"
        finding = missing.found(RULES["MB002"], name, words, _note_if(seen.rare(left, station.asked)))
        yield replace(finding, count=left)


def _is_absent(station: Station) -> bool:
    """Whether no good frame ever came from it, and no more than stray damage in place of answers."""
    heard = station.answered or station.late.count or station.twice.count
    return bool(station.missing.count) and not heard and 4 * station.damaged.count <= station.asked


def _is_ignored(request: Requested) -> bool:
    return request.turns >= 3 and request.missing.count == request.tries


def _damaged(seen: Evidence, name: str, station: Station, is_common: bool) -> Iterator[Finding]:
    damaged, ends = station.damaged, station.last_octet
    if not damaged.count or _is_absent(station):
        return
    rare = seen.rare(damaged.count, station.asked)
    if ends.count >= 3 and 2 * ends.count >= damaged.count:
        words = f"{ends.count} of {station.asked} answers are right up to their last octet, which is not"
        yield ends.found(RULES["MB006"], name, words, _note_if(rare))
        if 4 * ends.count >= 3 * damaged.count:
            return
    over = station.talked_over.count + station.garbled
    if over >= 3 and 4 * over >= station.asked and not is_common:
        words = f"{over} of {station.asked} answers are longer than asked for, or garbled inside"
        tally = station.talked_over if station.talked_over.count else damaged
        yield replace(tally.found(RULES["MB202"], name, words), count=over)
    details = []
    if station.cut:
        details.append(f"{station.cut} ended early")
    if station.garbled:
        details.append(f"{station.garbled} were no frame at all")
    words = f"{damaged.count} of {station.asked} answers are damaged"
    words += f" ({', '.join(details)})" if details else ""
    low, high = wilson(damaged.count, station.asked)
    if station.asked >= 20:
        words += f"; {low:.1%} to {high:.1%} of all with 95 % confidence"
    yield damaged.found(RULES["MB005"], name, words, _note_if(rare or is_common))


def _exception(name: str, station: Station, key: Key, code: int, tally: Tally) -> Finding:
    severity, means, following = EXCEPTIONS.get(code, VENDOR_EXCEPTION)
    meaning = EXCEPTION_NAMES.get(code) or f"code 0x{code:02X} of the vendor's"
    request = station.requests.get(key)
    of = f" of {request.tries}" if request is not None else ""
    words = f"exception {code} ({meaning}) to {tally.count}{of} requests to {request_words(key)}"
    return replace(tally.found(RULES["MB008"], name, words, severity), means=means, next=following)


def _times(name: str, station: Station, timeout: int | None, seen: Evidence, is_common: bool) -> Iterator[Finding]:
    times_, slow = station.times, station.slow
    if slow.count >= 3 and 100 * slow.count >= station.answered:
        against = "500 ms" if timeout is None else f"70 in 100 of the master's timeout of {ms(timeout)}"
        words = (
            f"{slow.count} of {station.answered} answers took longer than {against}; the longest at least "
            f"{ms(times_.longest)}"
        )
        yield slow.found(RULES["MB101"], name, words)
    quarters = times_.quarters()
    if quarters:
        first, last = quarters[0], quarters[-1]
        rises = all(20 * b.nominal >= 19 * a.nominal for a, b in pairwise(quarters))
        if rises and 2 * last.low > 3 * first.high and last.low - first.high > 5 * MS:
            words = f"median response time rose from {ms(first.nominal)} to {ms(last.nominal)}"
            yield found(
                RULES["MB102"], name, words, first=seen.first or 0, last=station.last_heard or 0, count=times_.count
            )
    if station.late.count:
        words = f"answered {times(station.late.count)} after the master had gone on"
        waits = f", which waits {ms(timeout)}" if timeout is not None else ""
        yield station.late.found(RULES["MB103"], name, words + waits, _note_if(station.late.count == 1))
    if station.answered and station.repeats.count:
        share = station.repeats_cost / seen.span
        words = (
            f"{station.repeats.count} repeats cost {seconds(station.repeats_cost)}, {share:.1%} of the time of the bus"
        )
        costly = share > _REPEATS_COST and not is_common
        yield station.repeats.found(RULES["MB104"], name, words, Severity.WARNING if costly else None)


# ---- words and numbers


def wilson(count: int, of: int) -> tuple[float, float]:
    """95 % confidence interval of a share (Wilson 1927); (0, 1) of nothing."""
    if of <= 0:
        return 0.0, 1.0
    z = 1.96
    share = min(1.0, count / of)
    middle = (share + z * z / (2 * of)) / (1 + z * z / of)
    half = z * sqrt(share * (1 - share) / of + z * z / (4 * of * of)) / (1 + z * z / of)
    return max(0.0, middle - half), min(1.0, middle + half)


def request_words(key: Key) -> str:
    """ "read holding registers from 0x2520"."""
    kind, address = key
    return kind.replace("-", " ") + (f" from 0x{address:04X}" if address is not None else "")


def times(count: int) -> str:
    """ "once", "12 times"."""
    return "once" if count == 1 else f"{count} times"


def ms(duration: int) -> str:
    """ns as "8.2 ms"."""
    value = duration / MS
    return f"{value:.0f} ms" if value >= 100 else f"{value:.1f} ms" if value >= 10 else f"{value:.2f} ms"


def seconds(duration: int) -> str:
    """ns as "2.1 s", or milliseconds, or minutes."""
    if duration < NS_PER_S:
        return ms(duration)
    if duration < 120 * NS_PER_S:
        return f"{duration / NS_PER_S:.2f} s"
    return f"{duration / (60 * NS_PER_S):.0f} min"


def _units(units: Iterable[int]) -> str:
    numbers = sorted(units)
    shown = ", ".join(map(str, numbers[:8])) + (" …" if len(numbers) > 8 else "")
    return f"station{'s' if len(numbers) > 1 else ''} {shown}"


def _note_if(condition: bool) -> Severity | None:
    return Severity.NOTE if condition else None
