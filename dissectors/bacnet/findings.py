"""The rules' findings about a ring: `judge` is pure, a Ring in, findings out; `MstpFindings` feeds it from a bus."""

from __future__ import annotations

from collections.abc import Iterable

from dissectors import busiest
from dissectors.bacnet.broken_promises import BrokenPromises
from dissectors.bacnet.bulk_ring_observer import BulkRingObserver
from dissectors.bacnet.content_findings import ContentFindings
from dissectors.bacnet.device_instances import DeviceInstances
from dissectors.bacnet.exchange import Ending
from dissectors.bacnet.findings_of_astray_polls import astray
from dissectors.bacnet.findings_of_damage import damage, duplicates
from dissectors.bacnet.findings_of_hearing import hearing, takes_unheard, unheard_share
from dissectors.bacnet.findings_of_overdue import overdue, under_late_answers
from dissectors.bacnet.findings_of_refusals import REFUSED_KEPT, Refusals
from dissectors.bacnet.findings_of_routers import RouterFindings
from dissectors.bacnet.findings_of_skipping import skipped
from dissectors.bacnet.findings_of_tokens import silences, takes_none, tokens
from dissectors.bacnet.findings_of_use import polls, use
from dissectors.bacnet.findings_of_waiting import impatient, waiting
from dissectors.bacnet.limits import MAX_MASTER, T_REPLY_DELAY, T_USAGE_DELAY
from dissectors.bacnet.long_answers import LongAnswers
from dissectors.bacnet.misfitting_answers import OtherNumbers
from dissectors.bacnet.misfitting_answers import astray as answers_astray
from dissectors.bacnet.ring import COARSE_LIMIT, Ring, RingNode
from dissectors.bacnet.ring_events import Happened, RingEventKind
from dissectors.bacnet.ring_remarks import Remark, listed, measured, of, plain
from dissectors.bacnet.ring_window import MstpRingWindow
from dissectors.bacnet.rules import RULES
from dissectors.bacnet.told_silent import ToldSilent
from dissectors.bacnet.told_times import ToldTimes
from dissectors.bacnet.unheard import TRUSTED
from dissectors.chances import is_rare
from dissectors.findings import Finding, Severity, as_consequence, counted, times
from dissectors.frame import Event, Header
from dissectors.line import Timing
from dissectors.row_columns import RowColumns
from dissectors.tracker import PASSING, Placement, Transaction, Verdict

LATE_SHARE = 0.01
"""Share of slow uses of the token from which on a station is named."""

ASKING_SHARE = 0.1
"""The same of those that ask: whether a computer read them late, what comes behind them does not show."""

ALL_LATE = 4
"""A station is named for slow uses of the token where its share is so many times that of the others: what hits all of
them in the same way is a busy computer."""

USED_BOTH_LEAST = 3
USED_BOTH_SHARE = 0.5
LIKE_USUAL = 4
"""A station used tokens and their repeats where something is damaged after half of the repeats, and so many times more
often than after other tokens."""

POSTPONED_SHARE = 0.1
LEAST_USES = 20
FOR_OTHERS_LEAST = 3
_OF_NO_REQUEST = frozenset((Verdict.UNSOLICITED, Verdict.ANSWERED_TWICE))
_ANSWERED = frozenset((Verdict.ANSWERED, Verdict.RETRY, Verdict.EXCEPTION))

_SIMPLE: tuple[tuple[str, RingEventKind, int, str], ...] = (
    ("MS102", RingEventKind.RETRY, 1, "token repeated {times}"),
    ("MS105", RingEventKind.REJOINED, 1, "answered a Poll For Master {times} though it had been in the ring"),
    ("MS107", RingEventKind.SELF_TOKEN, 1, "passed the token to itself {times}"),
    ("MS301", RingEventKind.NO_REPLY, 1, "no answer to {requests}"),
    ("MS304", RingEventKind.BROADCAST_REQUEST, 1, "{times} sent a broadcast that expects a reply"),
    ("MS404", RingEventKind.ILLEGAL, 1, "{times} sent a frame with a forbidden address or length"),
)
"""Rules that only count: code, kind of event, from how many on, what was seen."""

_TIMED: tuple[tuple[str, RingEventKind, int, str], ...] = (
    ("MS202", RingEventKind.LATE_POLL_REPLY, T_USAGE_DELAY, "answered a poll late {times}, up to {most}"),
    ("MS302", RingEventKind.LATE_REPLY, T_REPLY_DELAY, "answered late {times}, up to {most}"),
)
"""Rules that name the longest time."""


