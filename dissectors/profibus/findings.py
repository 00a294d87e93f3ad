"""The rules of PROFIBUS at work: what the watch notices and how exchanges end becomes findings. `rules.py` has them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

from dissectors import busiest
from dissectors.chances import is_silent_by_chance
from dissectors.findings import Finding, Severity, Tally, counted, times, together
from dissectors.frame import Event, Frame, Header, Role
from dissectors.last_silence import fallen_silent
from dissectors.line import NS_PER_S, Timing
from dissectors.profibus.blame import ONE_STATION, SentOctets
from dissectors.profibus.diagnosis_findings import codes_of, diagnosis_grave, diagnosis_seen, start_found
from dissectors.profibus.finding_words import answered_again, unheard_words, watchdog_words
from dissectors.profibus.record import RequestsRecord, joined
from dissectors.profibus.ring import MasterView, Ring, RingWindow
from dissectors.profibus.rules import RULES, usual_tsdr
from dissectors.profibus.slave_watch import SlaveView
from dissectors.profibus.telegram import SYN
from dissectors.profibus.watch import BusWatch, Notice
from dissectors.subject import BUS, Subject, station
from dissectors.tracker import Placement, Transaction, Verdict
from dissectors.words import duration, milliseconds, percent

_ALIKE_LEAST = 5
_BAD_KEPT = 64  # damaged telegrams whose exchange is not over
_LEAST = 3
_SHARE = 0.01
_SLOW_SHARE = 0.1
_MOSTLY = 0.5
_COMMON = 0.5
_URGENT_MOST = 20
_LEAST_FRESH = 2
"""Requests without answer, repeats at once aside, that are more than a look whether somebody is there."""

_ONE_SILENCE = NS_PER_S // 2
"""Slaves that leave within that time left in the same silence of their master."""

_TOLERANCE = 5
"""Bit times by which a measured answer time may be off."""


class ProfibusFindings:
    """The judge of one bus."""

    watches: type[BusWatch] = BusWatch

    def __init__(self, timing: Timing) -> None:
        self.watch = self.watches(timing, self._noticed)
        self._usual, self._tolerance = timing.line.bits(usual_tsdr(timing.line.baud)), timing.line.bits(_TOLERANCE)
        self._has_times = timing.has_times
        self._is_timed = timing.has_times and timing.latency < timing.line.bits(SYN)
        self._most: Callable[[int], int | None] | None = None
        self._limits: dict[int, int] = {}
        self.records: dict[int, RequestsRecord] = defaultdict(RequestsRecord)
        self._noted: dict[tuple[Notice, int], Tally] = defaultdict(Tally)
        self._diagnosed: dict[int, dict[str, Tally]] = defaultdict(lambda: defaultdict(Tally))
        self._silent: dict[int, int] = {}  # when a slave last left because that master was silent, ns
        self._damaged = Tally()
        self._bad: dict[int, Frame] = {}  # the newest of them by row
        self._frames = 0
        self.sent = SentOctets()
        self._passed: dict[int, int] = defaultdict(int)  # tokens to each master
        self._told: dict[int, int] = defaultdict(int)  # tokens and requests from each master

    def see(self, no: int, event: Event, header: Header | None, placement: Placement | None) -> None:
        """Take the next row."""
        if isinstance(event, Frame):
            self._frames += 1
            if header is None or header.role is not Role.TOKEN:
                self.sent.see(event, placement)
            if not event.ok:
                self._damaged.add(event.start, no)
                self._bad[no] = event
                if len(self._bad) > _BAD_KEPT:
                    del self._bad[next(iter(self._bad))]
            elif header is not None:
                self._count(header)
                if header.role is Role.REQUEST and header.destination is not None:
                    self.records[header.destination].ask(no, event.octets)
        self.watch.see(no, event, header)

    def count_rows(self, frames: int, passed: Mapping[int, int], told: Mapping[int, int]) -> None:
        """Count good telegrams; `passed`, `told`: tokens to, tokens and requests from each master."""
        self._frames += frames
        for address, count in passed.items():
            self._passed[address] += count
        for address, count in told.items():
            self._told[address] += count

    def _count(self, header: Header) -> None:
        is_token = header.role is Role.TOKEN
        if is_token and header.destination is not None:
            self._passed[header.destination] += 1
        if header.source is not None and header.role is not Role.RESPONSE:
            self._told[header.source] += 1

    def settle(self, transaction: Transaction) -> None:
        """Take a transaction that closed."""
        if transaction.station is not None and not transaction.is_passing:
            record = self.records[transaction.station]
            record.settle(transaction, self.slow_of(transaction.station))
            bad = self._bad.pop(transaction.response or 0, None)
            if bad is not None and transaction.verdict is Verdict.DAMAGED_ANSWER:
                record.see_damaged(transaction.response or 0, bad)

    def know_response_times(self, most: Callable[[int], int | None]) -> None:
        """Let a device's GSD say how long it may take, where there is one."""
        self._most = most

    def slow_of(self, address: int) -> int:
        """ns above which an answer of a station is slow."""
        limit = self._limits.get(address)
        if limit is None:
            said = None if self._most is None else self._most(address)
            limit = self._limits[address] = self._usual if said is None else said
        return limit + self._tolerance

    def ring(self) -> Ring:
        """The ring so far."""
        return self.watch.ring()

    def window(self) -> RingWindow:
        """What is new since this was called the last time; the first time is not told of."""
        return self.watch.window()

    def findings(self) -> tuple[Finding, ...]:
        """All findings so far."""
        return tuple(self._all())

    def _noticed(self, what: Notice, address: int, no: int, time: int) -> None:
        if what is Notice.DIAGNOSIS:
            for code in codes_of(self.watch.slaves[address]):
                self._diagnosed[address][code].add(time, no)
        elif what is Notice.LOCKED:
            self._diagnosed[address]["PB011"].add(time, no)
        elif what is not Notice.MASTER_SILENT or time - self._silent.get(address, time - _ONE_SILENCE) >= _ONE_SILENCE:
            self._noted[what, address].add(time, no)
        if what is Notice.MASTER_SILENT:
            self._silent[address] = time

    def _all(self) -> Iterator[Finding]:
        for address in sorted(self.records):
            yield from self._of_exchanges(station(address), self.records[address])
        yield from self._of_repeats()
        for address in sorted(self.watch.slaves):
            yield from self._of_diagnosis(address, self.watch.slaves[address])
        yield from self._of_alike()
        yield from self._of_damage()
        yield from self._of_masters()

    @property
    def _span(self) -> int:
        ring = self.watch.ring()
        return max(0, ring.last - ring.first)

    def _of_exchanges(self, who: Subject, record: RequestsRecord) -> Iterator[Finding]:
        silent, total = record.unanswered, record.requests
        if not record.answers and silent.count + record.rubbish.count >= _LEAST:
            yield self._of_silence(who, record)
        elif silent.count and record.answers:
            grave = _grave(record.silent, total, silent, self._span)
            seen = f"{silent.count} of {total} requests without answer"
            seen += busiest.words(silent.quarters, silent.count, total, self._span) + unheard_words(record)
            finding = silent.found(RULES["PB002"], who, seen, grave)
            finding = answered_again(finding, record, self._is_timed) if record.answers_repeats else finding
            yield fallen_silent(finding, record.silence, self.watch.ring().last)
        if record.twice.count:
            often = record.twice.count >= _LEAST and record.twice.count >= _SHARE * total
            grave = Severity.ERROR if often else Severity.NOTE
            seen = f"a second, different answer came {times(record.twice.count)}"
            yield record.twice.found(RULES["PB010"], who, seen, grave)
        if record.refused.count:
            seen = f"{record.refused.count} of {total} requests refused: {'; '.join(sorted(record.refusals)[:4])}"
            starved = self._excused(who.station or 0)
            grave = _grave(max(0, record.put_off - starved), record.exchanged)
            yield record.refused.found(RULES["PB017"], who, seen, grave)
        if record.slow.count >= _LEAST and record.slow.count >= _SLOW_SHARE * total:
            slowest = milliseconds(record.slowest)
            limit = self._limits.get(who.station or 0, self._usual)
            allowed = "usual" if limit == self._usual else f"its GSD allows ({milliseconds(limit)})"
            seen = f"{record.slow.count} of {total} answers later than {allowed}; the slowest after {slowest}"
            yield record.slow.found(RULES["PB018"], who, seen)

    def _of_silence(self, who: Subject, record: RequestsRecord) -> Finding:
        """A station of which no telegram was ever heard."""
        silent, rubbish = together((record.unanswered, record.rubbish)), record.rubbish.count
        is_there = record.fresh >= _LEAST_FRESH and silent.count - record.unheard > record.unheard
        grave = Severity.ERROR if is_there else Severity.NOTE
        seen = f"no answer to any of {counted(record.requests, 'request')}{unheard_words(record)}"
        there = [one for one in self.records.values() if one.answers]
        failed, of = sum(one.silent + one.damaged.count for one in there), sum(one.requests for one in there)
        if is_silent_by_chance(record.requests, failed, of, len(there) + 1):
            grave = Severity.NOTE
            seen += f"; {failed} of {of} to the others have no good one either"
        if not rubbish:
            return silent.found(RULES["PB001"], who, seen, grave)
        seen += f"; to {rubbish} of them came octets that are no telegram"
        finding = silent.found(RULES["PB001"], who, seen, grave)
        of_all = sum(one.rubbish.count for one in self.records.values())
        if rubbish < max(_LEAST, _MOSTLY * record.requests, _MOSTLY * of_all):
            return finding
        return replace(
            finding,
            means="something answers at this address: two stations that have it and speak at once, or one with another "
            "baud rate or parity",
            next="take off one of the stations that may have this address; the settings of the one that is left",
        )

    def _excused(self, address: int) -> int:
        """How often a slave left data exchange, and that need not be its own fault: it must refuse data then."""
        whose = (Notice.STARVED,) if self._has_times else (Notice.STARVED, Notice.DROP)
        return sum(self._noted[what, address].count for what in whose if (what, address) in self._noted)

    def _of_repeats(self) -> Iterator[Finding]:
        """Repeats of what was answered well here: of one station's requests, or of the bus where most stations' are."""
        known = {address: one for address, one in self.records.items() if one.answers >= _LEAST}
        told, span = {address: one for address, one in known.items() if one.repeated.count}, self._span
        graves = {at: _grave(one.repeated.count, one.requests, one.repeated, span) for at, one in told.items()}
        grave = [one for one in graves.values() if one >= Severity.WARNING]
        if len(grave) > 1 and len(grave) >= _COMMON * len(known):
            together = joined([one.repeated for one in told.values()])
            total = sum(one.requests for one in known.values())
            seen = f"{together.count} of {total} requests are sent again, to {len(told)} stations that had answered"
            yield together.found(RULES["PB003"], BUS, seen, Severity.WARNING)
            return
        for address, one in sorted(told.items()):
            seen = f"{one.repeated.count} of {one.requests} requests are sent again although they were answered here"
            seen += busiest.words(one.repeated.quarters, one.repeated.count, one.requests, span)
            yield one.repeated.found(RULES["PB003"], station(address), seen, graves[address])

    def _of_diagnosis(self, address: int, slave: SlaveView) -> Iterator[Finding]:
        who, told, tallies = station(address), slave.told, self._diagnosed.get(address, {})
        words = "" if told is None else "; ".join((*told.status_words, *told.block_words))
        for code, tally in sorted(tallies.items()):
            yield tally.found(RULES[code], who, diagnosis_seen(code, slave, words), diagnosis_grave(code, slave))
        if (unstarted := start_found(who, slave, words)) is not None:
            yield unstarted
        fallen = self._noted.get((Notice.DROP, address))
        if fallen is not None:
            grave = Severity.ERROR if fallen.count >= _LEAST else Severity.WARNING
            seen = f"left data exchange {times(fallen.count)}{watchdog_words(slave)}"
            if not self._has_times:
                grave = Severity.NOTE
                seen += "; whether its master was silent before, a log without times does not tell"
            yield fallen.found(RULES["PB007"], who, seen, grave)
        starved = self._noted.get((Notice.STARVED, address))
        if starved is not None and fallen is None:
            seen = (
                f"left data exchange {times(starved.count)}, when its master had been silent for longer than its "
                "watchdog, or octets were damaged"
            )
            yield starved.found(RULES["PB007"], who, seen, Severity.NOTE)
        if slave.urgent >= _URGENT_MOST and "PB009" not in tallies:
            time, _ = slave.changes[-1] if slave.changes else (0, None)
            tally = Tally()
            tally.add(time)
            seen = f"a diagnosis is announced by {slave.urgent} answers in a row, and not fetched"
            yield tally.found(RULES["PB009"], who, seen)

    def _of_alike(self) -> Iterator[Finding]:
        """Answers of a slave that are always damaged in the same way."""
        for address, one in sorted(self.records.items()):
            damaged, answers = one.damaged.count, counted(one.requests, "answer")
            habit = one.checks.habit(damaged, one.answers - damaged) or one.checks.same(damaged)
            flaw, tally = max(one.flaws.items(), key=lambda item: item[1].count, default=(None, Tally()))
            if habit is not None:
                seen = f"{habit.count} of {answers} {habit.told('sum')}"
                finding = habit.tally.found(RULES["PB020"], station(address), seen)
                yield replace(finding, means=habit.mistake.means or finding.means)
            elif flaw is not None and tally.count >= _ALIKE_LEAST and 4 * tally.count >= 3 * damaged:
                seen = f"{tally.count} of {answers} good but for one thing: {flaw.value}"
                yield tally.found(RULES["PB020"], station(address), seen)

    def _of_damage(self) -> Iterator[Finding]:
        damaged = self._damaged
        if not damaged.count:
            return
        answers = {address: one.damaged for address, one in self.records.items() if one.damaged.count}
        total = sum(tally.count for tally in answers.values())
        worst = max(answers, key=lambda address: answers[address].count, default=None)
        others = any(one.answers >= _LEAST for address, one in self.records.items() if address != worst)
        checked = self._frames - sum(self._passed.values())
        is_one = (
            worst is not None
            and others
            and answers[worst].count >= max(_LEAST, ONE_STATION * total)
            and self.sent.is_its_own(worst, answers[worst].count, damaged.count)
        )
        if is_one and worst is not None:
            asked = self.records[worst].requests
            seen = f"{answers[worst].count} of {asked} answers damaged"
            others_damaged = damaged.count - answers[worst].count
            seen += f", and {counted(others_damaged, 'other telegram')} on the bus" if others_damaged > 0 else ""
            seen += busiest.words(answers[worst].quarters, answers[worst].count, asked, self._span)
            grave = _grave(answers[worst].count, asked, answers[worst], self._span)
            yield answers[worst].found(RULES["PB008"], station(worst), seen, grave)
        else:
            seen = f"{damaged.count} of {checked} telegrams (tokens aside) damaged"
            yield damaged.found(RULES["PB008"], BUS, seen, _grave(damaged.count, checked, damaged, self._span))

    def _of_masters(self) -> Iterator[Finding]:
        for (what, address), tally in sorted(self._noted.items(), key=lambda one: (one[0][0].value, one[0][1])):
            if what is Notice.CLAIM:
                seen = f"station {address} made a token of its own {times(tally.count)}"
                yield tally.found(RULES["PB013"], BUS, seen + self._held_seen() + self._woken_seen())
            elif what is Notice.TOKEN_AGAIN:
                seen = f"the token to it was sent again {times(tally.count)}"
                seen += busiest.words(tally.quarters, tally.count, self._passed[address], self._span)
                grave = _grave(tally.count, self._passed[address], tally, self._span)
                if not self._told[address]:
                    seen, grave = f"{seen}; nothing that it sends was heard by this tap", Severity.NOTE
                yield tally.found(RULES["PB014"], station(address), seen, grave)
            elif what is Notice.OUT_OF_TURN and tally.count >= _LEAST:
                seen = f"station {address} sent {times(tally.count)} while another master held the token"
                often = tally.count >= _SHARE * self._told[address]
                yield tally.found(RULES["PB015"], BUS, seen, Severity.ERROR if often else Severity.NOTE)
            elif what is Notice.MASTER_SILENT:
                seen = f"{times(tally.count)} it asked nothing for longer than its slaves' watchdog; they left then"
                silent = tally.found(RULES["PB019"], station(address), seen, None if tally.count > 1 else Severity.NOTE)
                yield replace(silent, stations=(address, *self._starved(tally.count)))
            elif what is Notice.CLEAR:
                yield tally.found(RULES["PB012"], station(address), self._clear_seen(address))
            elif what is Notice.CLEAR_PERHAPS and (Notice.CLEAR, address) not in self._noted:
                seen = f"{self._clear_seen(address)}; octets were damaged since, its end may not have been heard"
                yield tally.found(RULES["PB012"], station(address), seen, Severity.NOTE)
        yield from self._of_kept()
        ring = self.watch.ring()
        for address, view in sorted(ring.masters.items()):
            if view.polls > view.answered:
                tally = Tally(view.polls - view.answered, ring.first, ring.last)
                seen = f"{tally.count} of {view.polls} polls found nobody"
                if ring.wasted_share is not None:
                    seen += f"; all masters' take {percent(ring.wasted_share)} of the time"
                yield _of_polls(tally, address, seen, view)

    def _of_kept(self) -> Iterator[Finding]:
        kept, ring = self.watch.kept(), self.watch.ring()
        if kept is None:
            return
        tally = Tally()
        tally.add(ring.last - kept.time)
        tally.add(ring.last)
        waits = f"{'station' if len(kept.others) == 1 else 'stations'} {', '.join(map(str, kept.others))}"
        seen = (
            f"asks on for {duration(kept.time)} and does not pass the token to {waits}, up to the end; before, a round "
        )
        finding = tally.found(RULES["PB021"], station(kept.master), f"{seen}took up to {duration(kept.usual)}")
        yield replace(finding, count=1)

    def _starved(self, most: int) -> tuple[int, ...]:
        """Slaves that left data exchange `most` times at most, and never without somebody else's doing."""
        often = {address: tally.count for (what, address), tally in self._noted.items() if what is Notice.STARVED}
        dropped = {address for what, address in self._noted if what is Notice.DROP}
        return tuple(sorted(address for address, count in often.items() if count <= most and address not in dropped))

    def _held_seen(self) -> str:
        """Who had the tokens that were lost, where it was one and the same again and again."""
        held = self.watch.claimed_from
        if len(held) != 1 or held.total() < _LEAST:
            return ""
        return f"; station {next(iter(held))} had the token each time"

    def _woken_seen(self) -> str:
        woken = sorted(address for (what, address) in self._noted if what is Notice.WOKE)
        if not woken:
            return ""
        who = f"station{'s' * (len(woken) > 1)} {', '.join(map(str, woken))}"
        return f"; {who} had been silent with the token, and went on as if nothing had been"

    def _clear_seen(self, address: int) -> str:
        return f"outputs are cleared for {self.watch.longest_clear(address) / NS_PER_S:.0f} s of data exchange"


def _grave(count: int, total: int, when: Tally | None = None, span: int = 0) -> Severity:
    """How grave it is that `count` of `total` are wrong: noted below one in a hundred, and in each quarter of an hour
    of `span` ns, where it is known when they came."""
    many = count >= _LEAST and count >= _SHARE * total
    is_fault = when is not None and busiest.is_fault(when.quarters, total, span)
    return Severity.WARNING if many or is_fault else Severity.NOTE


def _of_polls(tally: Tally, address: int, seen: str, view: MasterView) -> Finding:
    """Polls that found nobody; who passes no token looks for its slaves with them."""
    if view.tokens or view.polls < _LEAST:
        return tally.found(RULES["PB016"], station(address), seen)
    grave = None if view.answered else Severity.NOTE
    return replace(
        tally.found(RULES["PB016"], station(address), f"{seen}; it passes no token", grave),
        means="a master that asks so whether its slaves are there, before it gives them parameters",
        next="the supply, address switch and baud rate of the slaves that do not answer",
    )
