"""Ready-made framers for plain protocols: frames between two delimiters, and frames that name their own length.

A protocol whose frames fit one of the two needs no framer of its own:

    framer = lambda timing: DelimitedFramer(timing, Delimited("nmea", b"$", b"\\n", longest=82, judge=judge))
    framer = lambda timing: LengthFramer(timing, Lengthy("mine", b"\\xaa", 4, length, longest=260, judge=judge))

Both obey the contract of `framer.py`. `judge(octets)` says of a stretch of the right form whether its check is good
and, if not, what is wrong; it must be total.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from dissectors.frame import Check, Chunk, Damage, Event, FoundBy, Frame, Noise, Place, Reason
from dissectors.framer import OctetWindow
from dissectors.line import Timing

SILENCE = 1_000_000_000
"""ns of silence that end whatever has begun, where a protocol names no other."""

Judge = Callable[[bytes], tuple[Check, Damage | None]]


@dataclass(frozen=True, slots=True)
class Delimited:
    """Frames that begin with one octet and end with one, neither of which can stand inside.

    `start`, `end`: one octet each. `longest`: most octets of a frame. `silence`: ns that end what has begun.
    """

    protocol: str
    start: bytes
    end: bytes
    longest: int
    judge: Judge
    silence: int = SILENCE


@dataclass(frozen=True, slots=True)
class Lengthy:
    """Frames that begin with a known octet and whose first octets tell how long they are.

    `start`: one octet. `header`: octets from which `length(octets)` tells the length of the whole frame, None where no
    frame begins so. `longest`: most octets of a frame. `silence`: ns that end what has begun.
    """

    protocol: str
    start: bytes
    header: int
    length: Callable[[bytes], int | None]
    longest: int
    judge: Judge
    silence: int = SILENCE


class PlainFramer:
    """What the two share: the window, silence, and giving out frames and noise."""

    def __init__(self, timing: Timing, protocol: str, silence: int) -> None:
        self.protocol = protocol
        self._window = OctetWindow(timing)
        self._silence = max(silence, 2 * timing.char)
        self._skipped = 0

    def feed(self, chunk: Chunk) -> list[Event]:
        """Take one read; give the events it completes, in order."""
        if not chunk.octets:
            return self.advance(chunk.time)
        events = self._hear(self._window.least_silence_before(chunk))
        self._window.append(chunk)
        return events + self._scan(last=False)

    def advance(self, now: int) -> list[Event]:
        """Say that no read returned up to `now` (ns); give what the silence completes."""
        return self._hear(self._window.least_silence_at(now))

    def close(self) -> list[Event]:
        """End of capture: give everything still held."""
        return self._scan(last=True)

    def deadline(self) -> int | None:
        """When silence will mean something next (ns), or None when it never will."""
        return self._window.proves_silence(self._silence) if len(self._window) else None

    def _hear(self, silence: int | None) -> list[Event]:
        return self._scan(last=True) if silence is not None and silence >= self._silence else []

    def _scan(self, last: bool) -> list[Event]:
        """Give all that is decided; with `last`, nothing more can come and all is given."""
        raise NotImplementedError

    def _noise_ahead(self, form: Delimited | Lengthy, last: bool) -> Noise | None:
        """What stands ahead of the next start; None where it is held until something ends it, so that cuts of reads do
        not show."""
        begin = self._window.octets.find(form.start)
        count = min(begin if begin > 0 else len(self._window.octets), form.longest)
        return None if begin < 0 and count < form.longest and not last else self._noise(count)

    def _noise(self, count: int, reason: Reason = Reason.NO_DELIMITER) -> Noise:
        taken = self._window.take(count)
        self._skipped += count
        return Noise(taken.octets, taken.start, taken.end, Place.BETWEEN, reason, taken.marks)

    def _frame(self, count: int, found: FoundBy, check: Check, damage: Damage | None, expected: int | None) -> Frame:
        taken = self._window.take(count)
        skipped, self._skipped = self._skipped, 0
        return Frame(
            protocol=self.protocol,
            octets=taken.octets,
            start=taken.start,
            end=taken.end,
            check=check,
            found=found,
            damage=damage,
            expected=expected,
            skipped=skipped,
            slack=taken.slack,
            marks=taken.marks,
        )


class DelimitedFramer(PlainFramer):
    """A start octet begins a frame, always; the end octet, too many octets or silence end it. All else is noise."""

    def __init__(self, timing: Timing, form: Delimited) -> None:
        super().__init__(timing, form.protocol, form.silence)
        self._form = form

    def _scan(self, last: bool) -> list[Event]:
        events: list[Event] = []
        octets, form = self._window.octets, self._form
        while octets:
            if not octets.startswith(form.start):
                if (noise := self._noise_ahead(form, last)) is None:
                    break
                events.append(noise)
                continue
            end, again = octets.find(form.end, 1, form.longest), octets.find(form.start, 1, form.longest)
            if again > 0 and not 0 < end < again:
                events.append(self._damaged(again, Damage.RESTARTED))
            elif end > 0:
                check, damage = form.judge(bytes(octets[: end + 1]))
                events.append(self._frame(end + 1, FoundBy.DELIMITER, check, damage, None))
            elif len(octets) >= form.longest:
                events.append(self._damaged(form.longest, Damage.LONG))
            elif last:
                events.append(self._damaged(len(octets), Damage.TIMEOUT))
            else:
                break
        return events

    def _damaged(self, count: int, damage: Damage) -> Frame:
        return self._frame(count, FoundBy.DELIMITER, Check.ABSENT, damage, None)


class LengthFramer(PlainFramer):
    """A start octet and a length that can be begin a frame. One whose check is bad is looked through for a good one
    that begins inside it: the start may have been an octet of something else."""

    def __init__(self, timing: Timing, form: Lengthy) -> None:
        super().__init__(timing, form.protocol, form.silence)
        self._form = form

    def _scan(self, last: bool) -> list[Event]:
        events: list[Event] = []
        octets, form = self._window.octets, self._form
        while octets:
            if not octets.startswith(form.start):
                if (noise := self._noise_ahead(form, last)) is None:
                    break
                events.append(noise)
                continue
            length = self._length(0)
            if length is None:  # the header is not complete
                if not last:
                    break
                events.append(self._damaged(len(octets), Damage.SHORT, None))
            elif not length:
                events.append(self._noise(1, Reason.FALSE_START))
            elif self._is_good(0, length):
                check, _ = form.judge(bytes(octets[:length]))
                events.append(self._frame(length, FoundBy.LENGTH, check, None, length))
            elif len(octets) < length and not last:
                break
            else:
                inside = self._good_inside(min(length, len(octets)), last)
                if inside is None:  # one that may be good is not complete yet
                    break
                events.append(self._broken(inside, length))
        return events

    def _broken(self, inside: int, length: int) -> Frame:
        """The damaged frame at the head; `inside`: where a good one begins in it, 0 where none does."""
        octets = self._window.octets
        if inside:
            return self._damaged(inside, Damage.RESTARTED, length)
        if len(octets) < length:
            return self._damaged(len(octets), Damage.SHORT, length)
        check, damage = self._form.judge(bytes(octets[:length]))
        return self._frame(length, FoundBy.LENGTH, check, damage or Damage.CHECK, length)

    def _good_inside(self, end: int, last: bool) -> int | None:
        """Where the first good frame begins among the octets 1 … end - 1; 0: nowhere; None: not decided yet."""
        octets = self._window.octets
        at = octets.find(self._form.start, 1, end)
        while at > 0:
            length = self._length(at)
            if length is None or (length and len(octets) < at + length):
                if not last:
                    return None
            elif length and self._is_good(at, length):
                return at
            at = octets.find(self._form.start, at + 1, end)
        return 0

    def _length(self, at: int) -> int | None:
        """Length of the frame that begins at `at`: 0 where none can, None where its header is not complete."""
        header = bytes(self._window.octets[at : at + self._form.header])
        if len(header) < self._form.header:
            return None
        length = self._form.length(header)
        return length if length is not None and self._form.header <= length <= self._form.longest else 0

    def _is_good(self, at: int, length: int) -> bool:
        stretch = bytes(self._window.octets[at : at + length])
        return len(stretch) == length and self._form.judge(stretch) == (Check.GOOD, None)

    def _damaged(self, count: int, damage: Damage, expected: int | None) -> Frame:
        return self._frame(count, FoundBy.LENGTH, Check.ABSENT, damage, expected)
