"""Findings about the line itself, whatever runs on it: fed rows, transactions and line events. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from functools import cache

from dissectors.chances import is_rare
from dissectors.findings import Finding, Severity, Tally, counted, found, times
from dissectors.frame import Chunk, Event, Flaw, Frame, LineError, Noise, Reason, Role
from dissectors.line import LineSettings
from dissectors.manifest import Dissector
from dissectors.tracker import Transaction
from dissectors.words import milliseconds, percent
from sniff.analysis.between_frames import BetweenFrames
from sniff.analysis.breaks import LEVELS, breaks_in
from sniff.analysis.echo_findings import EchoesHeard
from sniff.analysis.judgement import Heard, Judgement
from sniff.analysis.line_rules import LINE_RULES as RULES
from sniff.analysis.line_use import LineUse
from sniff.analysis.other_settings import SAMPLE_OCTETS, Fit, lacking_bits, what_fits
from sniff.analysis.port_presence import PortPresence
from sniff.analysis.sender_findings import BUS, WRONG, Senders, sender_of
from sniff.analysis.time_patterns import Stop, TimePatterns
from sniff.analysis.wording import station_word
from sniff.engine.engine import Row
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import LineEvent, LineEventKind, Session

MENDED_LEAST = 3
"""So many frames that are good but for one and the same thing are a system, and prove the settings as good ones do."""

MARKED_MANY = 5
"""One octet in so many has a line error: then it is asked whether the parity is another one."""

COUNTED_OCTETS = 4096
"""Of longer rows the octets are not counted by value."""


class LineFindings:
    """Counts of one bus; `findings` may be asked at any time."""

    _nouns = staticmethod(cache(station_word))  # asked for every frame

    def __init__(self, session: Session, dissector: Dissector | None = None) -> None:
        """`dissector`: that of the session, where it is in no registry."""
        self._session = session
        self._patterns = TimePatterns(session)
        self._use = LineUse(session.line, has_times=session.timing.has_times, is_assumed=session.line_is_assumed)
        adapter = session.adapter
        self._senders = Senders(session.timing, adapter.packets)
        self._is_of_text = LineSettings.parse((dissector or dissector_for(session)).default_line).data_bits == 7
        self._octets = self._in_frames = self._marked = self._low = self._rows = self._frames = self._good = 0
        self._mended: dict[Flaw, tuple[int, int]] = {}  # frames, and octets of them, that are good but for that
        self._first = self._now = session.started  # of a capture in which nothing was heard: when it began
        self._damaged = self._damaged_here = 0  # rows that are no good frame, and those of them with an overrun
        self._overruns, self._lost = Tally(), Tally()
        self._stepped, self._port = Tally(), PortPresence(session.started)
        self._counted: dict[str, Tally] = {}
        self._lost_octets = self._only_heard = 0
        self._is_lost_counted = True
        self._echoes = EchoesHeard(session.timing.latency)
        self._values: Counter[int] = Counter()
        self._awaiting = False  # a request was the newest frame of a known kind
        self._between = BetweenFrames(session, dissector or dissector_for(session), self._senders)
        self._sample: list[Chunk] = []  # what came first, to ask what else it may be
        self._sampled = 0
        self._fit: tuple[int, Fit | None] = (0, None)  # asked when so many octets were sampled

    # ---- taking in

    def see(self, row: Row) -> None:
        """Take the next row."""
        event = row.event
        if not self._rows:
            self._first = self._now = event.start
        self._rows += 1
        self._now = max(self._now, event.end)
        self._octets += len(event.octets)
        if len(event.octets) <= COUNTED_OCTETS:
            self._values.update(event.octets)
        if self._sampled < SAMPLE_OCTETS:
            self._sample.append(Chunk(event.end, event.octets[:SAMPLE_OCTETS], event.marks))
            self._sampled += len(event.octets)
        sender = self._see_event(row)
        self._patterns.see(row.no, event, sender)
        self._use.see(row.no, event, row.placement.role if row.placement is not None else Role.UNKNOWN)

    def _see_event(self, row: Row) -> str:
        """Take what is not the same for every row; gives the sender."""
        event = row.event
        self._senders.see_marks(event)
        if event.marks:
            self._see_marks(row.no, event)
        if not isinstance(event, Frame) or not event.ok:
            self._damaged += 1
            self._damaged_here += any(mark.error & LineError.OVERRUN for mark in event.marks)
        if isinstance(event, Frame):
            return self._see_frame(row, event)
        self._see_noise(row.no, event)
        return BUS

    def pass_by(self, row: Row) -> None:
        """Take a row of a search for settings: the bus was not silent, and that is all it says."""
        self._only_heard += len(row.event.octets)

    def settle(self, transaction: Transaction) -> None:
        """Take a transaction that closed."""
        self._patterns.settle(transaction)
        self._echoes.settle(transaction)

    def add_line_event(self, event: LineEvent) -> None:
        """Take something that happened to the line."""
        self._patterns.add_line_event(event)
        self._use.add_line_event(event)
        kind = event.kind
        if kind is LineEventKind.DROPPED:
            self._lost.add(event.time)
            self._lost_octets += max(0, event.count)
            self._is_lost_counted = self._is_lost_counted and event.count >= 0
        elif kind in (LineEventKind.UNPLUGGED, LineEventKind.REPLUGGED):
            self._port.add(event, self._rows > 0)
        elif kind is LineEventKind.CLOCK:
            self._stepped.add(event.time)
        elif kind is LineEventKind.ERRORS and (event.text in self._counted or len(self._counted) < 16):
            tally = self._counted.setdefault(event.text, Tally())
            tally.add(event.time)
            tally.count += max(0, event.count - 1)

    def stops(self) -> list[Stop]:
        """What stopped all at once so far."""
        return self._patterns.stops()

    def _see_marks(self, no: int, event: Event) -> None:
        self._senders.see_breaks(no, event)
        for mark in event.marks:
            if mark.error & LineError.OVERRUN:
                self._overruns.add(event.start, no)
            self._marked += bool(mark.error & WRONG)
            self._low += bool(mark.error & LineError.BREAK)

    def _see_frame(self, row: Row, frame: Frame) -> str:
        """Gives the sender."""
        sender = sender_of(row, self._nouns)
        role = row.placement.role if row.placement is not None else Role.UNKNOWN
        if role is Role.RESPONSE and not frame.ok and not self._awaiting:
            sender = "bus"  # nobody was asked: it may be anything
        self._awaiting = role is Role.REQUEST or (self._awaiting and role is not Role.RESPONSE)
        self._frames += 1
        if frame.ok:
            self._good += 1
            self._in_frames += len(frame.octets)
        elif frame.repair is not None:
            frames, octets = self._mended.get(frame.repair.flaw, (0, 0))
            self._mended[frame.repair.flaw] = frames + 1, octets + len(frame.octets)
        self._senders.see(sender, row.no, frame)
        self._between.see_frame(sender, row.no, frame)
        asked = row.placement.destination if row.placement is not None else None
        asker = sender if role is Role.REQUEST else None
        self._between.follow(asker, self._called(asked, frame.protocol), frame.ok)
        return sender

    def _called(self, station: int | None, protocol: str) -> str | None:
        return None if station is None else f"{self._nouns(protocol)} {station}"

    def _see_noise(self, no: int, noise: Noise) -> None:
        is_begin = self._rows == 1  # of the capture, in the middle of something
        if noise.reason is not Reason.PAD and not breaks_in(noise) and not is_begin:
            self._between.see_noise(no, noise)

    # ---- judging

    @property
    def heard(self) -> Heard:
        """What was on the line so far."""
        mended = [one for one in self._mended.values() if one[0] >= MENDED_LEAST]
        good, in_frames = (own + sum(one[at] for one in mended) for at, own in enumerate((self._good, self._in_frames)))
        heard = Heard(self._octets, in_frames, self._rows, good, bool(self._only_heard))
        heard = replace(heard, lacks_bits=self._lacking_bits() is not None)
        return replace(heard, is_told=True) if heard.is_strange and self._other_settings() is not None else heard

    def _lacking_bits(self) -> Fit | None:
        if self._has_seven_bits:
            return None
        return lacking_bits(self._sample, self._session.line, self._values, self._damaged, self._rows)

    def lasting_silence(self, now: int) -> Finding | None:
        """That a bus which is listened to has fallen silent by `now` (ns); None where nobody can say so."""
        is_timed = self._session.has_times and self._port.away_since is None and not self.heard.is_rubbish
        return self._patterns.lasting_silence(now) if is_timed else None

    def judgement(self) -> Judgement:
        """All findings so far, as a value that merges."""
        heard, host = self.heard, (self._can_tell(), *self._of_host())
        if heard.is_nothing:
            return Judgement(heard, host, (self._whole("LN002", "bus", "not one octet was heard"),))
        return Judgement(heard, host, (self._rubbish(),) if heard.is_rubbish else (), self._of_line())

    def findings(self) -> tuple[Finding, ...]:
        """All findings so far."""
        return self.judgement().findings(RULES)

    def _of_line(self) -> tuple[Finding, ...]:
        """What may be wrong with a line that can be judged."""
        made: list[Finding] = []
        parity = self._parity_setting()
        made += self._wrong_octets() if parity is None else (parity,)
        made += self._of_bus()
        made += self._patterns.findings()
        made += self._use.findings()
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
        if not self._session.has_times:
            return self._whole("LN001", "adapter", f"{words}; when anything came is not known")
        words += f"; octets are held back for {milliseconds(adapter.latency)} at most" if adapter.latency else ""
        words += "; times are taken as exact" if not adapter.latency else ""
        words += f" ({adapter.latency_from})"
        return self._whole("LN001", "adapter", words)

    def _of_host(self) -> Iterator[Finding]:
        if self._lost.count:
            many = counted(self._lost_octets, "octet") if self._lost_octets else "an unknown number of octets"
            many = many if self._is_lost_counted or not self._lost_octets else f"at least {many}"
            yield self._lost.found(RULES["LN005"], "adapter", f"{many} lost {times(self._lost.count)}")
        yield from self._port.findings()
        if self._stepped.count:
            yield self._stepped.found(RULES["LN007"], "adapter", f"the clock stepped {times(self._stepped.count)}")
        if self._overruns.count:
            words = f"overrun reported {times(self._overruns.count)}"
            mostly = 4 * self._damaged_here >= 3 * self._damaged
            if self._damaged_here:
                whole = f"{self._damaged_here} of {self._damaged} rows that are no good frame"
                words += f", in {whole if self._damaged > 1 else 'the only row that is no good frame'}"
            yield self._overruns.found(RULES["LN104"], "adapter", words, None if mostly else Severity.NOTE)

    def _rubbish(self) -> Finding:
        share = self._in_frames / self._octets
        how_many = "not one" if not self._in_frames else "hardly one" if share < 0.005 else f"only {percent(share, 0)}"
        verb = "are" if self._in_frames and share >= 0.005 else "is"
        words = f"{how_many} of {self._octets} octets {verb} part of a good frame"
        fit = self._other_settings() or self._lacking_bits()
        if fit is not None:
            finding = self._whole("LN003", "bus", f"{words}; {fit.seen}")
            return replace(finding, means=fit.means, next=fit.next)
        extremes = sum(self._values[value] for value in LEVELS)
        total = max(1, sum(self._values.values()))
        reports = self._session.adapter.reports
        if self._marked * 10 > self._octets or self._low * 10 > self._octets:
            words += f"; {percent(self._marked / self._octets, 0)} of all octets have parity or framing errors"
            words += ": the baud rate or the format is wrong, or A and B are swapped"
        elif 2 * extremes > total:
            words += "; most are 00, FF or the like: the baud rate is wrong, or A and B are swapped"
        elif reports and not self._marked:
            words += "; none has a line error, so the line is well and the protocol may be another one"
        return self._whole("LN003", "bus", words)

    def _other_settings(self) -> Fit | None:
        """What these octets are; asked again when there are twice as many."""
        asked, fit = self._fit
        if self._sampled >= 2 * asked or (asked < self._sampled >= SAMPLE_OCTETS):
            session = self._session
            timing = session.timing
            fit = what_fits(self._sample, session.line, timing.latency, session.protocol, timing.has_rate)
            self._fit = self._sampled, fit
        return None if fit is not None and fit.lacks_bits and self._has_seven_bits else fit

    @property
    def _has_seven_bits(self) -> bool:
        """Whether the bus has no more: its protocol is one of text, and frames were good."""
        return self._good >= MENDED_LEAST and self._is_of_text

    def _parity_setting(self) -> Finding | None:
        """That the port has another parity than the bus, where octets tell it."""
        if not self._octets:
            return None
        words = f"{percent(self._marked / self._octets, 0)} of the octets have parity or framing errors"
        if self._senders.are_all_struck() and 10 * self._in_frames >= 8 * self._octets:
            words += f", yet {percent(self._in_frames / self._octets, 0)} are in good frames"
            return replace(self._whole("LN004", "bus", words), count=self._marked, is_once=False)
        fit = self._other_settings() if self._marked * MARKED_MANY > self._octets else None
        if fit is None or not fit.is_parity:
            return None
        made = replace(self._whole("LN004", "bus", f"{words}; {fit.seen}"), means=fit.means, next=fit.next)
        return replace(made, count=self._marked, is_once=False)

    def _wrong_octets(self) -> Iterator[Finding]:
        yield from self._senders.wrong_octets(self._note_if)
        for kind, tally in sorted(self._counted.items()):
            words = counted(tally.count, f"{kind or 'line'} error") + " counted by the driver"
            yield tally.found(RULES["LN102"], "bus", words)

    def _of_bus(self) -> Iterator[Finding]:
        yield from self._senders.breaks_found(self._note_if)
        yield from self._between.found(self._octets, self._note_if)
        echoes = self._echoes.found()
        if echoes is not None:
            yield echoes

    def _whole(self, code: str, subject: str, words: str) -> Finding:
        return replace(found(RULES[code], subject, words, first=self._first, last=self._now), lasts=True)

    def _note_if(self, count: int, of: int) -> Severity | None:
        """A note where so few are not worth a warning."""
        return Severity.NOTE if is_rare(count, of, self._use.heard) else None