def judge(ring: Ring) -> tuple[Finding, ...]:
    """All findings about a ring, the gravest first, consequences as notes that name their cause."""
    late = sorted(overdue(ring), key=lambda one: (one.finding.cause is not None, -one.finding.count))
    made = [
        *tokens(ring),
        *silences(ring),
        *_holders(ring),
        *_counted(ring),
        *_times(ring),
        *polls(ring),
        *astray(ring),
        *_answers(ring),
        *_for_others(ring),
        *answers_astray(ring),
        *waiting(impatient(ring)),
        *late,
        *hearing(ring),
        *under_late_answers(damage(ring), late, ring),
        *duplicates(ring),
        *use(ring),
    ]
    return tuple(sorted(_under_causes(made), key=_gravest_first))


def _gravest_first(finding: Finding) -> tuple[int, str, str]:
    return -finding.severity, finding.code, finding.subject


def _under_causes(made: list[Remark]) -> Iterable[Finding]:
    """What is found of one station and explained by what else is found of it; subjects may name it in other words."""
    causes = sorted(
        (one for one in made if one.mac is not None and one.finding.severity >= Severity.WARNING),
        key=lambda one: -one.finding.severity,
    )
    explained: dict[int, Finding] = {}
    for cause in causes:
        codes = RULES[cause.finding.code].explains
        if id(cause) in explained or not codes:
            continue
        for one in made:
            if (
                one is not cause
                and one.mac == cause.mac
                and id(one) not in explained
                and one.finding.code.startswith(codes)
                and one.finding.severity <= cause.finding.severity
            ):
                explained[id(one)] = as_consequence(one.finding, cause.finding, RULES)
    return (explained.get(id(one), one.finding) for one in made)


def _holders(ring: Ring) -> Iterable[Remark]:
    """Those who are kept from the token, and those who speak without one."""
    yield from skipped(ring)
    for mac, node in ring.nodes.items():
        unasked = ring.of(RingEventKind.UNASKED, mac)
        if unasked.count and not (node.is_master and mac <= MAX_MASTER) and ring.shows_tokens:
            why = "an address above 127 can have no token" if mac > MAX_MASTER else "it never gets a token"
            seen = f"sent {times(unasked.count)} without being asked, while MAC {listed(unasked.parties)} had the token"
            yield of("MS111", mac, f"{seen}; {why}", unasked, Severity.NOTE if unasked.count == 1 else None)


def _for_others(ring: Ring) -> Iterable[Remark]:
    """Those who answer what others are asked."""
    for (what, mac), happened in ring.happened.items():
        if what is RingEventKind.FOR_ANOTHER:
            seen = f"answered {times(happened.count)} what MAC {listed(happened.parties)} was asked"
            if mac is not None and len(happened.parties) == 1 and _says_nothing_else(ring, mac, happened.count):
                seen += (
                    f"; nothing else is heard of it: it may be MAC {happened.parties[0]} itself, with a wrong source "
                    "address"
                )
            yield of("MS306", mac, seen, happened, Severity.NOTE if happened.count < FOR_OTHERS_LEAST else None)


def _says_nothing_else(ring: Ring, mac: int, count: int) -> bool:
    """Whether a station has sent so many frames of data and nothing beside, and nobody gave it a token or asked it."""
    node = ring.nodes.get(mac, RingNode())
    return node.data_sent <= count and not (node.is_master or node.tokens_received or node.requests_received)


def _least_share(ring: Ring) -> float:
    """The share of tokens or answers from which on something says more of a station than of what was not heard."""
    return max(LATE_SHARE, TRUSTED * unheard_share(ring))


def _counted(ring: Ring) -> Iterable[Remark]:
    least_share = _least_share(ring)
    for code, kind, least, words in _SIMPLE:
        for (what, mac), happened in ring.happened.items():
            if what is kind and happened.count >= least:
                if kind is RingEventKind.RETRY and takes_unheard(ring, mac):
                    continue
                if kind is RingEventKind.REJOINED and takes_none(ring, mac):
                    continue  # it was never in the ring
                severity = None
                node = ring.nodes.get(mac) if mac is not None else None
                if code == "MS102" and (happened.count == 1 or _share(happened.count, node) < least_share):
                    severity = Severity.NOTE
                asked = node.requests_received if node else 0
                if code == "MS301" and is_rare(happened.count, asked, ring.span, happened.quarters):
                    severity = Severity.NOTE
                if code == "MS404" and happened.count == 1 and ring.header_errors + ring.data_errors + ring.cut:
                    severity = Severity.NOTE  # damage that happens to fit a header check of eight bits
                seen = words.format(times=times(happened.count), requests=counted(happened.count, "request"))
                if code == "MS301":
                    seen += busiest.words(happened.quarters, happened.count, asked, ring.span)
                # a forbidden address is the sender's affair, and may stand for no station
                yield of(code, mac, seen, happened, severity, pair=what is not RingEventKind.ILLEGAL)


def _share(count: int, node: RingNode | None) -> float:
    return count / max(1, node.tokens_received if node is not None else 0)


