"""Octets between frames: strays, remains, frames in pieces; whose they are, the frame to come tells. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from typing import NamedTuple

from dissectors.findings import Finding, Severity, as_consequence
from dissectors.frame import Event, Frame, Noise, Place
from dissectors.line import MS
from dissectors.manifest import Dissector
from sniff.analysis.line_rules import LINE_RULES
from sniff.analysis.remains import Remains
from sniff.analysis.sender_findings import BUS, MASTER, MOST_SENDERS, Senders
from sniff.analysis.stray_findings import strays_found
from sniff.analysis.torn_pieces import TornPieces
from sniff.analysis.unsure_strays import UnsureStrays
from sniff.engine.session import Session

STRAY_MOST = 3
"""So many octets that are no frame are stray ones; more are the remains of something."""

OUTWEIGHED = 20
"""So many octets in longer stretches for each stray one, and the strays are theirs."""

READ_LATE = MS
"""ns of slack over the adapter's latency that prove a late read (`sniff.engine.late_reads`)."""

_MOST_PENDING = 8


class _Stray(NamedTuple):
    """Stray octets beside a frame; `asker`: who had asked before them, where an answer was due; `asked`: whom; `joins`:
    they began where that frame ended."""

    no: int
    noise: Noise
    asker: str | None
    asked: str | None
    joins: bool

    def told(self, sender: str) -> tuple[str, str]:
        """Whose they are and by which rule, once `sender` has sent a frame.

        Who asks again had no answer, or none that can be told: they may be what there was of it, and are nobody's.
        """
        if self.asker is not None and sender in (self.asker, BUS):
            return BUS, "LN203"
        if self.noise.place is Place.AFTER and self.asker is not None:
            return self.asker, "LN202"
        return sender, "LN201"


class BetweenFrames:
    """Fed each frame, or runs of good ones, and each noise in between; counts at `senders` whose strays are known."""

    def __init__(self, session: Session, dissector: Dissector, senders: Senders) -> None:
        self._senders = senders
        self._latency = session.timing.latency
        self._remains = Remains(session)
        self._pieces = TornPieces(dissector, session.timing, STRAY_MOST)
        self._before_ok = True  # the newest frame
        self._asker: str | None = None  # who sent the newest frame, if that was a request
        self._called: str | None = None  # whom the newest frame was sent to
        self._awaited = 0  # strays away from frames, while an answer is due
        self._instead: Counter[str] = Counter()  # strays that came in place of an answer, by who was asked
        self._ahead: Counter[str] = Counter()  # strays apart from frames before an answer, by who gave it
        self._pending: list[_Stray] = []  # noise beside frames, of which the frame to come tells
        self._begins = UnsureStrays()  # noise that may be the begin of the frame to come

    def see_frame(self, sender: str, no: int, frame: Frame) -> None:
        """A frame came; `follow` says what it asks."""
        if frame.ok:
            self._pieces.forget()
        elif self._pieces.complete(frame.octets):
            self._take_torn(sender, no, frame)
        self._settle(sender, frame.slack)

    def see_good(self, first: str, slack: int) -> None:
        """Good frames came one behind the other, the first of them from `first`, read at most `slack` ns late."""
        self._pieces.forget()
        self._settle(first, slack)

    def follow(self, asker: str | None, called: str | None, ok: bool) -> None:
        """What comes now is behind a frame, good or not. `asker`: who sent it, if it was a request; `called`: to whom
        it was."""
        self._asker, self._called, self._before_ok = asker, called, ok

    def see_noise(self, no: int, noise: Noise) -> None:
        """Octets that are no frame."""
        if self._pieces.complete(noise.octets):  # behind the damaged begin, whose sender is known
            sender = BUS if self._before_ok or self._senders.before is None else self._senders.before
            self._take_torn(sender, no, noise)
            return
        of_damaged = noise.place is not Place.BETWEEN and not self._before_ok  # where a damaged frame ends nobody knows
        if len(noise.octets) > STRAY_MOST or of_damaged:
            self._remains.add(no, noise, None if self._asker is None else self._called)
            self._pieces.count_remains(len(noise.octets))
        elif noise.place is Place.BEFORE or (noise.place is Place.AFTER and self._asker is not None):
            self._pending.append(_Stray(no, noise, self._asker, self._called, self._senders.joins(noise)))
            del self._pending[:-_MOST_PENDING]
        elif noise.place is Place.AFTER and self._senders.before is not None:
            self._begins.add(self._senders, self._senders.before, "LN202", no, noise)
        else:
            self._awaited += self._asker is not None
            self._begins.add(self._senders, BUS, "LN203", no, noise)

    def found(self, octets: int, note_if: Callable[[int, int], Severity | None]) -> Iterator[Finding]:
        """Of `octets` that were heard in all. `note_if`: a note where so few of so many are not worth a warning."""
        rests = self._remains.found(octets, self._senders.by_name.keys() - {BUS, MASTER})
        for stray in strays_found(self._senders, self._instead, self._ahead, note_if):
            many = stray.code == "LN203" and stray.subject == BUS and self._remains.octets > OUTWEIGHED * stray.count
            is_part = rests is not None and rests.severity >= Severity.WARNING and many
            yield as_consequence(stray, rests, LINE_RULES) if rests is not None and is_part else stray
        if rests is not None:
            yield rests
        frames = {name: one.frames for name, one in self._senders.by_name.items() if name != BUS}
        yield from self._pieces.found(frames, MASTER)

    def _settle(self, sender: str, slack: int) -> None:
        """A frame has come, read at most `slack` ns late: what the octets before it were."""
        if slack <= self._latency + READ_LATE:
            for stray in self._pending:
                name, code = stray.told(sender)
                self._senders.stray(name, code, stray.no, stray.noise)
                if code == "LN203" and stray.joins and stray.asker is not None:
                    self._senders.of(stray.asker).joined.add(stray.no, stray.noise)
                self._count_instead(code == "LN203", stray.asked)
            if self._asker is not None and sender in (self._asker, BUS):  # as in `_Stray.told`
                self._count_instead(self._awaited, self._called)
            elif self._asker is not None and self._awaited and sender in self._senders.by_name:
                self._ahead[sender] += 1
            self._begins.forget()
            self._pending.clear()
        else:
            self._take_back()
        self._awaited = 0

    def _count_instead(self, count: int, asked: str | None) -> None:
        if count and asked is not None and (asked in self._instead or len(self._instead) < MOST_SENDERS):
            self._instead[asked] += count

    def _take_back(self) -> None:
        """They are what was read in time of a frame that was torn."""
        self._begins.take_back(self._senders)
        self._pending.clear()

    def _take_torn(self, sender: str, no: int, event: Event) -> None:
        """What came since the last good frame is one in pieces: neither strays nor octets that are no frame."""
        self._take_back()
        self._remains.take_back(self._pieces.remains)
        self._pieces.take(sender, event.start, no)
