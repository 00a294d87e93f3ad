"""What is wrong on an N2 bus, in words: the rules, and the class that finds them row by row.

`see` takes every row of the bus, `settle` every transaction that closed; `findings` may be asked at any time and
gives the same for the same rows. A limit is judged by the bound that the adapter's latency leaves: a station is slow
when even the smallest reading is over the limit. Nothing is judged that the notes on the protocol mark as a guess:
no status bits, no change-of-state records.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from dissectors.findings import EVIDENCE_MAX, Finding, Severity, counted, found, times
from dissectors.frame import Damage, Event, Frame, Header, Noise
from dissectors.line import NS_PER_S, Timing
from dissectors.n2.commands import Command, error_name, parse_command
from dissectors.n2.header import BROADCAST
from dissectors.n2.objects import attribute_name, number, object_name
from dissectors.n2.rules import RULES
from dissectors.tracker import Placement, Transaction, Verdict

MS = 1_000_000
SLOW = 250 * MS
"""Shortest message timeout that an NAE can be given, ns (JCI help, N2 trunk)."""

OVERRIDE_AGE = 600 * NS_PER_S
"""After 10 minutes an override should have been renewed or released; the F510's do not expire (its manual, 1.2.2)."""

HASTE = 100 * MS
"""No master gives up sooner; a command that comes sooner is of another one, or its answer was not heard."""

_SAME = 6  # octets of two commands: start, address, command and what it asks


@dataclass(slots=True)
class _Tally:
    """How often, when and where one thing was seen."""

    count: int = 0
    first: int = 0
    last: int = 0
    evidence: list[int] = field(default_factory=list)

    def add(self, time: int, *rows: int | None) -> None:
        if not self.count:
            self.first = time
        self.count += 1
        self.last = max(self.last, time)
        if len(self.evidence) < EVIDENCE_MAX:
            self.evidence.extend(row for row in rows if row is not None)


@dataclass(slots=True)
class _Station:
    """What is known of one station."""

    asked: int = 0
    answered: int = 0
    identified: bool = False
    waits: bool = False  # it answered N00 and was not identified since
    damaged_answers: int = 0
    damaged_commands: int = 0
    slowest: int = 0
    resets: _Tally = field(default_factory=_Tally)
    refused_while_reset: int = 0
    slow: _Tally = field(default_factory=_Tally)
    damaged: _Tally = field(default_factory=_Tally)
    missing: _Tally = field(default_factory=_Tally)
    again: _Tally = field(default_factory=_Tally)
    twice: _Tally = field(default_factory=_Tally)
    late: _Tally = field(default_factory=_Tally)
    points: dict[tuple[int, int, int | None], _Tally] = field(default_factory=dict)
    refused: dict[tuple[str, str], _Tally] = field(default_factory=dict)
    overrides: dict[tuple[int, int], _Override] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class _Override:
    row: int
    time: int
    value: float | None


@dataclass(frozen=True, slots=True)
class _Asked:
    """The command of an open transaction."""

    row: int
    frame: Frame
    command: Command