def _times(ring: Ring) -> Iterable[Remark]:
    for code, kind, limit, words in _TIMED:
        if ring.coarse and limit < COARSE_LIMIT:
            continue
        for (what, mac), happened in ring.happened.items():
            if what is kind:
                seen = words.format(times=times(happened.count), most=measured(happened.most))
                node = ring.nodes.get(mac, RingNode()) if mac is not None else RingNode()
                is_reply = what is RingEventKind.LATE_REPLY
                answers = node.replies if is_reply else node.poll_replies_sent
                unheard = is_reply and happened.count < TRUSTED * unheard_share(ring) * answers
                rare = unheard or is_rare(happened.count, answers, ring.span, happened.quarters)
                yield of(code, mac, seen, happened, Severity.NOTE if rare else None, pair=True)
    yield from _late_uses(ring)


def _late_at(ring: Ring, mac: int, node: RingNode) -> Happened:
    """When a station used the token late; to ask, only where so often that no computer reads as late."""
    late, asking = ring.of(RingEventKind.LATE_USE, mac), ring.of(RingEventKind.LATE_ASKING, mac)
    return late.merge(asking) if asking.count >= ASKING_SHARE * node.use.count else late


def _late_uses(ring: Ring) -> Iterable[Remark]:
    uses = {mac: (_late_at(ring, mac, node), node) for mac, node in ring.nodes.items() if node.use.count}
    least_share = _least_share(ring)
    for mac, (late, node) in uses.items():
        given_up = ring.of(RingEventKind.GIVEN_UP, mac)
        words, evidence = [], given_up
        others = [(theirs.count, other.use.count) for who, (theirs, other) in uses.items() if who != mac]
        share = sum(count for count, _ in others) / max(1, sum(count for _, count in others))
        alone = late.count >= ALL_LATE * share * node.use.count
        often = late.count >= max(2, least_share * node.use.count)
        if often and not ring.coarse and alone and node.use.count >= LEAST_USES:
            words.append(
                f"{late.count} of {node.use.count} times it used the token over {measured(T_USAGE_DELAY)} "
                "after "
                f"it came; median {measured(node.use.quantile(0.5))}, longest {measured(node.use.most)}"
            )
            evidence = late.merge(given_up)
        if given_up.count:
            words.append(
                f"{times(given_up.count)} only after its neighbour had taken the token back, up to "
                f"{measured(given_up.most)} "
                "after it came: two tokens for a moment"
            )
        both = ring.of(RingEventKind.USED_BOTH, mac)
        if _uses_both(ring, mac, node):
            words.append(
                f"{times(both.count)} only after its neighbour had repeated the token, up to {measured(both.most)} "
                "after it came, and then it used the repeated one too, while the next station sent"
            )
            evidence = evidence.merge(both)
        if words:
            yield of("MS103", mac, "; ".join(words), evidence)


def _uses_both(ring: Ring, mac: int, node: RingNode) -> bool:
    """Whether the damage after tokens that were repeated to a station is its own: it uses them and their repeats.

    A noisy neighbour, or noise that falls anywhere, strikes as often after tokens that were not repeated.
    """
    both, repeated = ring.of(RingEventKind.USED_BOTH, mac).count, ring.of(RingEventKind.RETRY, mac).count
    usual = node.tokens_received - repeated
    if both < max(USED_BOTH_LEAST, USED_BOTH_SHARE * repeated) or usual < repeated:
        return False
    elsewhere = max(0, ring.header_errors + ring.data_errors + ring.cut - both)
    return both * usual >= LIKE_USUAL * elsewhere * repeated


def _answers(ring: Ring) -> Iterable[Remark]:
    for mac, node in ring.nodes.items():
        if node.postponed >= 5 and node.postponed > POSTPONED_SHARE * node.requests_received:
            asked = max(node.requests_received, node.postponed)  # some may have come damaged, or not at all
            seen = f"{node.postponed} of {counted(asked, 'request')} answered with Reply Postponed"
            if node.service.count and ring.timing.has_times:
                median, most = measured(node.service.quantile(0.5)), measured(node.service.most)
                seen += f"; the real answers took {median}, up to {most}"
            yield plain("MS303", ring, mac, seen, node.postponed)


