"""NMEA 0183 as a dissector of sniff485.

    '$' talker(2) sentence(3) (',' field)… '*' check(2) CR LF      at most 82 octets; check: exclusive or, in hex

Rules: `$` begins a sentence, always. LF ends it, and so do 82 octets, or 1 s of silence. All else is noise.
"""

from __future__ import annotations

import re
from functools import reduce
from operator import xor
from typing import Any

from dissectors.frame import Check, Chunk, Damage, Event, Found, Frame, Header, Noise, Place, Reason, Role
from dissectors.framer import OctetWindow
from dissectors.line import Timing
from dissectors.manifest import Dissector
from dissectors.tracker import Placement, Tracked, Transaction, Verdict

LONGEST = 82
SILENCE = 1_000_000_000
SENTENCE = re.compile(rb"\$([A-Z]{2}[A-Z]{3})((?:,[ -)+-~]*)*)\*([0-9A-F]{2})\r\n")


def check_of(body: bytes) -> int:
    """The check over what stands between `$` and `*`."""
    return reduce(xor, body, 0)


class NmeaFramer:
    """Octets and times in, sentences and noise out."""

    protocol = "nmea"

    def __init__(self, timing: Timing) -> None:
        self._window = OctetWindow(timing)
        self._silence = max(SILENCE, 2 * timing.char)
        self._skipped = 0

    def feed(self, chunk: Chunk) -> list[Event]:
        """Take one read; give the events it completes, in order."""
        if not chunk.octets:
            return self.advance(chunk.time)
        events = self._hear(self._window.least_silence_before(chunk))
        self._window.append(chunk)
        return events + self._scan()

    def advance(self, now: int) -> list[Event]:
        """Say that no read returned up to `now` (ns); give what the silence completes."""
        return self._hear(self._window.least_silence_at(now))

    def close(self) -> list[Event]:
        """End of capture: give everything still held."""
        return [*self._scan(), *self._rest(Damage.SHORT)]

    def deadline(self) -> int | None:
        """When silence will mean something next (ns), or None when it never will."""
        return self._window.proves_silence(self._silence) if len(self._window) else None

    def _hear(self, silence: int | None) -> list[Event]:
        return self._rest(Damage.TIMEOUT) if silence is not None and silence >= self._silence else []

    def _scan(self) -> list[Event]:
        events: list[Event] = []
        octets = self._window.octets
        while octets:
            begin = octets.find(b"$")
            if begin:  # noise, held until something ends it, so that cuts of reads do not show
                count = min(begin if begin > 0 else len(octets), LONGEST)
                if begin < 0 and count < LONGEST:
                    break
                events.append(self._noise(count))
                continue
            again, end = octets.find(b"$", 1, LONGEST), octets.find(b"\n", 1, LONGEST)
            if again > 0 and not 0 < end < again:
                events.append(self._frame(again, Damage.RESTARTED))
            elif end > 0:
                events.append(self._frame(end + 1, None))
            elif len(octets) >= LONGEST:
                events.append(self._frame(LONGEST, Damage.LONG))
            else:
                break
        return events

    def _rest(self, damage: Damage) -> list[Event]:
        octets = self._window.octets
        if not octets:
            return []
        return [self._frame(len(octets), damage) if octets[:1] == b"$" else self._noise(len(octets))]

    def _noise(self, count: int) -> Noise:
        taken = self._window.take(count)
        self._skipped += count
        return Noise(taken.octets, taken.start, taken.end, Place.BETWEEN, Reason.NO_DELIMITER, taken.marks)

    def _frame(self, count: int, damage: Damage | None) -> Frame:
        taken = self._window.take(count)
        check = Check.ABSENT
        if damage is None:
            match = SENTENCE.fullmatch(taken.octets)
            if match is None:
                damage = Damage.FORM
            else:
                good = int(match[3], 16) == check_of(match[1] + match[2])
                check, damage = (Check.GOOD, None) if good else (Check.BAD, Damage.CHECK)
        skipped, self._skipped = self._skipped, 0
        return Frame(
            protocol=self.protocol,
            octets=taken.octets,
            start=taken.start,
            end=taken.end,
            check=check,
            found=Found.DELIMITER,
            damage=damage,
            skipped=skipped,
            slack=taken.slack,
            marks=taken.marks,
        )


class NmeaTracker:
    """Sentences are told to everybody; nobody answers."""

    def __init__(self, timing: Timing) -> None:
        self._tx = 0

    def track(self, no: int, event: Event, header: Header | None) -> Tracked:
        """Take the next event; `header` is None exactly for noise."""
        if header is None:
            return Tracked()
        self._tx += 1
        closed = Transaction(self._tx, None, header.kind, no, None, Verdict.DATA, event.start, event.end)
        return Tracked(Placement(no, self._tx, Role.DATA), (closed,))

    def advance(self, now: int) -> tuple[Transaction, ...]:
        """Nothing waits."""
        return ()

    def close(self) -> tuple[Transaction, ...]:
        """Nothing is open."""
        return ()


def peek(frame: Frame) -> Header:
    """The quick look: talker and sentence."""
    kind = frame.octets[1:6].decode("ascii", "replace").lower()
    error = None if frame.damage is None else frame.damage.value
    return Header("nmea", None, None, Role.DATA, kind if kind.isalpha() else "unknown", ok=frame.ok, error=error)


def text(frame: Frame, header: Header, role: Role) -> str:
    """One line for the frame list."""
    said = frame.octets.decode("ascii", "replace").strip()
    return "".join(c if c.isprintable() else "." for c in said)


def fields(frame: Frame, role: Role) -> dict[str, int | float | str]:
    """The sentence and its fields."""
    return {"nmea.sentence": peek(frame).kind}


def packet(frame: Frame, role: Role) -> Any:
    """No layout: the octets as they are."""
    from scapy.packet import Raw

    return Raw(frame.octets)


NMEA = Dissector("nmea", "NMEA 0183", NmeaFramer, peek, NmeaTracker, text, fields, packet, default_line="4800,8N1")
