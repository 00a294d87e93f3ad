"""What is wrong with the line itself, whatever runs on it: fed rows, transactions and line events. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from dissectors.findings import Finding, Severity, Tally, counted, found, times
from dissectors.frame import Damage, Event, Frame, LineError, Mark, Noise, Place, Reason, Role
from dissectors.line import NS_PER_S
from dissectors.tracker import Transaction, Verdict
from sniff.analysis.line_rules import LINE_RULES as RULES
from sniff.analysis.wording import milliseconds, station_word
from sniff.engine import Row
from sniff.session import LineEvent, LineEventKind, Session

STRAY_MOST = 3
"""So many octets that are no frame are stray ones; more are the remains of something."""

RUBBISH_LEAST = 60  # octets before "hardly anything is a frame" is said
_WRONG = LineError.PARITY | LineError.FRAMING


@dataclass(slots=True)
class _Sender:
    """Frames of one sender, and what went wrong with them."""

    frames: int = 0
    wrong: Tally = field(default_factory=Tally)
    at: Counter[str] = field(default_factory=Counter)  # place of the wrong octets in the frame
    stray: dict[str, Tally] = field(default_factory=dict)  # by rule
    values: Counter[tuple[str, int]] = field(default_factory=Counter)  # of those octets, by rule


class LineFindings:
    """Counts of one bus; `findings` may be asked at any time."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._packets = "whole" in session.adapter.detail  # an error flag is somewhere among the octets marked
        self._octets = self._in_frames = self._marked = self._rows = self._frames = self._good = 0
        self._first = self._now = 0
        self._senders: dict[str, _Sender] = {}
        self._breaks, self._overruns, self._lost = Tally(), Tally(), Tally()
        self._unplugged, self._stepped, self._rest = Tally(), Tally(), Tally()
        self._counted: dict[str, Tally] = {}
        self._unplugged_at: int | None = None
        self._away = 0
        self._lost_octets = self._rest_octets = self._only_heard = 0
        self._echo, self._asked = Tally(), 0
        self._values: Counter[int] = Counter()
        self._before: str | None = None  # who sent the frame before
        self._awaiting = False  # a request was the newest frame of a known kind
        self._pending: list[tuple[int, Noise]] = []  # noise directly before the frame to come

    # ---- taking in

    def see(self, row: Row) -> None:
        """Take the next row."""
        event = row.event
        if not self._rows:
            self._first = event.start
        self._rows += 1
        self._now = max(self._now, event.end)
        self._octets += len(event.octets)
        if len(event.octets) <= 4096:
            self._values.update(event.octets)
        if event.marks:
            self._see_marks(row.no, event)
        if isinstance(event, Frame):
            self._see_frame(row, event)
        else:
            self._see_noise(row.no, event)

    def pass_by(self, row: Row) -> None:
        """Take a row of a search for settings: the bus was not silent, and that is all it says."""
        self._only_heard += len(row.event.octets)

    def settle(self, transaction: Transaction) -> None:
        """Take a transaction that closed."""
        if transaction.verdict is Verdict.ECHO:
            self._echo.add(transaction.start, transaction.request)
        elif transaction.request is not None:
            self._asked += 1

    def add_line_event(self, event: LineEvent) -> None:
        """Take something that happened to the line."""
        kind = event.kind
        if kind is LineEventKind.DROPPED:
            self._lost.add(event.time)
            self._lost_octets += max(0, event.count)
        elif kind is LineEventKind.UNPLUGGED:
            self._unplugged.add(event.time)
            self._unplugged_at = event.time
        elif kind is LineEventKind.REPLUGGED and self._unplugged_at is not None:
            self._away += max(0, event.time - self._unplugged_at)
            self._unplugged_at = None
        elif kind is LineEventKind.CLOCK:
            self._stepped.add(event.time)
        elif kind is LineEventKind.ERRORS and (event.text in self._counted or len(self._counted) < 16):
            tally = self._counted.setdefault(event.text, Tally())
            tally.add(event.time)
            tally.count += max(0, event.count - 1)

    def _see_marks(self, no: int, event: Event) -> None:
        for mark in event.marks:
            if mark.error & LineError.BREAK:
                self._breaks.add(event.start, no)
            if mark.error & LineError.OVERRUN:
                self._overruns.add(event.start, no)
            self._marked += bool(mark.error & _WRONG)

    def _see_frame(self, row: Row, frame: Frame) -> None:
        sender = _sender(row)
        role = row.placement.role if row.placement is not None else Role.UNKNOWN
        if role is Role.RESPONSE and not frame.ok and not self._awaiting:
            sender = "bus"  # nobody was asked: it may be anything
        self._awaiting = role is Role.REQUEST or (self._awaiting and role is not Role.RESPONSE)
        record = self._senders.setdefault(sender, _Sender()) if len(self._senders) < 600 else _Sender()
        record.frames += 1
        self._frames += 1
        if frame.ok:
            self._good += 1
            self._in_frames += len(frame.octets)
        for no, noise in self._pending:
            _stray(record, "LN201", no, noise)
        self._pending.clear()
        wrong = [mark for mark in frame.marks if mark.error & _WRONG]
        if wrong and not (self._packets and frame.ok):
            record.wrong.add(frame.start, row.no)
            if not self._packets:
                record.at.update(_place(frame, mark) for mark in wrong)
        self._before = sender

    def _see_noise(self, no: int, noise: Noise) -> None:
        if noise.reason in (Reason.BREAK, Reason.PAD) or any(m.error & LineError.BREAK for m in noise.marks):
            return
        if self._rows == 1:  # the capture began in the middle of something
            return
        if len(noise.octets) > STRAY_MOST:
            self._rest.add(noise.start, no)
            self._rest_octets += len(noise.octets)
        elif noise.place is Place.BEFORE:
            self._pending.append((no, noise))
            del self._pending[:-8]
        elif noise.place is Place.AFTER and self._before is not None:
            _stray(self._senders.setdefault(self._before, _Sender()), "LN202", no, noise)
        else:
            _stray(self._senders.setdefault("bus", _Sender()), "LN203", no, noise)

    # ---- judging

    @property
    def rubbish(self) -> bool:
        """Whether hardly anything is a frame, so that nothing else can be judged."""
        few = 10 * self._in_frames < 3 * self._octets and 10 * self._good < 3 * self._rows
        return self._octets >= RUBBISH_LEAST and few

    def findings(self) -> tuple[Finding, ...]:
        """All findings so far."""
        made = [self._can_tell(), *self._of_host()]
        if not self._octets and not self._only_heard:
            return (*made, self._whole("LN002", "bus", "not one octet was heard"))
        if self.rubbish:
            return (*made, self._rubbish())
        many = 2 if self._packets else 10  # where one flag marks a whole packet, few errors mark many octets
        if many * self._marked > self._octets and 10 * self._in_frames >= 8 * self._octets:
            made.append(self._parity_setting())
        else:
            made += self._wrong_octets()
        made += self._of_bus()
        return tuple(made)

    def _can_tell(self) -> Finding:
        adapter = self._session.adapter
        if adapter.reports is None:
            words = "it is not known which line errors this adapter reports"
        elif not adapter.reports:
            words = "no line errors are reported: none seen does not mean a clean line"
        else:
            words = f"line errors reported: {', '.join(adapter.reports)}"
        if adapter.detail:
            words += f" ({adapter.detail})"
        words += f"; octets are held back for {milliseconds(adapter.latency)} at most" if adapter.latency else ""
        words += "; times are taken as exact" if not adapter.latency else ""
        words += f" ({adapter.latency_from})"
        return self._whole("LN001", "adapter", words)

    def _of_host(self) -> Iterator[Finding]:
        if self._lost.count:
            many = counted(self._lost_octets, "octet") if self._lost_octets else "an unknown number of octets"
            yield self._lost.found(RULES["LN005"], "adapter", f"{many} lost {times(self._lost.count)}")
        if self._unplugged.count:
            words = f"unplugged {times(self._unplugged.count)}"
            words += f", away for {self._away / NS_PER_S:.1f} s in all" if self._away else ""
            words += "; it did not come back" if self._unplugged_at is not None else ""
            severity = Severity.ERROR if self._unplugged_at is not None else None
            yield self._unplugged.found(RULES["LN006"], "adapter", words, severity)
        if self._stepped.count:
            yield self._stepped.found(RULES["LN007"], "adapter", f"the clock stepped {times(self._stepped.count)}")
        if self._overruns.count:
            words = f"overrun reported {times(self._overruns.count)}"
            yield self._overruns.found(RULES["LN104"], "adapter", words)

    def _rubbish(self) -> Finding:
        share = self._in_frames / self._octets
        how_many = "not one" if not self._in_frames else "hardly one" if share < 0.005 else f"only {share:.0%}"
        words = f"{how_many} of {self._octets} octets is part of a good frame"
        extremes = sum(self._values[value] for value in (0x00, 0x80, 0xC0, 0xE0, 0xF0, 0xF8, 0xFC, 0xFE, 0xFF))
        total = max(1, sum(self._values.values()))
        reports = self._session.adapter.reports
        if self._marked * 10 > self._octets or self._breaks.count * 10 > self._octets:
            words += f"; {self._marked / self._octets:.0%} of all octets have parity or framing errors"
            words += ": the baud rate or the format is wrong, or A and B are swapped"
        elif 2 * extremes > total:
            words += "; most are 00, FF or the like: the baud rate is wrong, or A and B are swapped"
        elif reports and not self._marked:
            words += "; none has a line error, so the line is well and the protocol may be another one"
        return self._whole("LN003", "bus", words)

    def _parity_setting(self) -> Finding:
        words = (
            f"{self._marked / self._octets:.0%} of the octets have parity or framing errors, "
            f"yet {self._in_frames / self._octets:.0%} are in good frames"
        )
        return replace(self._whole("LN004", "bus", words), count=self._marked)

    def _wrong_octets(self) -> Iterator[Finding]:
        struck = {name: record for name, record in sorted(self._senders.items()) if record.wrong.count}
        whole = {name for name, record in self._senders.items() if record.frames >= 20}
        if len(whole) >= 3 and all(
            name in struck and self._note_if(struck[name].wrong.count, struck[name].frames) is None for name in whole
        ):
            yield self._wrong_everywhere(struck)
            struck = {}
        for name, record in struck.items():
            kinds = "line errors somewhere in" if self._packets else "parity or framing errors in"
            words = f"{kinds} {record.wrong.count} of {counted(record.frames, 'frame')}"
            if record.at:
                words += f" ({', '.join(f'{count} {place}' for place, count in record.at.most_common())})"
            finding = record.wrong.found(RULES["LN101"], name, words, self._note_if(record.wrong.count, record.frames))
            if 4 * record.at["at the last octet"] >= 3 * sum(record.at.values()) > 8:
                finding = replace(
                    finding,
                    means="the station releases its driver before the last octet is out",
                    next="its turnaround or transmit-delay setting; its converter's direction control",
                )
            yield finding
        for kind, tally in sorted(self._counted.items()):
            words = counted(tally.count, f"{kind or 'line'} error") + " counted by the driver"
            yield tally.found(RULES["LN102"], "bus", words)

    def _wrong_everywhere(self, struck: dict[str, _Sender]) -> Finding:
        """One finding in place of one for each sender."""
        tally = Tally()
        for record in struck.values():
            for no in record.wrong.evidence:
                tally.add(record.wrong.first, no)
        count = sum(record.wrong.count for record in struck.values())
        each = ", ".join(f"{name} {record.wrong.count}" for name, record in struck.items())
        words = f"parity or framing errors in {count} of {self._frames} frames, whoever sends ({each})"
        finding = tally.found(RULES["LN101"], "bus", words)
        return replace(
            finding,
            count=count,
            last=max(record.wrong.last for record in struck.values()),
            means="a cause common to all: termination, bias, ground, cable, or noise at the tap",
            next="120 Ω at both ends only, one bias, the shield grounded once; the tap's own wires",
        )

    def _of_bus(self) -> Iterator[Finding]:
        if self._breaks.count:
            words = f"the line was held low {times(self._breaks.count)}"
            yield self._breaks.found(RULES["LN103"], "bus", words, self._note_if(self._breaks.count, self._frames))
        for name, record in sorted(self._senders.items()):
            for code, tally in sorted(record.stray.items()):
                frames = self._frames if name == "bus" else record.frames
                yield self._stray_finding(RULES[code].code, name, record, tally, frames)
        if self._rest.count:
            share = self._rest_octets / self._octets
            stretches = counted(self._rest.count, "stretch", "stretches")
            words = f"{self._rest_octets} octets in {stretches} are no frame, {share:.1%} of all"
            severity = None if share >= 0.02 and self._rest.count > 1 else Severity.NOTE
            yield self._rest.found(RULES["LN204"], "bus", words, severity)
        if self._echo.count:
            words = f"{self._echo.count} of {counted(self._asked, 'request')} came twice, the copy directly behind"
            severity = Severity.WARNING if 10 * self._echo.count >= self._asked else None
            yield self._echo.found(RULES["LN205"], "bus", words, severity)

    def _stray_finding(self, code: str, name: str, record: _Sender, tally: Tally, frames: int) -> Finding:
        where = {"LN201": "before", "LN202": "after"}.get(code)
        if where is None:
            words = f"stray octets {times(tally.count)} in the silence between {counted(frames, 'frame')}"
        elif tally.count > frames:
            words = f"stray octets {times(tally.count)} {where} {counted(frames, 'frame')}"
        else:
            words = f"stray octets {where} {tally.count} of {counted(frames, 'frame')}"
        values = [(value, count) for (rule, value), count in record.values.most_common() if rule == code]
        most = values[:4]
        if 2 * sum(count for _, count in most) > sum(count for _, count in values):
            mostly = "" if len(values) == len(most) else "mostly "
            words += f" ({mostly}{', '.join(f'{value:02X}' for value, _ in most)})"
        return tally.found(RULES[code], name, words, self._note_if(tally.count, frames))

    def _whole(self, code: str, subject: str, words: str) -> Finding:
        return found(RULES[code], subject, words, first=self._first, last=self._now)

    def _note_if(self, count: int, of: int) -> Severity | None:
        """A note where so few are not worth a warning: one, or under 1 in 100 and at most two a minute."""
        minutes = max(1, -(-(self._now - self._first) // (60 * NS_PER_S)))
        return Severity.NOTE if count == 1 or (count <= 2 * minutes and 100 * count < of) else None


def _sender(row: Row) -> str:
    """Whose frame it is, as a subject; a damaged header names nobody."""
    if isinstance(row.event, Frame) and row.event.damage is Damage.HEADER:
        return "bus"
    placement, header = row.placement, row.header
    source = placement.source if placement is not None else header.source if header is not None else None
    if source is not None:
        return f"{station_word(header.protocol) if header is not None else 'station'} {source}"
    role = placement.role if placement is not None else header.role if header is not None else Role.UNKNOWN
    return "master" if role in (Role.REQUEST, Role.BROADCAST) else "bus"


def _place(frame: Frame, mark: Mark) -> str:
    if mark.offset >= len(frame.octets) - 1:
        return "at the last octet"
    return "at the first octet" if mark.offset == 0 else "inside"


def _stray(record: _Sender, code: str, no: int, noise: Noise) -> None:
    record.stray.setdefault(code, Tally()).add(noise.start, no)
    record.values.update((code, octet) for octet in noise.octets)