class MstpFindings:
    """Fed row by row; gives findings at any time."""

    def __init__(self, timing: Timing) -> None:
        self._observer = BulkRingObserver(timing)
        self._content = ContentFindings()
        self._instances, self._routers, self._lengths = DeviceInstances(), RouterFindings(), LongAnswers()
        self._refusals, self._promises, self._numbers = Refusals(), BrokenPromises(), OtherNumbers()
        self._silent, self._clocks = ToldSilent(), ToldTimes(timing)
        self._newest: tuple[tuple[int, Event | None], ...] = ()  # the newest two rows, their numbers before them

    def see(self, no: int, event: Event, header: Header | None, placement: Placement | None = None) -> None:
        """Take the next row: event, its header and placement (None for noise)."""
        self._observer.see(no, event, header)
        self._content.see(no, event, header)
        self._instances.see(no, event, header)
        self._routers.see(no, event, header)
        self._lengths.see(no, event, header)
        self._silent.see(no, event, header)
        self._clocks.see(no, event, header)
        self._newest = (*self._newest[-1:], (no, event))

    def settle(self, transaction: Transaction) -> None:
        """Take a transaction that closed; the ring model has its own view of them, but for error answers."""
        station, verdict = transaction.station, transaction.verdict
        if station is not None and transaction.error == Ending.NEVER_ANSWERED:
            self._promises.add(station, transaction)
        if verdict in _OF_NO_REQUEST and len(self._newest) == 2 and transaction.response == self._newest[1][0]:
            (_, before), (_, answer) = self._newest
            self._numbers.add(transaction, before, answer)
        if station is None or transaction.is_passing or verdict not in _ANSWERED:
            return
        self._refusals.answer(station, transaction.kind)
        if verdict is Verdict.EXCEPTION:
            self._refusals.refuse(station, transaction, self._request_of(transaction))

    def _request_of(self, transaction: Transaction) -> Event | None:
        """The request, where its answer came directly behind it."""
        if transaction.request is None or transaction.response != transaction.request + 1:
            return None
        return next((event for no, event in self._newest if no == transaction.request), None)

    def take(self, rows: RowColumns) -> None:
        """Take many rows, and the transactions that closed with them."""
        self._observer.take(rows)
        self._content.take(rows)
        self._instances.take(rows)
        self._routers.take(rows)
        self._lengths.take(rows)
        self._silent.take(rows)
        self._clocks.take(rows)
        self._settle_many(rows)

    def _settle_many(self, rows: RowColumns) -> None:
        import numpy as np

        from dissectors.columns import NONE, VERDICTS, counted

        closed = rows.transactions
        passing = [code for code, name in enumerate(closed.names) if name in PASSING]
        told = (closed.station != NONE) & ~np.isin(closed.kind, passing)
        told &= np.isin(closed.verdict, [VERDICTS.index(verdict) for verdict in _ANSWERED])
        kinds = list(counted(closed.station[told], closed.kind[told]))
        refused = closed.verdict == VERDICTS.index(Verdict.EXCEPTION)
        if Ending.NEVER_ANSWERED in closed.names:
            for place in np.flatnonzero(closed.error == closed.names.index(Ending.NEVER_ANSWERED)).tolist():
                self._promises.add(int(closed.station[place]), rows.transaction(place))
        self._settle_unasked(rows)
        full = len(self._refusals.asked) + len(kinds) > REFUSED_KEPT
        before = self._newest[-1:]
        for place in np.flatnonzero(told if full else told & refused).tolist():
            transaction = rows.transaction(place)
            at = NONE if transaction.request is None else transaction.request - rows.first
            self._newest = before if at < 0 else ((rows.first + at, rows.row(at).event),)
            self.settle(transaction)
        if not full:
            for (station, kind), count in counted(closed.station[told & ~refused], closed.kind[told & ~refused]):
                self._refusals.asked[station, closed.names[kind]] += count
        if len(rows):
            self._newest = ((rows.first + len(rows) - 1, rows.row(len(rows) - 1).event),)

    def _settle_unasked(self, rows: RowColumns) -> None:
        """Answers to nothing that is open, each closed by its own row."""
        import numpy as np

        from dissectors.columns import VERDICTS

        unasked = np.isin(rows.transactions.verdict, [VERDICTS.index(verdict) for verdict in _OF_NO_REQUEST])
        for place in np.flatnonzero(unasked).tolist():
            transaction, at = rows.transaction(place), int(rows.closed_by[place])
            if at < 0 or transaction.response != rows.first + at:
                continue
            before = rows.row(at - 1).event if at else self._newest[-1][1] if self._newest else None
            self._numbers.add(transaction, before, rows.row(at).event)

    def ring(self) -> Ring:
        """The ring so far."""
        return self._observer.ring()

    def window(self) -> MstpRingWindow:
        """What is new since this was called the last time; the first time is not told of."""
        return self._observer.window()

    def findings(self) -> tuple[Finding, ...]:
        """All findings so far, the gravest first."""
        ring = self._observer.ring()
        others = (*self._refusals.findings(), *self._content.findings(), *self._instances.findings(ring.nodes))
        others += (*self._routers.findings(), *self._promises.findings(ring), *self._lengths.findings())
        others += (*self._numbers.findings(ring), *self._clocks.findings())
        made = (*self._silent.told(judge(ring)), *others)
        return tuple(sorted(made, key=_gravest_first))
