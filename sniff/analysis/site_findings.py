"""Findings about a site, whose buses are on one clock. Pure: values of each bus in, findings about the site out.

A finding needs what chance cannot explain: moments that agree for every bus, delays that vary less than the traffic
itself does. Two plants that are built alike run the same programme and are still not in step.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, permutations

import numpy as np

from dissectors.columns import Masks, Times
from dissectors.findings import Finding, as_consequence, counted, found, from_the_root
from dissectors.line import MS, NS_PER_S
from dissectors.subject import About, Subject
from dissectors.words import elapsed, milliseconds
from sniff.analysis.site_ear import AnsweredExchanges, HeardFrames, Keys, SiteEar
from sniff.analysis.site_rules import SITE
from sniff.analysis.site_rules import SITE_RULES as RULES
from sniff.analysis.time_patterns import Stop

MOMENT = 2 * NS_PER_S
"""ns within which things happen at one moment."""

REACH = NS_PER_S
"""ns after which what comes on another bus is no copy."""

SHARE, SHARE_FORWARDED = 0.9, 0.8
LEAST_FRAMES, LEAST_REQUESTS, LEAST_FORWARDED = 60, 30, 20
TIGHTER = 3
"""So many times less must a delay vary than the intervals of the traffic do."""

LEAST_VARIED = 2 * MS


@dataclass(frozen=True, slots=True)
class SiteBus:
    """A bus as far as others are concerned. `first`, `last`: ns, of what was heard, None for nothing. `doubt`: ns that
    its adapter may hold octets back. `findings`: its own."""

    name: str
    ear: SiteEar
    stops: Sequence[Stop]
    first: int | None
    last: int | None
    doubt: int
    findings: tuple[Finding, ...] = ()


@dataclass(frozen=True, slots=True)
class SiteJudgement:
    """`findings`: about the site; `buses`: those of each bus, with what the site explains as consequences."""

    findings: tuple[Finding, ...]
    buses: tuple[tuple[Finding, ...], ...]


def judged(buses: Sequence[SiteBus]) -> SiteJudgement:
    """Hold the buses of a site against each other."""
    made: list[Finding] = []
    told = [list(bus.findings) for bus in buses]
    for finding, at, until in (*_stopped(buses), *_unplugged(buses)):
        made.append(finding)
        for number, own in enumerate(told):
            told[number] = [_explained(one, finding, at, until, buses[number]) for one in own]
    for one, other in combinations(buses, 2):
        made += _in_step(one, other)
    for front, back in permutations(buses, 2):
        made += _forwarded(front, back)
    order = sorted(made, key=lambda one: (-one.severity, one.code, one.first))
    site = _merged(order)
    return SiteJudgement(site, tuple(from_the_root((*own, *site), RULES)[: len(own)] for own in told))


def _merged(findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """Several of one rule about the same thing as one, in the words of the first."""
    kept: dict[tuple[str, str], Finding] = {}
    for one in findings:
        kept[one.key] = kept[one.key].merge(one) if one.key in kept else one
    return tuple(kept.values())


def _explained(finding: Finding, cause: Finding, at: int, until: int, bus: SiteBus) -> Finding:
    """A finding of a bus under one of the site, where all of it lies in that time."""
    rule = RULES[cause.code]
    if finding.cause is not None or not finding.code.startswith(rule.explains) or finding.severity > cause.severity:
        return finding
    whole_capture = finding.is_once or finding.last <= 0
    inside = at - MOMENT <= finding.first and finding.last <= until + MOMENT
    if not inside and not (whole_capture and bus.first is None):
        return finding
    return as_consequence(finding, cause, RULES)


# -- moments -----------------------------------------------------------------------------------------------------------


def _stopped(buses: Sequence[SiteBus]) -> Iterator[tuple[Finding, int, int]]:
    """Moments at which every bus that was heard stopped; each with its begin and end, ns."""
    heard = [bus for bus in buses if bus.first is not None]
    if len(heard) < 2:
        return
    span = max(bus.last or 0 for bus in heard) - min(bus.first or 0 for bus in heard)
    doubt = min(MOMENT, span // 100)
    for stop in heard[0].stops:
        together = [stop]
        for bus in heard[1:]:
            near = [one for one in bus.stops if one.is_all and _is_one_moment([*together, one], doubt)]
            if not near:
                break
            together.append(near[0])
        if len(together) == len(heard) and stop.is_all:
            yield _stop(heard, together)


def _is_one_moment(stops: Sequence[Stop], doubt: int) -> bool:
    """Whether there is a moment until which all were alive and after which none was; and they overlap."""
    alive, seen = max(stop.alive for stop in stops), min(stop.seen for stop in stops)
    begins = [stop.alive for stop in stops]
    back = min((stop.back for stop in stops if stop.back is not None), default=None)
    return alive - seen <= doubt and max(begins) - min(begins) <= doubt and (back is None or back > alive)


def _stop(heard: Sequence[SiteBus], stops: Sequence[Stop]) -> tuple[Finding, int, int]:
    at = min(stop.alive for stop in stops)
    first = min(bus.first or 0 for bus in heard)
    backs = [stop.back for stop in stops if stop.back is not None]
    until = max(backs) if len(backs) == len(stops) else max(bus.last or 0 for bus in heard)
    said = []
    for bus, stop in zip(heard, stops, strict=True):
        what = "silent" if not stop.stations else f"{counted(len(stop.stations), 'station')} lost"
        later = "not back" if stop.back is None else f"back after {elapsed(stop.back - at)}"
        said.append(f"{bus.name}: {what}, {later}")
    seen = f"{len(heard)} buses stopped at one moment, {elapsed(at - first)} after the begin: {'; '.join(said)}"
    rule = RULES["SB001"]
    severity = rule.severity if len(backs) == len(stops) else type(rule.severity).ERROR
    finding = found(rule, _site(), seen, first=at, last=until, count=1, severity=severity)
    return finding, at, until


def _unplugged(buses: Sequence[SiteBus]) -> Iterator[tuple[Finding, int, int]]:
    """Moments at which several ports went."""
    losses = sorted((time, number) for number, bus in enumerate(buses) for time in bus.ear.unplugged)
    while losses:
        at = losses[0][0]
        together = [loss for loss in losses if loss[0] - at <= MOMENT]
        losses = losses[len(together) :]
        names = [buses[number].name for number in sorted({number for _, number in together})]
        if len(names) < 2:
            continue
        begin = min((bus.first for bus in buses if bus.first is not None), default=at)
        when = f"{elapsed(max(0, at - begin))} after the begin"
        seen = f"the ports of {len(names)} buses ({', '.join(names)}) went away at one moment, {when}"
        finding = found(RULES["SB002"], _site(), seen, first=at, last=together[-1][0], count=1)
        yield finding, at, max(bus.last or at for bus in buses)


# -- in step -----------------------------------------------------------------------------------------------------------


def _in_step(one: SiteBus, other: SiteBus) -> Iterator[Finding]:
    """Whether the frames of one bus come on the other, too, in step."""
    doubt = one.doubt + other.doubt
    ours, theirs = _common(one.ear.heard(), other.ear.heard())
    asked, others = _requests(ours), _requests(theirs)
    if len(asked) < LEAST_REQUESTS or len(others) < LEAST_REQUESTS:
        return
    lag = _lag(asked, others, doubt)
    if lag is None:
        return
    answers, back = _answers(ours), _answers(theirs)
    both = min(len(answers), len(back))
    copied = _matched(answers, back, lag, doubt) if both >= LEAST_FRAMES - LEAST_REQUESTS else 0.0
    pair = f"{one.name}, {other.name}"
    first, last = int(min(ours.start[0], theirs.start[0])), int(max(ours.end[-1], theirs.end[-1]))
    if copied >= SHARE:
        seen = (
            f"{counted(len(ours), 'frame')} of {one.name} are heard on {other.name}, octet by octet, "
            f"{_lag_words(lag)} (±{milliseconds(doubt)})"
        )
        yield found(RULES["SB003"], _pair(pair), seen, first=first, last=last, count=len(ours))
    elif copied <= 1 - SHARE or both < LEAST_FRAMES - LEAST_REQUESTS:
        seen = (
            f"{counted(len(asked), 'request')} of {one.name} are sent on {other.name}, too, {_lag_words(lag)} "
            f"(±{milliseconds(doubt)}); the answers are others"
        )
        yield found(RULES["SB004"], _pair(pair), seen, first=first, last=last, count=len(asked))


def _lag_words(lag: int) -> str:
    return f"{milliseconds(abs(lag))} {'later' if lag >= 0 else 'before'}"


def _lag(asked: HeardFrames, others: HeardFrames, doubt: int) -> int | None:
    """The time after which requests come on the other bus, too; None where they do not, or are not in step."""
    delays, share = _delays(asked, others)
    if share < SHARE or _delays(others, asked)[1] < SHARE:
        return None
    low, middle, high = (int(value) for value in np.percentile(delays, (5, 50, 95)))
    intervals = np.diff(asked.start)
    varied = float(np.percentile(intervals, 95) - np.percentile(intervals, 5))
    if varied < max(LEAST_VARIED, TIGHTER * doubt) or TIGHTER * (high - low) > varied:
        return None
    return middle if _matched(asked, others, middle, max(doubt, high - low)) >= SHARE else None


def _delays(one: HeardFrames, other: HeardFrames) -> tuple[Times, float]:
    """For each frame the way to the nearest of the same octets, ns, and the share of those that have one in reach."""
    before, after = _neighbours(one.key, one.start, other.key, other.start)
    best = np.full(len(one), 2 * REACH, np.int64)
    for places in (before, after):
        there = np.flatnonzero(places >= 0)
        delay = other.start[places[there]] - one.start[there]
        nearer = np.abs(delay) < np.abs(best[there])
        best[there[nearer]] = delay[nearer]
    reached = np.abs(best) <= REACH
    return best[reached], float(reached.mean()) if len(one) else 0.0


def _neighbours(keys: Keys, times: Times, others: Keys, when: Times) -> tuple[Times, Times]:
    """For each entry the places of the last other with the same key before that time, and of the first at or after it;
    -1 for none."""
    count = len(others)
    all_keys, all_times = np.concatenate([keys, others]), np.concatenate([times, when])
    is_other = np.arange(len(all_keys)) >= len(keys)
    order = np.lexsort((is_other, all_times, all_keys))  # of one time: entries first, so that it is "at or after"
    ranked = np.where(is_other[order], np.arange(len(order)), -1)
    last = np.maximum.accumulate(ranked)
    following = np.where(is_other[order], np.arange(len(order)), len(order))
    first = np.minimum.accumulate(following[::-1])[::-1]
    found = []
    for near, limit in ((last, -1), (first, len(order))):
        places = np.full(len(keys), -1, np.int64)
        if count and len(keys):
            at = np.where(near == limit, 0, near)
            same = (near != limit) & (all_keys[order][at] == all_keys[order]) & ~is_other[order]
            places[order[same]] = order[at[same]] - len(keys)
        found.append(places)
    return found[0], found[1]


def _matched(one: HeardFrames, other: HeardFrames, lag: int, doubt: int) -> float:
    """The share of frames that come on the other bus after that time."""
    moved = replace(one, start=one.start + lag)
    delays, share = _delays(moved, other)
    return share * float((np.abs(delays) <= doubt + MS).mean()) if len(delays) else 0.0


def _common(one: HeardFrames, other: HeardFrames) -> tuple[HeardFrames, HeardFrames]:
    """What both heard while the other listened, too."""
    if not len(one) or not len(other):
        return one, other
    begin, end = max(one.start[0], other.start[0]) - REACH, min(one.end[-1], other.end[-1]) + REACH
    return tuple(_some(each, (each.start >= begin) & (each.end <= end)) for each in (one, other))  # type: ignore[return-value]


def _requests(heard: HeardFrames) -> HeardFrames:
    return _some(heard, heard.asks)


def _answers(heard: HeardFrames) -> HeardFrames:
    return _some(heard, ~heard.asks)


def _some(heard: HeardFrames, which: Masks) -> HeardFrames:
    return HeardFrames(heard.start[which], heard.end[which], heard.key[which], heard.asks[which])


# -- handed on ---------------------------------------------------------------------------------------------------------


def _forwarded(front: SiteBus, back: SiteBus) -> Iterator[Finding]:
    """Stations of one bus whose requests are handed on to another."""
    ours, theirs = front.ear.exchanges(), back.ear.exchanges()
    if len(ours) < LEAST_FORWARDED or len(theirs) < LEAST_FORWARDED:
        return
    inner = _nested(ours, theirs, front.doubt + back.doubt)
    for station in np.unique(ours.station).tolist():
        own = ours.station == station
        handed = own & (inner >= 0)
        if handed.sum() < LEAST_FORWARDED or handed.sum() < SHARE_FORWARDED * own.sum():
            continue
        places = inner[handed]
        kinds = np.isin(theirs.wanted, np.unique(ours.wanted[handed]))
        if len(np.unique(places)) < SHARE_FORWARDED * kinds.sum():
            continue  # such requests come there by themselves, too
        yield _gateway(front, back, ours, theirs, handed, places, int(station))


def _nested(ours: AnsweredExchanges, theirs: AnsweredExchanges, doubt: int) -> Times:
    """For each exchange the place of one on the other bus that wants the same and lies within it; -1 for none."""
    _, after = _neighbours(ours.wanted, ours.asked - doubt, theirs.wanted, theirs.start)
    done = theirs.answered[np.maximum(after, 0)]
    places: Times = np.where((after >= 0) & (done <= ours.back + doubt), after, -1)
    return places


def _gateway(
    front: SiteBus,
    back: SiteBus,
    ours: AnsweredExchanges,
    theirs: AnsweredExchanges,
    handed: Masks,
    places: Times,
    station: int,
) -> Finding:
    whole = ours.back[handed] - ours.asked[handed]
    inside = theirs.answered[places] - theirs.start[places]
    own = np.maximum(whole - inside, 0)  # as far as the adapters allow what they said
    asked = sorted(set(theirs.station[places].tolist()))
    middle, most = int(np.median(own)), int(own.max())
    share = int(np.median(own) * 100 / max(1, np.median(whole)))
    doubt = milliseconds(front.doubt + back.doubt)
    seen = (
        f"{counted(int(handed.sum()), 'request')} to station {station} on {front.name} are asked again on {back.name} "
        f"(station {', '.join(map(str, asked))}): p50 {milliseconds(int(np.median(whole)))} for an answer, of which "
        f"the gateway itself takes {milliseconds(middle)} ({share}%), {milliseconds(most)} at most (±{doubt})"
    )
    subject = _pair(f"{front.name} station {station}, {back.name}")
    first, last = int(ours.start[handed].min()), int(ours.answered[handed].max())
    return found(RULES["SB005"], subject, seen, first=first, last=last, count=int(handed.sum()))


def _site() -> Subject:
    return Subject(About.OTHER, name=SITE)


def _pair(names: str) -> Subject:
    return Subject(About.OTHER, name=names)
