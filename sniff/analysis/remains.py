"""Octets that are no frame, in longer stretches: how many, and what else they may be. Pure, bounded."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence, Set
from dataclasses import replace
from typing import Final

from dissectors.findings import Finding, Severity, Tally, counted
from dissectors.frame import Chunk, Noise
from dissectors.words import duration, percent
from sniff.analysis.line_rules import LINE_RULES as RULES
from sniff.analysis.other_settings import SAMPLE_OCTETS, Fit, other_protocol
from sniff.analysis.sender_findings import BUS
from sniff.analysis.slower_bus import slower_by
from sniff.analysis.stray_findings import INSTEAD, INSTEAD_LEAST
from sniff.engine.session import Session

MOST_KEPT: Final = 16
"""Stretches that are asked what they may be."""

MORE_THAN_REMAINS: Final = 0.3
"""Of all octets; so much is no mere remains of somebody's damaged frames."""

WITHOUT_END: Final = 2048
"""Octets one behind the other that are longer than any frame, whose head was damaged."""

_FILLED: Final = 0.9
"""The part of the time that they fill at least."""

_WHO_SPEAKS_IT: Final = (
    "which device still speaks the other protocol: its protocol setting; it does not belong on this line"
)


class Remains:
    """Fed such stretches. `octets`: how many in all."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._tally = Tally()
        self.octets = 0
        self._first: list[bytes] = []
        self._sample: list[Chunk] = []  # the same, to ask what else they may be
        self._sampled = 0
        self._fit: tuple[int, Fit | None] = (0, None)  # asked when so many octets were sampled
        self._instead: Counter[str] = Counter()  # by whose answers were due
        self._run = (0, 0, 0)  # octets one behind the other up to now, since when and until when, ns
        self._longest = (0, 0)  # of all such: octets, ns

    def add(self, no: int, noise: Noise, asked: str | None = None) -> None:
        """Take the next one; `asked`: whose answer was due."""
        self._tally.add(noise.start, no)
        if asked is not None and (asked in self._instead or len(self._instead) < MOST_KEPT):
            self._instead[asked] += 1
        self.octets += len(noise.octets)
        self._go_on(noise)
        if len(self._first) < MOST_KEPT and len(noise.octets) <= 300:
            self._first.append(noise.octets)
        if self._sampled < SAMPLE_OCTETS:
            self._sample.append(Chunk(noise.end, noise.octets[:SAMPLE_OCTETS], noise.marks))
            self._sampled += len(noise.octets)

    def _go_on(self, noise: Noise) -> None:
        """Whether it is directly behind the stretch before it, as far as the adapter tells."""
        octets, begin, end = self._run
        if not octets or noise.start - end > 2 * self._session.line.char + self._session.adapter.latency:
            octets, begin = 0, noise.start
        octets += len(noise.octets)
        self._run = octets, begin, noise.end
        if octets > self._longest[0] and octets * self._session.line.char >= _FILLED * (noise.end - begin):
            self._longest = octets, noise.end - begin

    def take_back(self, newest: Sequence[int]) -> None:
        """Count the newest ones no more, of so many octets each: they are pieces of a frame."""
        self._tally.count -= len(newest)
        self.octets -= sum(newest)

    def found(self, of_all: int, heard: Set[str] = frozenset()) -> Finding | None:
        """What there is to say so far. `of_all`: octets that were heard; `heard`: stations that sent frames."""
        if not self._tally.count:
            return None
        share = self.octets / of_all
        stretches = counted(self._tally.count, "stretch", "stretches")
        are = "is" if self.octets == 1 else "are"
        words, (name, count) = (
            f"{counted(self.octets, 'octet')} in {stretches} {are} no frame, {percent(share)} of all",
            self._of_one(heard),
        )
        words += f", {count} of them in place of its answers" if count else ""
        severity = None if share >= 0.02 and self._tally.count > 1 else Severity.NOTE
        finding = self._told(self._tally.found(RULES["LN204"], name, words, severity), share)
        return replace(finding, is_told_apart=True) if share >= MORE_THAN_REMAINS else finding

    def _of_one(self, heard: Set[str]) -> tuple[str, int]:
        """In place of whose answers they stand and how many, where nearly all are one's; else the bus's.

        Of that one no frame is heard, though of others.
        """
        ((name, count),) = self._instead.most_common(1) or (("", 0),)
        if not heard or name in heard or count < max(INSTEAD_LEAST, INSTEAD * self._tally.count):
            return BUS, 0
        return name, count

    def _told(self, finding: Finding, share: float) -> Finding:
        """With what the stretches have in common. `share`: of all octets, that they are."""
        rests, line = self._first, self._session.line
        same, often = Counter(rests).most_common(1)[0] if rests else (b"", 0)
        if often >= 3 and 2 * often >= len(rests):
            how_often = f"{often} times" if self._tally.count <= len(rests) else f"in {often} of {len(rests)} compared"
            words = f"{finding.seen}; the same {counted(len(same), 'octet')} {how_often} ({same[:8].hex(' ').upper()}"
            finding = replace(finding, seen=words + (" …)" if len(same) > 8 else ")"))
        if rests and not b"".join(rests).strip(b"\xff") and finding.subject == BUS:
            return replace(
                finding,
                severity=min(finding.severity, Severity.NOTE),
                means="a preamble: some makers' stations settle so who answers a search; or a driver that is switched "
                "on long before its frame",
                next="nothing, where the frames behind them are good",
            )
        fit = self._other_protocol()
        if fit is not None:
            means = fit.means if fit.of_network else f"another protocol on the same line: {fit.means}"
            settle = fit.next if fit.of_network else _WHO_SPEAKS_IT
            return replace(finding, seen=f"{finding.seen}; {fit.seen}", means=means, next=settle, is_told_apart=True)
        factor = slower_by(rests, line)
        if not factor:
            return self._without_end(finding) if share < 0.5 else finding  # else nothing can be read here
        rate = f"{factor} times slower" if factor < 12 else "over 10 times slower"
        rate += f", at about {line.baud // factor} Bd" if factor < 12 and not self._session.line_is_assumed else ""
        return replace(
            finding,
            seen=f"{finding.seen}; every level in them lasts a multiple of {factor} bits: they were sent {rate}",
            means="a device that speaks with another baud rate, by its own protocol or by a wrong setting",
            next="which station answers so: its baud rate and protocol; two stations with one address look otherwise",
            is_told_apart=True,
        )

    def _without_end(self, finding: Finding) -> Finding:
        """Where they are longer than any frame, that somebody does not stop."""
        octets, lasted = self._longest
        if octets < WITHOUT_END or not self._session.has_times:
            return finding
        return replace(
            finding,
            seen=f"{finding.seen}; up to {octets} one behind the other, for {duration(lasted)}, longer than any frame",
            means="somebody sends and does not stop: a driver that is stuck, a device that starts, crashed or prints "
            "its log on this port; nobody else can speak meanwhile",
            next="what restarted or was plugged in at that time; while it lasts, take the stations off one by one",
        )

    def _other_protocol(self) -> Fit | None:
        """What the stretches are; asked again when there are twice as many octets."""
        asked, fit = self._fit
        if self._sampled >= 2 * asked or (asked < self._sampled >= SAMPLE_OCTETS):
            session = self._session
            fit = other_protocol(self._sample, session.line, session.adapter.latency, session.protocol)
            self._fit = self._sampled, fit
        return fit