class N2Findings:
    """Fed row by row and transaction by transaction; gives findings at any time."""

    def __init__(self, timing: Timing) -> None:
        self._timing = timing
        self._first: int | None = None
        self._now = 0
        self._stations: dict[int, _Station] = {}
        self._asked: dict[int, _Asked] = {}  # by transaction
        self._masters = _Tally()
        self._stray = _Tally()
        self._last: _Asked | None = None  # the newest command, while nothing has come after it
        self._codes: dict[int, str] = {}  # row → error code, of answers whose transaction is still to close

    def see(self, no: int, event: Event, header: Header | None, placement: Placement | None) -> None:
        """Take the next row: event, its header and placement (None for noise)."""
        self._first = event.start if self._first is None else self._first
        self._now = max(self._now, event.end)
        if isinstance(event, Noise) or header is None or placement is None:
            if len(event.octets.strip(b"\r\n")):
                self._last = None  # may have been an answer
            return
        if event.octets[:1] != b">":
            self._last = None
            if event.octets[:1] == b"N" and event.damage is None:
                self._codes[placement.tx] = event.octets[1:3].decode("latin-1").upper()
            if not header.ok and placement.source is not None:
                station = self._station(placement.source)
                station.damaged_answers += 1
                station.damaged.add(event.end, no)
            return
        asked = _Asked(no, event, parse_command(event.octets))
        self._judge_masters(asked)
        self._last = asked
        self._asked[placement.tx] = asked
        if placement.destination is not None and not header.ok and event.damage is not Damage.RESTARTED:
            known = self._stations.get(placement.destination)
            if known is not None:  # a damaged address is not a new station
                known.damaged_commands += 1
                known.damaged.add(event.end, no)

    def settle(self, transaction: Transaction) -> None:
        """Take a transaction that closed."""
        asked = self._asked.pop(transaction.id, None)
        code = self._codes.pop(transaction.id, "")
        verdict = transaction.verdict
        if verdict is Verdict.UNSOLICITED:
            self._stray.add(transaction.start, transaction.response)
        if transaction.station is None or verdict in (Verdict.UNSOLICITED, Verdict.ECHO, Verdict.OPEN):
            return
        if verdict in (Verdict.DAMAGED_REQUEST, Verdict.BROADCAST):
            return
        station = self._station(transaction.station)
        if verdict is Verdict.ANSWERED_TWICE:
            station.twice.add(transaction.start, transaction.response)
            return
        if verdict is Verdict.LATE:
            station.late.add(transaction.start, transaction.response)
            return
        if asked is None:
            return
        station.asked += 1
        if transaction.response is None:
            if verdict is Verdict.NO_RESPONSE:
                station.missing.add(transaction.end, transaction.request)
            elif verdict is Verdict.DAMAGED_ANSWER:
                station.damaged_answers += 1
                station.damaged.add(transaction.end, transaction.request)
            return
        station.answered += 1
        self._judge_latency(station, transaction)
        if verdict is Verdict.EXCEPTION:
            self._refused(station, asked, code, transaction)
        elif verdict in (Verdict.ANSWERED, Verdict.RETRY):
            self._obeyed(station, asked, transaction)

    def findings(self) -> tuple[Finding, ...]:
        """All findings so far: the bus first, then station by station."""
        bus = []
        if self._masters.count >= 2:
            seen = f"{self._masters.count} commands broke into another one or came too soon after it"
            bus.append(_found("N2007", "bus", seen, self._masters))
        if self._stray.count:
            bus.append(_found("N2011", "bus", f"{counted(self._stray.count, 'answer')} came unasked", self._stray))
        for address in sorted(self._stations):
            bus.extend(self._of_station(f"station {address}", self._stations[address]))
        return tuple(bus)

    # --- judging ---

    def _station(self, address: int) -> _Station:
        return self._stations.setdefault(address, _Station())

    def _judge_masters(self, asked: _Asked) -> None:
        """Whether this command came when its master should still have been waiting or sending."""
        last = self._last
        if last is None:
            return
        if last.frame.damage is Damage.RESTARTED and asked.frame.ok:  # one flipped bit makes a `6` a `>`
            self._masters.add(asked.frame.start, last.row, asked.row)
            return
        if not last.frame.ok or last.command.address == BROADCAST:
            return
        if last.frame.octets[:_SAME] == asked.frame.octets[:_SAME]:  # a repeat, or an echo that something ran into
            return
        longest = asked.frame.start - (last.frame.end - last.frame.slack)
        if longest < HASTE:
            self._masters.add(asked.frame.start, last.row, asked.row)

    def _judge_latency(self, station: _Station, transaction: Transaction) -> None:
        latency = transaction.latency
        if latency is not None and latency.low > SLOW:
            station.slow.add(transaction.end, transaction.response)
            station.slowest = max(station.slowest, latency.low)

    def _refused(self, station: _Station, asked: _Asked, code: str, transaction: Transaction) -> None:
        command, time = asked.command, transaction.end
        if code == "00":
            if not station.waits:
                station.resets.add(time, transaction.response)
                station.waits = True
            station.refused_while_reset += 1
            station.overrides.clear()
        elif code in ("11", "0B") and command.region is not None and command.object is not None:
            point = (command.region, command.object, command.attribute)
            station.points.setdefault(point, _Tally()).add(time, transaction.request, transaction.response)
        else:
            refused = station.refused.setdefault((code, command.type.title), _Tally())
            refused.add(time, transaction.request, transaction.response)

    def _obeyed(self, station: _Station, asked: _Asked, transaction: Transaction) -> None:
        command = asked.command
        kind = command.type.kind
        if kind == "identify":
            if station.identified and not station.waits:
                station.again.add(transaction.end, transaction.request)
            station.identified, station.waits = True, False
        elif kind == "warm-reset":
            station.overrides.clear()
            station.identified = False
        elif command.region is None or command.object is None:
            return
        elif kind == "override":
            point = (command.region, command.object)
            station.overrides[point] = _Override(asked.row, transaction.end, command.value)
        elif kind == "release-override":
            station.overrides.pop((command.region, command.object), None)

    # --- wording ---

    def _of_station(self, name: str, station: _Station) -> Iterable[Finding]:
        if station.resets.count:
            seen = f"answered N00 {times(station.refused_while_reset)}: {times(station.resets.count)} reset"
            yield _found("N2001", name, seen, station.resets)
        for (region, point, attribute), tally in sorted(station.points.items(), key=lambda item: str(item[0])):
            what = object_name(region, point)
            if attribute is not None:
                known = attribute_name(region, attribute)
                what += f" attribute {attribute}" + (f" ({known})" if known else "")
            yield _found("N2002", f"{name}, {object_name(region, point)}", f"{what}: N11 {times(tally.count)}", tally)
        if station.slow.count:
            seen = (
                f"{station.slow.count} of {counted(station.answered, 'answer')} took over {SLOW // MS} ms, "
                f"the longest at least {station.slowest // MS} ms"
            )
            yield _found("N2003", name, seen, station.slow)
        if station.damaged.count:
            yield self._damaged(name, station)
        if station.missing.count:
            yield self._missing(name, station)
        for (region, point), override in sorted(station.overrides.items()):
            age = self._now - override.time
            if age > OVERRIDE_AGE:
                value = "" if override.value is None else f" to {number(override.value)}"
                seen = f"{object_name(region, point)} overridden{value} for {age // (60 * NS_PER_S)} minutes"
                tally = _Tally(1, override.time, self._now, [override.row])
                yield _found("N2006", f"{name}, {object_name(region, point)}", seen, tally)
        if station.twice.count:
            yield _found(
                "N2008", name, f"a second answer came to {counted(station.twice.count, 'command')}", station.twice
            )
        if station.late.count:
            yield _found(
                "N2011",
                name,
                f"{counted(station.late.count, 'answer')} came after the master had gone on",
                station.late,
            )
        for (code, title), tally in sorted(station.refused.items()):
            words = f"N{code} {error_name(code)}".rstrip()
            yield _found("N2009", name, f"{title} refused {times(tally.count)}: {words}", tally)
        if station.again.count:
            yield _found("N2010", name, f"identified again {times(station.again.count)}", station.again)

    def _damaged(self, name: str, station: _Station) -> Finding:
        seen = f"{_damaged_words(station)} in {counted(station.asked + station.damaged_commands, 'exchange')}"
        finding = _found("N2004", name, seen, station.damaged)
        return replace(finding, severity=Severity.NOTE) if self._rare(station.damaged, station) else finding

    def _missing(self, name: str, station: _Station) -> Finding:
        if not station.answered:
            if station.asked == 1:
                return replace(
                    _found("N2005", name, "no answer to the only command", station.missing), severity=Severity.NOTE
                )
            finding = _found("N2005", name, f"no answer to any of {station.asked} commands", station.missing)
            return replace(finding, severity=Severity.ERROR)
        words = f"no answer to {station.missing.count} of {counted(station.asked, 'command')}"
        finding = _found("N2005", name, words, station.missing)
        return replace(finding, severity=Severity.NOTE) if self._rare(station.missing, station) else finding

    def _rare(self, tally: _Tally, station: _Station) -> bool:
        """Whether so few are not worth a warning: one, or under 1 in 100 and at most two a minute."""
        minutes = max(1, -(-(self._now - (self._first or 0)) // (60 * NS_PER_S)))
        return tally.count == 1 or (tally.count <= 2 * minutes and 100 * tally.count < station.asked)


def _damaged_words(station: _Station) -> str:
    parts = [
        counted(count, f"damaged {what}")
        for count, what in ((station.damaged_answers, "answer"), (station.damaged_commands, "command"))
        if count
    ]
    return " and ".join(parts)


def _found(code: str, subject: str, seen: str, tally: _Tally) -> Finding:
    return found(
        RULES[code],
        subject,
        seen,
        first=tally.first,
        last=tally.last,
        count=tally.count,
        evidence=tuple(tally.evidence),
    )
