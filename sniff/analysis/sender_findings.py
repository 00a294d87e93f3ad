"""Line errors, breaks and stray octets, counted at whoever sent beside them: whose they are. Pure.

What strikes one sender clearly more often than its share of the line explains is that sender's; what falls anywhere is
the bus's, and told once (`shares.py`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace

from dissectors.chances import at_least
from dissectors.findings import Finding, Severity, Tally, counted, together
from dissectors.frame import Damage, Event, Frame, LineError, Mark, Noise, Role
from dissectors.line import Timing
from dissectors.strikes import Strikes
from dissectors.subject import as_subject
from sniff.analysis.appended import Behind
from sniff.analysis.breaks import Breaks
from sniff.analysis.flag_runs import FlagRuns
from sniff.analysis.line_rules import LINE_RULES as RULES
from sniff.analysis.shares import UNLIKELY, only_struck, standing_out
from sniff.engine.engine import Row

WRONG = LineError.PARITY | LineError.FRAMING
MOST_SENDERS = 600
BREAKS_LEAST = 4
NEAR = 12
"""Characters behind a frame within which a break belongs to whoever sent it."""

PACKETS_LEAST = 4
ALL_STRUCK = 8
"""Frames of one sender, all of them good and each with line errors, that no noise makes."""

BUS, MASTER = "bus", "master"

NoteIf = Callable[[int, int], Severity | None]
"""(count, of) → NOTE where so few are not worth a warning."""


@dataclass(slots=True)
class Sender:
    """Frames of one sender, and what went wrong with them. `flagged`: in a packet with an error flag."""

    frames: int = 0
    octets: int = 0
    flagged: int = 0
    good: int = 0  # octets in good frames
    marked: int = 0  # of those the ones with an error
    wrong: Tally = field(default_factory=Tally)
    spoilt: Tally = field(default_factory=Tally)  # those of them that are no good frames
    at: Counter[str] = field(default_factory=Counter)  # place of the wrong octets in the frame
    stray: dict[str, Tally] = field(default_factory=dict)  # by rule
    values: Counter[tuple[str, int]] = field(default_factory=Counter)  # of those octets, by rule
    behind: Behind = field(default_factory=Behind)  # strays behind its frames
    joined: Behind = field(default_factory=Behind)  # those in silence (LN203) that began where a frame of it ended


class Senders:
    """All senders of a bus. `packets`: whether an error flag is somewhere among the octets marked (USB packets); None
    where the capture does not say, and the marks must."""

    def __init__(self, timing: Timing, packets: bool | None) -> None:
        self._packets = packets
        self._runs = FlagRuns()
        self.beside = timing.latency <= timing.t35  # else octets beside a frame may be far from it
        self._near = timing.latency + NEAR * timing.char
        self._at_once = timing.char
        self._end = 0  # of the frame before
        self.by_name: dict[str, Sender] = {}
        self.frames = 0
        self.breaks = Breaks()
        self.before: str | None = None  # who sent the frame before
        self._packet: set[str] = set()  # who sent in the packet with a flag that may go on
        self._goes_on = False
        self._is_foreign = False  # octets that are no frame are in that packet, and may be what it is flagged for
        self._opened = 0, 0  # time and number of its first frame
        self._flagged: Counter[frozenset[str]] = Counter()
        self._flags = Tally()
        self._struck, self._spoilt = Strikes(), Strikes()  # frames with an error; those of them that are not good

    @property
    def packets(self) -> bool:
        """Whether an error flag is somewhere among the octets marked."""
        return self._runs.cover_reads if self._packets is None else self._packets

    def see_marks(self, event: Event) -> None:
        """Take any row, for what its marks tell of the adapter."""
        marked = [mark.offset for mark in event.marks if mark.error & WRONG]
        self._runs.see(marked, len(event.octets), isinstance(event, Frame) and event.ok)
        if isinstance(event, Noise) and marked:
            if not (self._goes_on and marked[0] == 0):
                self._close_packet()
            self._is_foreign, self._goes_on = True, marked[-1] == len(event.octets) - 1

    def joins(self, event: Event) -> bool:
        """Whether an event begins where the newest frame ended, as far as times tell: nobody else can be as quick."""
        return self.beside and event.start - self._end <= self._at_once

    def of(self, name: str) -> Sender:
        """A sender; one beyond the limit is not kept."""
        found = self.by_name.get(name)
        if found is None:
            found = Sender()
            if len(self.by_name) < MOST_SENDERS:
                self.by_name[name] = found
        return found

    def see(self, name: str, no: int, frame: Frame) -> Sender:
        """Take a frame."""
        sender = self.of(name)
        sender.frames += 1
        sender.octets += len(frame.octets)
        self.frames += 1
        wrong = [mark for mark in frame.marks if mark.error & WRONG]
        self._see_packet(name, no, frame, wrong)
        if frame.ok:
            sender.good += len(frame.octets)
            sender.marked += len(wrong)
        if name != MASTER and frame.ok:
            self._spoilt.whole()
            if not wrong:
                self._struck.whole()
        if wrong:
            self._struck.struck(name)
            sender.wrong.add(frame.start, no)
            sender.at.update(_place(frame, mark) for mark in wrong)
        if wrong and not frame.ok:
            self._spoilt.struck(name)
            sender.spoilt.add(frame.start, no)
        if self.breaks.begun_by == no:
            self.breaks.begin_behind(name)
        self.before, self._end = name, frame.end
        return sender

    def count(self, name: str, frames: int, octets: int) -> None:
        """Count good frames without line errors, at their sender where it is kept."""
        self.frames += frames
        sender = self.by_name.get(name)
        if sender is not None:
            sender.frames += frames
            sender.octets += octets
            sender.good += octets

    def see_good(self, name: str, end: int, only_master: bool) -> None:
        """Take good frames without line errors that follow one another, which `count` has had: who sent the last of
        them, when it ended (ns), and whether all are the master's."""
        if not only_master:
            self._struck.whole()
            self._spoilt.whole()
        self._runs.see([], 1, True)
        self._close_packet()
        self.before, self._end = name, end

    def see_breaks(self, no: int, event: Event) -> int:
        """Take a row with marks, before its sender is told of it; how often the line was held low in it."""
        count = self.breaks.see(no, event)
        is_own = count and self.breaks.begun_by == no and not isinstance(event, Frame)  # a frame is counted with it
        if is_own and self.before is not None and event.start - self._end <= self._near:
            self.breaks.begin_behind(self.before)
        return count

    def stray(self, name: str, code: str, no: int, noise: Noise) -> None:
        """Take a few octets that are no frame."""
        sender = self.of(name)
        sender.stray.setdefault(code, Tally()).add(noise.start, no)
        sender.values.update((code, octet) for octet in noise.octets)
        if code == "LN202":
            sender.behind.add(no, noise)

    def put_back(self, name: str, code: str, noise: Noise, before: Tally | None) -> None:
        """Forget the newest stray octets of a sender by a rule; `before`: what was counted of them until then."""
        sender = self.of(name)
        if before is None:
            sender.stray.pop(code, None)
        else:
            sender.stray[code] = before
        sender.values -= Counter((code, octet) for octet in noise.octets)
        if code == "LN202":
            sender.behind.take_back(noise)

    def _see_packet(self, name: str, no: int, frame: Frame, wrong: list[Mark]) -> None:
        """Gather who sent in one packet with a flag: its marks run from octet to octet, over frames."""
        if not wrong:
            self._close_packet()
            return
        self.of(name).flagged += 1
        if not (self._goes_on and wrong[0].offset == 0):
            self._close_packet()
        if not self._packet:
            self._opened = frame.start, no
        self._packet.add(name)
        self._goes_on = wrong[-1].offset == len(frame.octets) - 1

    def _close_packet(self) -> None:
        if self._packet and not self._is_foreign:
            self._flags.add(*self._opened)
            senders = frozenset(self._packet)
            if senders in self._flagged or len(self._flagged) < MOST_SENDERS:
                self._flagged[senders] += 1
        self._packet = set()
        self._goes_on = self._is_foreign = False

    # ---- judging

    def are_all_struck(self) -> bool:
        """Whether so many octets of good frames are marked as a wrong setting of the port marks: whoever sends.

        Those that are no frame tell nothing: they are somebody else's, who speaks otherwise.
        """
        many = 2 if self.packets else 10  # where one flag marks a whole packet, few errors mark many octets
        if not _are_many(many, self.by_name.values()):
            return False
        known = {name: one for name, one in self.by_name.items() if name != BUS}
        out = standing_out({name: (one.marked, float(one.good)) for name, one in known.items()}, MASTER)
        return not out or _are_many(many, (one for name, one in known.items() if name not in out))

    def _wrong(self, record: Sender) -> Tally:
        """Frames with an error in them: of those in a packet with a flag, only the damaged ones surely have it."""
        return record.spoilt if self.packets else record.wrong

    def wrong_octets(self, note_if: NoteIf) -> Iterator[Finding]:
        """Line errors at the senders that have more than their share, the rest at the bus."""
        struck = {name: record for name, record in sorted(self.by_name.items()) if self._wrong(record).count}
        known = {name: one for name, one in self.by_name.items() if name != BUS}
        strikes = self._spoilt if self.packets else self._struck
        counts = {name: strikes.of(name, self._wrong(one).count) for name, one in known.items()}
        struck_by_share = {name: (counts[name], float(one.octets)) for name, one in known.items()}
        out = standing_out(struck_by_share, MASTER) or only_struck(struck_by_share)
        rest = {name: record for name, record in struck.items() if name not in out}
        if rest.keys() - {BUS}:
            yield self._wrong_everywhere(rest, note_if)
            struck = {name: record for name, record in struck.items() if name in out}
        for name, record in struck.items():
            yield self._wrong_of(name, record, note_if)
        if self.packets and (found := self._of_packets(note_if)) is not None:
            if found.subject == BUS and (struck or rest):
                return
            if found.subject not in struck:
                yield found

    def _wrong_of(self, name: str, record: Sender, note_if: NoteIf) -> Finding:
        kinds = "line errors somewhere in" if self.packets else "parity or framing errors in"
        wrong = self._wrong(record)
        words = f"{kinds} {wrong.count} of {counted(record.frames, 'frame')}"
        if record.at and not self.packets:
            words += f" ({', '.join(f'{count} {place}' for place, count in record.at.most_common())})"
        finding = wrong.found(RULES["LN101"], name, words, note_if(wrong.count, record.frames))
        if not self.packets and wrong.count == record.frames >= ALL_STRUCK and 10 * record.good >= 9 * record.octets:
            return replace(
                finding,
                seen=f"{finding.seen}, though their checks agree",
                means="this station sends with another parity, or fewer stop bits, than the port listens with",
                next="its parity and stop bits, against those of the bus",
                is_told_apart=True,
            )
        if not self.packets and 4 * record.at["at the last octet"] >= 3 * sum(record.at.values()) > 8:
            finding = replace(
                finding,
                means="the station releases its driver before the last octet is out",
                next="its turnaround or transmit-delay setting; its converter's direction control",
            )
        return finding

    def _wrong_everywhere(self, struck: dict[str, Sender], note_if: NoteIf) -> Finding:
        """One finding in place of one for each sender. Where a single one is known to be struck, too seldom to name it,
        nothing shows that all are."""
        tally = together(self._wrong(record) for record in struck.values())
        counts = {name: self._wrong(one).count for name, one in struck.items()}
        known = sorted(counts.keys() - {BUS}, key=_in_order)
        each = ", ".join(f"{name}: {counts[name]}" for name in known)
        words = f"parity or framing errors in {tally.count} of {counted(self.frames, 'frame')}"
        words += f"{', whoever sends' if len(known) > 1 else ''} ({each}"
        words += f", unknown: {counts[BUS]})" if BUS in counts else ")"
        words += ": too few to say whether it alone is struck" if len(counts) == 1 else ""
        found = tally.found(RULES["LN101"], BUS, words, note_if(tally.count, self.frames))
        if len(known) == 1:
            return replace(
                found,
                means="noise somewhere on the line, weak levels from this sender, or two that send at once",
                next="whether it comes again, and with whom; then that sender's connector, termination, bias, ground",
            )
        return replace(
            found,
            means="a cause common to all: termination, bias, ground, cable, or noise at the tap",
            next="120 Ω at both ends only, one bias, the shield grounded once; the tap's own wires",
        )

    def _of_packets(self, note_if: NoteIf) -> Finding | None:
        """The sender that is in every packet with a flag, where others are mostly in packets without one."""
        packets, flags = self._flagged, self._flags
        if self._packet and not self._is_foreign:  # the one that may go on
            packets, flags = packets + Counter([frozenset(self._packet)]), replace(flags, evidence=[*flags.evidence])
            flags.add(*self._opened)
        total = packets.total()
        if total < 2:
            return None
        words = f"line errors are flagged on {counted(flags.count, 'packet')}"
        everybody = f"{words}, whoever sends; the frames in them may be good"
        of_bus = flags.found(RULES["LN101"], BUS, everybody, note_if(total, self.frames))
        rates = {name: one.flagged / one.frames for name, one in self.by_name.items() if one.frames >= 3}
        if total < PACKETS_LEAST or not rates:
            return of_bus
        name = max(rates, key=lambda one: rates[one])
        within = sum(count for senders, count in packets.items() if name in senders)
        size = sum(len(senders) * count for senders, count in packets.items()) / total
        usual = min(1.0, size * self.by_name[name].frames / self.frames)  # of any packets
        others = max((rate for other, rate in rates.items() if other != name), default=0.0)
        if within < 0.9 * total or rates[name] < 2 * others or len(rates) * at_least(within, total, usual) > UNLIKELY:
            return of_bus
        record = self.by_name[name]
        words += f", {within} of them with its frames: {record.flagged} of {counted(record.frames, 'frame')}, "
        words += "though their checks may agree"
        return flags.found(RULES["LN101"], name, words, note_if(total, record.frames))

    def breaks_found(self, note_if: NoteIf) -> Iterator[Finding]:
        """Breaks: of a sender where nearly all are in or after its frames, else of the bus."""
        if not self.breaks.events.count:
            return
        count, severity = self.breaks.events.count, self.breaks.severity(note_if, self.frames)
        breaks = self.breaks.own
        own = {name: (breaks[name], float(one.frames)) for name, one in self.by_name.items()}
        for name in standing_out(own):
            struck = own[name][0]
            if severity is None and struck >= max(BREAKS_LEAST, 0.8 * count) and name not in (BUS, MASTER):
                yield self.breaks.of_sender(name, struck)
                return
        yield self.breaks.of_bus(severity)


def _are_many(many: int, senders: Iterable[Sender]) -> bool:
    both = [(one.marked, one.good) for one in senders]
    return many * sum(marked for marked, _ in both) > sum(good for _, good in both)


def _in_order(name: str) -> tuple[bool, int]:
    """The master first, then stations by their address."""
    about = as_subject(name)
    return about.station is not None, about.station or 0


def _place(frame: Frame, mark: Mark) -> str:
    if mark.offset >= len(frame.octets) - 1:
        return "at the last octet"
    return "at the first octet" if mark.offset == 0 else "inside"


def sender_of(row: Row, nouns: Callable[[str], str]) -> str:
    """Whose frame it is, as a subject; a damaged header names nobody. `nouns`: for a station, by protocol."""
    if isinstance(row.event, Frame) and row.event.damage is Damage.HEADER:
        return "bus"
    placement, header = row.placement, row.header
    source = placement.source if placement is not None else header.source if header is not None else None
    if source is not None:
        return f"{nouns(header.protocol) if header is not None else 'station'} {source}"
    role = placement.role if placement is not None else header.role if header is not None else Role.UNKNOWN
    return "master" if role in (Role.REQUEST, Role.BROADCAST) else "bus"
