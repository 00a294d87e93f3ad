"""What the rules say of a ring. `judge` is pure: a Ring in, findings out; `MstpFindings` feeds it from the live bus."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from dissectors.bacnet.content_findings import ContentFindings
from dissectors.bacnet.limits import MAX_MASTER, N_POLL, T_REPLY_DELAY, T_USAGE_DELAY
from dissectors.bacnet.ring import Happened, Node, Ring, What
from dissectors.bacnet.ring_observer import RingObserver
from dissectors.bacnet.rules import RULES
from dissectors.findings import EVIDENCE_MAX, Finding, Severity, Tally, counted, found, times
from dissectors.frame import Event, Header
from dissectors.line import Timing
from dissectors.tracker import Placement, Transaction, Verdict

_MS = 1_000_000
SLOW_ROUND = 2_000 * _MS
LATE_SHARE = 0.01
"""Share of slow uses of the token from which on a station is named."""

POLLS_SHARE = 0.1
POSTPONED_SHARE = 0.1
DAMAGED_SHARE = 0.001
DAMAGED_OF_ONE_SHARE = 0.01
NOISE_SHARE = 0.005
COLLIDED_SHARE = 0.2
LEAST_FRAMES = 20
ALONE_POLLS = 2 * MAX_MASTER
"""A first search for a successor takes at most MAX_MASTER polls."""

REFUSED_KEPT = 512
"""Most services and errors of stations that are counted apart."""

_ANSWERED = frozenset((Verdict.ANSWERED, Verdict.RETRY, Verdict.EXCEPTION))

_SIMPLE: tuple[tuple[str, What, int, str], ...] = (
    ("MS102", What.RETRY, 1, "token repeated {times}"),
    ("MS105", What.REJOINED, 1, "answered a Poll For Master {times} though it had been in the ring"),
    ("MS107", What.SELF_TOKEN, 1, "passed the token to itself {times}"),
    ("MS301", What.NO_REPLY, 1, "no answer to {requests}"),
    ("MS304", What.BROADCAST_REQUEST, 1, "sent a broadcast that expects a reply {times}"),
    ("MS404", What.ILLEGAL, 1, "sent a forbidden address or length {times}"),
)
"""Rules that only count: code, kind of event, from how many on, what was seen."""

_TIMED: tuple[tuple[str, What, int, str], ...] = (
    ("MS202", What.LATE_POLL_REPLY, T_USAGE_DELAY, "answered a poll late {times}, up to {most}"),
    ("MS302", What.LATE_REPLY, T_REPLY_DELAY, "answered late {times}, up to {most}"),
)
"""Rules that name the longest time."""


def judge(ring: Ring) -> tuple[Finding, ...]:
    """All findings about a ring, the gravest first."""
    made = [*_tokens(ring), *_counted(ring), *_times(ring), *_polls(ring), *_answers(ring), *_damage(ring)]
    shared = list(_duplicates(ring))
    sure = [finding for finding in shared if finding.severity is Severity.ERROR]
    made += sure or shared  # one that is sure explains the damage at the others
    return tuple(sorted(made, key=_gravest_first))


def _gravest_first(finding: Finding) -> tuple[int, str, str]:
    return -finding.severity, finding.code, finding.subject


def _tokens(ring: Ring) -> Iterable[Finding]:
    for (what, mac), happened in ring.happened.items():
        if what is What.LOST_TOKEN:
            subject = "bus" if mac is None else _station(mac)
            longest = max((event.value or 0 for event in happened.events), default=0)
            makers = sorted({event.other for event in happened.events if event.other is not None})
            held = "the holder is not known" if mac is None else f"MAC {mac} had it"
            seen = (
                f"the token was lost {times(happened.count)}; {held}; silence up to {_ms(longest)}; "
                f"begun anew by MAC {_list(makers)}"
            )
            yield _of("MS101", subject, seen, happened)
        elif what is What.LEFT and mac is not None and ring.of(What.REJOINED, mac).last <= happened.last:
            node = ring.nodes.get(mac)
            if node is not None and node.last <= happened.last:
                seen = "did not use its token, was passed over, and has been silent since"
                yield _of("MS106", _station(mac), seen, happened)
    stray = [
        happened for (what, _), happened in ring.happened.items() if what is What.TWO_TOKENS and _shows_tokens(ring)
    ]
    total = sum(happened.count for happened in stray)
    if total >= 2:
        together = stray[0]
        for happened in stray[1:]:
            together = together.merge(happened)
        who = sorted({event.mac for event in together.events if event.mac is not None})
        seen = f"MAC {_list(who)} sent {times(total)} while another one had the token"
        yield _of("MS104", "bus", seen, together)
    for mac in ring.masters:
        loop = ring.nodes[mac].loop
        slow = loop.quantile(0.95)
        if slow is not None and loop.count >= LEAST_FRAMES and slow > SLOW_ROUND:
            yield _plain("MS108", ring, _station(mac), f"95% of the rounds took up to {_ms(slow)}")
    for mac, node in ring.nodes.items():
        if node.polls_sent > ALONE_POLLS and not node.tokens_sent and not node.tokens_received:
            yield _plain(
                "MS109", ring, _station(mac), f"{counted(node.polls_sent, 'poll')} for masters and not one token"
            )


def _counted(ring: Ring) -> Iterable[Finding]:
    for code, kind, least, words in _SIMPLE:
        for (what, mac), happened in ring.happened.items():
            if what is kind and happened.count >= least:
                severity = None
                node = ring.nodes.get(mac) if mac is not None else None
                if code == "MS102" and (happened.count == 1 or _share(happened.count, node) < LATE_SHARE):
                    severity = Severity.NOTE
                if code == "MS301" and happened.count == 1:
                    severity = Severity.NOTE
                seen = words.format(times=times(happened.count), requests=counted(happened.count, "request"))
                # a forbidden address is the sender's affair, and may stand for no station
                subject = _station(mac) if what is What.ILLEGAL and mac is not None else _pair(happened, mac)
                yield _of(code, subject, seen, happened, severity)


def _share(count: int, node: Node | None) -> float:
    return count / max(1, node.tokens_received if node is not None else 0)


def _times(ring: Ring) -> Iterable[Finding]:
    for code, kind, limit, words in _TIMED:
        if not ring.measurable(limit):
            continue
        for (what, mac), happened in ring.happened.items():
            if what is kind:
                most = max((event.value or 0 for event in happened.events), default=0)
                seen = words.format(times=times(happened.count), most=_ms(most))
                yield _of(code, _pair(happened, mac), seen, happened)
    if not ring.measurable(T_USAGE_DELAY):
        return
    for mac, node in ring.nodes.items():
        late = ring.of(What.LATE_USE, mac)
        if node.use.count >= LEAST_FRAMES and late.count >= max(2, LATE_SHARE * node.use.count):
            seen = (
                f"{late.count} of {node.use.count} times it used the token over {_ms(T_USAGE_DELAY)} after it came; "
                f"median {_ms(node.use.quantile(0.5))}, longest {_ms(node.use.most)}"
            )
            yield _of("MS103", _station(mac), seen, late)


def _polls(ring: Ring) -> Iterable[Finding]:
    advice = {int(words.split()[1]): words for words in ring.advice()}
    for mac, node in ring.nodes.items():
        tokens = node.tokens_received
        polls = node.polls_sent - node.polls_of_search
        if polls < LEAST_FRAMES or not tokens or polls <= POLLS_SHARE * tokens:
            continue
        seen = (
            f"{polls} polls to {tokens} tokens (one in {N_POLL} is usual), {min(polls, node.polls_unanswered)} of them "
            f"unanswered, up to address {node.highest_polled}; "
            f"unanswered polls of all stations take {ring.poll_waste_share:.0%} of the time"
        )
        if mac in advice:
            seen += "; " + advice[mac]
        yield _plain("MS201", ring, _station(mac), seen, polls)


def _answers(ring: Ring) -> Iterable[Finding]:
    for mac, node in ring.nodes.items():
        if node.postponed >= 5 and node.postponed > POSTPONED_SHARE * node.requests_received:
            seen = f"{node.postponed} of {counted(node.requests_received, 'request')} answered with Reply Postponed"
            if node.service.count:
                seen += f"; the real answers took {_ms(node.service.quantile(0.5))}, up to {_ms(node.service.most)}"
            yield _plain("MS303", ring, _station(mac), seen, node.postponed)


def _damage(ring: Ring) -> Iterable[Finding]:
    damaged = ring.header_errors + ring.data_errors + ring.cut
    if damaged >= 3 and damaged > DAMAGED_SHARE * ring.frames:
        kinds = (
            (ring.header_errors, "with a wrong header CRC"),
            (ring.data_errors, "with a wrong data CRC"),
            (ring.cut, "cut off"),
        )
        seen = (
            f"{damaged} of {counted(ring.frames, 'frame')} damaged: "
            f"{', '.join(f'{count} {what}' for count, what in kinds if count)}"
        )
        yield _plain("MS401", ring, "bus", seen, damaged)
    for mac, node in ring.nodes.items():
        sent = node.data_sent + node.tokens_sent + node.damaged
        if node.damaged >= 3 and node.damaged > DAMAGED_OF_ONE_SHARE * sent:
            yield _plain(
                "MS402", ring, _station(mac), f"{node.damaged} of its {sent} frames have a wrong data CRC", node.damaged
            )
    if ring.noise >= 20 and ring.noise > NOISE_SHARE * (ring.octets + ring.noise):
        seen = f"{ring.noise} octets of {ring.octets + ring.noise} belong to no frame"
        yield _plain("MS403", ring, "bus", seen, ring.noise)


def _duplicates(ring: Ring) -> Iterable[Finding]:
    hasty = {mac: happened for (what, mac), happened in ring.happened.items() if what is What.TOO_SOON}
    for mac in sorted({mac for _, mac in ring.happened if mac is not None}):
        second = ring.of(What.SECOND_DEVICE, mac)
        stray = ring.of(What.TWO_TOKENS, mac) if _shows_tokens(ring) else Happened()
        collided = ring.of(What.COLLIDED_REPLY, mac)
        reasons, evidence = [], Happened()
        if second.count:
            devices = ring.nodes[mac].devices if mac in ring.nodes else ()
            reasons.append(f"devices {_list(devices)} said I-Am from this address")
            evidence = evidence.merge(second)
        if stray.count > 2:
            reasons.append(f"sent {times(stray.count)} without the token")
            evidence = evidence.merge(stray)
        node = ring.nodes.get(mac, Node())
        chances = node.tokens_received + node.requests_received + node.polls_received
        often = collided.count > 2 and collided.count > COLLIDED_SHARE * chances
        if often:
            reasons.append(f"damaged octets in place of its answer {times(collided.count)}")
            evidence = evidence.merge(collided)
        # where several stations seem hasty, the times are to blame
        alone = list(hasty) == [mac] and ring.measurable(T_USAGE_DELAY)
        soon = hasty[mac] if alone else Happened()
        if soon.count > 2:
            reasons.append(f"sent again {times(soon.count)} before its own poll could be answered")
            evidence = evidence.merge(soon)
        if second.count or soon.count > 2 or (stray.count > 2 and often):
            yield _of("MS501", _station(mac), "; ".join(reasons), evidence)
        elif reasons:
            yield _of("MS501", _station(mac), "; ".join(reasons), evidence, Severity.WARNING)


def _of(code: str, subject: str, seen: str, happened: Happened, severity: Severity | None = None) -> Finding:
    evidence = tuple(dict.fromkeys(event.no for event in happened.events))[:EVIDENCE_MAX]
    return found(
        RULES[code],
        subject,
        seen,
        first=happened.first,
        last=happened.last,
        count=happened.count,
        evidence=evidence,
        severity=severity,
    )


def _plain(code: str, ring: Ring, subject: str, seen: str, count: int = 1) -> Finding:
    return found(RULES[code], subject, seen, first=ring.first or 0, last=ring.last or 0, count=count)


def _shows_tokens(ring: Ring) -> bool:
    """Whether tokens are in the capture at all: some programs save it without them."""
    return any(node.tokens_sent for node in ring.nodes.values())


def _station(mac: int) -> str:
    return f"MAC {mac}"


def _pair(happened: Happened, mac: int | None) -> str:
    others = {event.other for event in happened.events}
    if mac is None:
        return "bus"
    if len(others) == 1 and (other := others.pop()) is not None:
        return f"{other} → {mac}"
    return _station(mac)


def _ms(duration: int | None) -> str:
    return (
        "?" if duration is None else f"{duration / _MS:.3g} ms" if duration < 1000 * _MS else f"{duration / 1e9:.2f} s"
    )


def _list(numbers: Iterable[int]) -> str:
    return ", ".join(str(number) for number in numbers) or "nobody"


class MstpFindings:
    """Fed row by row; gives findings at any time."""

    def __init__(self, timing: Timing) -> None:
        self._observer = RingObserver(timing)
        self._content = ContentFindings()
        self._asked: Counter[tuple[int, str]] = Counter()  # answered requests, by station and service
        self._refused: dict[tuple[int, str, str], Tally] = {}  # by station, service, and class and code in words

    def see(self, no: int, event: Event, header: Header | None, placement: Placement | None = None) -> None:
        """Take the next row: event, its header and placement (None for noise)."""
        self._observer.see(no, event, header)
        self._content.see(no, event, header)

    def settle(self, transaction: Transaction) -> None:
        """Take a transaction that closed; the ring model has its own view of them, but for error answers."""
        station, verdict = transaction.station, transaction.verdict
        if station is None or transaction.is_passing or verdict not in _ANSWERED:
            return
        if len(self._asked) < REFUSED_KEPT or (station, transaction.kind) in self._asked:
            self._asked[station, transaction.kind] += 1
        if verdict is Verdict.EXCEPTION:
            key = station, transaction.kind, transaction.error or "error"
            if key in self._refused or len(self._refused) < REFUSED_KEPT:
                self._refused.setdefault(key, Tally()).add(transaction.end, transaction.request, transaction.response)

    def ring(self) -> Ring:
        """The ring so far."""
        return self._observer.ring()

    def findings(self) -> tuple[Finding, ...]:
        """All findings so far, the gravest first."""
        made = (*judge(self._observer.ring()), *self._error_answers(), *self._content.findings())
        return tuple(sorted(made, key=_gravest_first))

    def _error_answers(self) -> Iterable[Finding]:
        for (mac, service, words), tally in self._refused.items():
            error = words if words.startswith(("error", "reject", "abort")) else f"error {words}"
            of = max(tally.count, self._asked[mac, service])
            some = f"the only {service} request" if of == 1 else f"{tally.count} of {of} {service} requests"
            severity = Severity.NOTE if tally.count == 1 else None
            yield tally.found(RULES["MS305"], _station(mac), f"{error} in answer to {some}", severity)
