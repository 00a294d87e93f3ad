"""The observer of an N2 bus: gathers row by row what is wrong. The words are in `wording.py`.

`see` takes every row of the bus, `settle` every transaction that closed; `findings` may be asked at any time and
gives the same for the same rows. A limit is judged by the bound that the adapter's latency leaves: a station is slow
when even the smallest reading is over the limit. Nothing is judged that the notes on the protocol mark as a guess:
no status bits, no change-of-state records.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable

from dissectors.findings import Finding, Tally
from dissectors.frame import Damage, Event, Frame, Header, Noise
from dissectors.late_speakers import PATIENCE, Due, LateSpeakers, reaching
from dissectors.line import NS_PER_S, Timing
from dissectors.n2.clocked import Clocked
from dissectors.n2.commands import parse_command
from dissectors.n2.envelope import check_off
from dissectors.n2.header import meant
from dissectors.n2.late import of_late_speakers
from dissectors.n2.masters import HASTE, Masters, OpenCommand
from dissectors.n2.misfits import asked_for
from dissectors.n2.objects import region_name
from dissectors.n2.record import Damages, N2StationRecord, Override
from dissectors.n2.torn import TornFrames
from dissectors.n2.unheard import Patience
from dissectors.n2.wording import SLOW, N2Evidence, worded
from dissectors.strikes import Strikes
from dissectors.tracker import Placement, Transaction, Verdict

__all__ = ["SLOW", "N2Findings"]

RESET_WITHIN = 60 * NS_PER_S
"""A station that answers N00 so soon after a warm reset has made the one that it was told to."""

ANSWERS_KEPT = 8
"""Answers remembered, to tell a repeat from a second one."""

_IN_TURN = frozenset((Verdict.ANSWERED, Verdict.RETRY, Verdict.EXCEPTION, Verdict.BROADCAST))
"""Behind these no answer is overdue."""

_NOT_JUDGED = frozenset((Verdict.ECHO, Verdict.OPEN, Verdict.DAMAGED_REQUEST, Verdict.BROADCAST))


def refusal_code(octets: bytes) -> str:
    """The code of a refusal, as the rules know it."""
    return octets[1:3].decode("latin-1").upper()


class N2Findings:
    """Fed row by row and transaction by transaction; gives findings at any time."""

    def __init__(self, timing: Timing) -> None:
        self._timing = timing
        self.first: int | None = None
        self.now = 0
        self._unheard = 0  # ns before it
        self.stations: dict[int, N2StationRecord] = {}
        self.master = Damages()
        self._asked: dict[int, OpenCommand] = {}  # by transaction
        self.masters = Masters(timing.char)
        self.patience = Patience(has_times=timing.has_times)
        self.clocked = Clocked()
        self.torn = TornFrames(timing)
        self.strikes = Strikes()
        self.late_speakers = LateSpeakers()
        self.newest = 0  # ns, the start of the newest row
        self._stray = Tally()
        self._codes: dict[int, str] = {}  # transaction → error code, of refusals that are still to close
        self._answers: OrderedDict[int, bytes] = OrderedDict()  # transaction → its good answer
        self._bad: int | None = None  # the newest damaged answer
        self.turn: int | None = None  # whom the newest command was for
        self.turned = 0  # when that was, ns
        self.left: tuple[int, int] | None = None  # whom the newest command to another one was for, and when
        self.is_overdue = False  # an answer may still come, to what closed last
        self._ignores: Callable[[int, str, str], bool] | None = None

    def know_unexecuted(self, ignores: Callable[[int, str, str], bool]) -> None:
        """See `dissectors.findings.KnowsUnexecuted`: what a device does not do changes no override."""
        self._ignores = ignores

    def see(self, no: int, event: Event, header: Header | None, placement: Placement | None) -> None:
        """Take the next row: event, its header and placement (None for noise)."""
        if not event.octets and self.first is not None:  # nobody heard what was before it
            self._unheard += max(0, event.start - self.now)
            for station in self.stations.values():
                station.overrides.clear()  # they may have been released
        self.first = event.start if self.first is None else self.first
        self.now = max(self.now, event.end)
        self.newest = event.start
        self.torn.see(no, event, placement.tx if placement else None, is_good_frame=header is not None and header.ok)
        if isinstance(event, Noise) or header is None or placement is None:
            if not event.octets or event.octets.strip(b"\r\n"):
                self.masters.see_other()  # may have been an answer
        elif meant(event)[:1] == b">":
            self._see_command(no, event, header, placement)
        else:
            self._see_answer(no, event, header, placement)

    def _see_command(self, no: int, event: Frame, header: Header, placement: Placement) -> None:
        asked = OpenCommand(no, event, parse_command(meant(event)))
        self.clocked.see_command(event.start)
        before, last = self.masters.last_station, self.masters.newest
        self.masters.see_command(asked, self.stations.get(before) if before is not None else None)
        self._asked[placement.tx] = asked
        self.master.frames += 1
        self.master.octets += len(event.octets)
        if header.ok:
            if placement.destination is not None and placement.destination != self.turn:
                self.station(placement.destination).turns += 1
            self.take_turn(placement.destination, event.start)
        elif last is not None and meant(event) == meant(last.frame) and event.start - last.frame.end < HASTE:
            pass  # an echo that was cut short, and says nothing of who was echoed
        elif event.damage is not Damage.RESTARTED or event.repair is not None:
            counts = self._add_bad("master", self.master, no, event)
            gave_up = last is not None and event.start - last.frame.end >= HASTE
            if counts and last is not None and event.repair is None:
                self.masters.see_damaged(last, no, event)
            if counts and gave_up and before in self.stations and event.repair is None:
                self.stations[before].behind.add(event.start, no)

    def take_turn(self, station: int | None, start: int) -> None:
        """A command to a station began at `start`."""
        if self.turn is not None and station != self.turn:
            self.left = self.turn, self.turned
        self.turn, self.turned = station, start

    def _see_answer(self, no: int, event: Frame, header: Header, placement: Placement) -> None:
        self.masters.see_other()
        octets = event.octets
        if header.ok:
            self.strikes.whole()
            if octets[:1] == b"N":
                self._codes[placement.tx] = refusal_code(octets)
            self.keep_answer(placement.tx, octets)
        else:
            self._bad = no
        if placement.source is None:
            return
        sent = self.station(placement.source).sent
        sent.frames += 1
        sent.octets += len(octets)
        if not header.ok:
            self._add_bad(f"station {placement.source}", sent, no, event)

    def _add_bad(self, name: str, sender: Damages, no: int, event: Frame) -> bool:
        """Count a damaged frame, where it is whole; whether it was."""
        if self.torn.is_late(event) or self.torn.completes(no):
            return False  # its begin was read before, or may have been
        self.strikes.struck(name)
        sender.add_bad(event.end, no, event.repair.flaw if event.repair is not None else check_off(event.octets))
        self.torn.struck(sender)
        return True

    def keep_answer(self, transaction: int, octets: bytes) -> None:
        """Remember a good answer for a while."""
        self._answers[transaction] = octets
        if len(self._answers) > ANSWERS_KEPT:
            self._answers.popitem(last=False)

    def settle(self, transaction: Transaction) -> None:
        """Take a transaction that closed."""
        asked = self._asked.pop(transaction.id, None)
        code = self._codes.pop(transaction.id, "")
        verdict = transaction.verdict
        was_overdue, self.is_overdue = self.is_overdue, verdict not in _IN_TURN
        if verdict is Verdict.UNSOLICITED:
            if transaction.response == self._bad:
                self.late_speakers.noise(transaction.start, transaction.response)
            elif not self.torn.may_answer(transaction.response):
                self._stray.add(transaction.start, transaction.response)
            return
        if verdict is Verdict.DAMAGED_REQUEST:
            self.late_speakers.damaged_request(b"", transaction.start, transaction.request)
        if transaction.station is None or verdict in _NOT_JUDGED:
            return
        station = self.station(transaction.station)
        if verdict is Verdict.ANSWERED_TWICE:
            response = transaction.response
            if self.torn.is_torn(transaction.of, response) or self.torn.may_answer(response):
                return  # to what was torn, perhaps
            same = self._answers.get(transaction.id) == self._answers.get(transaction.of or 0)
            tally = station.repeated if same else station.twice
            if not same and self.left is not None and transaction.start - self.left[1] <= PATIENCE:
                tally = station.beside.setdefault(self.left[0], Tally())
            tally.add(transaction.start, transaction.response)
        elif verdict is Verdict.LATE:
            if self.torn.may_answer(transaction.response):
                return  # the command that it answers was torn
            station.late.add(transaction.start, transaction.response)
            station.silence.heard()
            station.missing.take_back(transaction.of)
            station.unheard.take_back(transaction.of)
            self.masters.see_late(transaction, station)
        elif asked is not None:
            self._settle_asked(station, asked, code, transaction)
            if verdict in (Verdict.ANSWERED, Verdict.RETRY) and asked.frame.ok and not was_overdue:
                self._see_fit(station, asked, transaction)

    def _see_fit(self, station: N2StationRecord, asked: OpenCommand, transaction: Transaction) -> None:
        read, answer = asked_for(asked.frame.octets), self._answers.get(transaction.id)
        if read is not None and answer is not None:
            station.misfits.see(read, len(answer), transaction.end, (transaction.request, transaction.response))

    def _settle_asked(self, station: N2StationRecord, asked: OpenCommand, code: str, transaction: Transaction) -> None:
        station.asked += 1
        station.only_identify &= asked.command.type.kind == "identify"
        verdict = transaction.verdict
        if verdict is not Verdict.NO_RESPONSE:
            station.silence.heard()
        if transaction.response is None:
            if verdict is Verdict.NO_RESPONSE:
                if self.torn.is_answered(transaction.request):
                    station.silence.heard()
                    return
                station.silence.miss(transaction.start, transaction.request, is_repeat=transaction.attempt > 1)
                if self.patience.tells(asked, transaction.attempt, self.masters.newest):
                    station.unheard.add(transaction.id, transaction.end, transaction.request)
                    return
                self.unanswered(transaction.station or 0, transaction.start, transaction.end, self.newest)
                station.missing.add(transaction.id, transaction.end, transaction.request)
            elif verdict is Verdict.DAMAGED_ANSWER and not self.torn.is_torn(transaction.id, transaction.request):
                self.strikes.struck(f"station {transaction.station}")
                self._see_hit(transaction)
                station.sent.frames += 1  # in pieces
                station.sent.add_bad(transaction.end, transaction.request)
                self.torn.struck(station.sent)
            return
        if verdict is Verdict.DAMAGED_ANSWER:
            self._see_hit(transaction)
        elif not asked.frame.ok:  # understood all the same, or refused for it
            self.late_speakers.damaged_request(b"", transaction.start, transaction.request)
        else:
            self.clocked.answered(asked.frame.start, asked.frame.end, transaction.end)
            self.late_speakers.answered(transaction.station or 0, f"station {transaction.station}", transaction.start)
        station.answered += 1
        self._judge_latency(station, transaction)
        if verdict is Verdict.EXCEPTION:
            self.refused(station, asked, code, transaction)
        elif verdict in (Verdict.ANSWERED, Verdict.RETRY):
            self.obeyed(station, asked, transaction)

    def unanswered(self, station: int, start: int, end: int, after: int) -> None:
        """A command that nothing followed until `after`; ns. Who did not wait for it cannot have been spoken into."""
        if after - end < HASTE:
            return
        self.late_speakers.unanswered(station, Due(), start, end, after - end)

    def _see_hit(self, transaction: Transaction) -> None:
        station, rows = transaction.station or 0, (transaction.request, transaction.response)
        name = f"station {station}"
        self.late_speakers.damaged_answer(station, name, b"", transaction.start, *rows, is_longer=False)

    def findings(self) -> tuple[Finding, ...]:
        """All findings so far: the bus first, then station by station."""
        span = self.now - (self.first or 0) - self._unheard
        masters, clocked = self.masters, self.clocked.rhythm.is_by_the_clock
        soon = Tally() if clocked else masters.sooner_than(self.clocked.short_pause)
        heard = N2Evidence(
            self.now, span, self.master, self.stations, masters, soon, self._stray, self.strikes, clocked
        )
        found = (reaching(one, self.late_speakers) if one.code == "N2011" else one for one in worded(heard))
        return (*found, *of_late_speakers(heard, self.late_speakers))

    # --- judging ---

    def station(self, address: int) -> N2StationRecord:
        """What is known of a station."""
        station = self.stations.get(address)
        if station is None:
            station = self.stations[address] = N2StationRecord()
        return station

    def _judge_latency(self, station: N2StationRecord, transaction: Transaction) -> None:
        latency = transaction.latency
        if latency is None or transaction.verdict is Verdict.DAMAGED_ANSWER:
            return
        station.quickest = latency.low if station.quickest is None else min(station.quickest, latency.low)
        if latency.low > SLOW:
            station.slow.add(transaction.end, transaction.response)
            station.slowest = max(station.slowest, latency.low)

    def refused(self, station: N2StationRecord, asked: OpenCommand, code: str, transaction: Transaction) -> None:
        """A command that was refused, with this code."""
        command, time = asked.command, transaction.end
        if code == "00":
            if not station.waits:
                told = station.told_to_reset
                is_told = told is not None and time - told < RESET_WITHIN
                (station.resets_told if is_told else station.resets).add(time, transaction.response)
                station.told_to_reset = None
                station.waits = True
            station.refused_while_reset += 1
            station.overrides.clear()
        elif code in ("11", "0B") and command.region is not None and command.object is not None:
            point = (command.region, command.object, command.attribute)
            station.points.setdefault(point, Tally()).add(time, transaction.request, transaction.response)
        else:
            refused = station.refused.setdefault((code, command.type.title), Tally())
            refused.add(time, transaction.request, transaction.response)

    def obeyed(self, station: N2StationRecord, asked: OpenCommand, transaction: Transaction) -> None:
        """A command that was obeyed."""
        command = asked.command
        kind = command.type.kind
        if kind == "identify":
            if station.identified and not station.waits:
                station.again.add(transaction.end, transaction.request)
            station.identified, station.waits = True, False
        elif kind == "warm-reset":
            station.overrides.clear()
            station.identified, station.told_to_reset = False, transaction.end
        elif command.region is None or command.object is None or self._is_ignored(transaction, kind, command.region):
            return
        elif kind == "override":
            point = (command.region, command.object)
            station.overrides[point] = Override(asked.row, transaction.end, command.value)
        elif kind == "release-override":
            station.overrides.pop((command.region, command.object), None)

    def _is_ignored(self, transaction: Transaction, kind: str, region: int) -> bool:
        return self._ignores is not None and self._ignores(transaction.station or 0, kind, region_name(region))
