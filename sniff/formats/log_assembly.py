"""Lines of a log to reads of a capture: what several lines tell of one is put together, each with its time. Pure."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import replace

from dissectors.checksums import ends_with_crc16
from dissectors.frame import Chunk
from dissectors.line import MS, LineSettings
from sniff.engine.session import Item, LineEvent, LineEventKind
from sniff.formats.dump_rows import FILLED_UP, SAME_ROWS
from sniff.formats.log_calendar import Calendar, turn
from sniff.formats.log_clock import Stamp
from sniff.formats.log_lines import Kind, Line, head_of
from sniff.formats.log_packets import carried
from sniff.formats.log_placing import Placing
from sniff.formats.log_plan import WINDOW, Plan
from sniff.formats.log_shapes import Role
from sniff.formats.table_cells import MOST
from sniff.formats.timeless import LINE_END, SLOW

COARSE = 2 * MS
"""A clock that counts so, or in longer steps, does not tell which octets came together."""

LONGEST = 4096
"""Octets put together from several lines; what goes on after them is the next read, without a silence."""

_SENT = re.compile(r"\bsent\b", re.IGNORECASE)
_MOST_REPEATED = 1 << 16
_LARGEST = 1 << 32
"""Octets that rows alike stand for; more is no file that somebody dumped."""


class Assembly:
    """Lines in, reads out. `was`: what the line taken last turned out to be. `completed`: reads that the tool tells
    without their check, which was put behind them; `unwrapped`: packets of a network that they were taken out of.
    """

    def __init__(self, plan: Plan, line: LineSettings) -> None:
        self.was = Kind.EMPTY
        self._plan = plan
        self._char, self._own_char = max(line.char, SLOW.char), line.char
        self._bit = 1_000_000_000 / line.baud
        self._recent = b""
        self._last = 0
        self._any = self._clocked = False  # whether anything was told, and whether with a time
        self._told_last: int | None = None
        self._placing = Placing()
        self._first: Line | None = None  # of two that are the same
        self._shift = 0
        self._calendar = Calendar(plan.times.steps)
        self._held = bytearray()
        self._stamp: Stamp | None = None
        self._samples: tuple[int, int] | None = None
        self._annotated: tuple[tuple[int, int] | None, bytes] = (None, b"")
        self._way = ""
        self._glued = False  # whether what is held follows what was given without a silence
        self._heading: Line | None = None
        self._used = False  # whether octets came below it
        self._is_used_again = False  # whether its time, which is that of others, is all that is known
        self._expected = 0  # offset of the next row
        self._squeezed = False
        self._row = b""
        self._goes_on = False
        self._family = ""  # of what is held
        self._again = ""  # the label of what is held, where it may come again with more behind
        self._is_repeated = False  # whether the rows below tell what others told
        self._whole: Callable[[bytes], bytes] | None = None
        self._above = ""  # what stands above the rows that are held
        self._message_last = "", b""  # the same of what was given last, and that
        self.completed = 0
        self.unwrapped = 0

    @property
    def has_time(self) -> bool:
        """Whether the read given last had a time of its own."""
        return self._placing.has_time

    def take(self, line: Line, text: str) -> Iterator[Item]:
        """Take a line; `text` as it is written."""
        self.was = line.kind if line.kind is not Kind.STRANGE or self._could_be(line, text) else Kind.TEXT
        if line.kind is Kind.ROW:
            self.was = Kind.OCTETS
            if self._is_repeated:
                self.was = Kind.SHAPE
            else:
                yield from self._take_row(line)
        elif self._plan.offsets is not None:
            yield from self._between_rows(line, text)
        elif line.kind is Kind.OCTETS:
            yield from self._take_octets(line)
        elif line.role is Role.AGAIN:
            self._again = self._family
        elif (line.kind is Kind.SHAPE and line.role is Role.HEADING) or (
            line.kind is Kind.TEXT and (line.stamp is not None or line.way)
        ):
            if not self._again:
                yield from self._flush()
            self._head(line)
        elif self._again:
            return
        elif line.kind is Kind.EMPTY and not self._plan.octetwise:
            yield from self._flush()

    def _could_be(self, line: Line, text: str) -> bool:
        """Whether a line that cannot be read could be one of those that are: it is written as they are."""
        return bool(line.tool) or self._plan.spellings != frozenset(("0x and digits",)) or text.count("0x") > 1

    def _head(self, line: Line) -> None:
        """A line that says something of the octets below; two of them may stand above one another."""
        before = self._heading.stamp if self._heading is not None and not self._used else None
        if before is not None and (line.stamp is None or (before.dated and not line.stamp.dated)):
            line = replace(line, stamp=before)
        self._heading, self._used = line, False

    def close(self) -> Iterator[Item]:
        """What is held at the end."""
        yield from self._flush()
        yield from self._placing.close()

    # -- lines ---------------------------------------------------------------------------------------------------

    def _take_octets(self, line: Line) -> Iterator[Item]:
        role = self._plan.role(line, self._recent)
        is_annotation = line.samples is not None and line.samples[1] > line.samples[0]
        if is_annotation and (line.samples, line.octets) == self._annotated:
            role = Role.SAME  # one line that was decoded as two
        self._annotated = line.samples, line.octets
        if line.spelling == "one octet" and not line.tool and not self._plan.octetwise and role is not Role.SAME:
            is_below = self._heading is not None and not self._used and not self._plan.labelled
            is_more = bool(self._plan.width or self._goes_on or self._held)
            role = role if not line.bare or is_more or is_below else Role.NOTHING
        if role is Role.DATA and (line.family, line.way) in self._plan.doubled:
            is_second, self._first = line == self._first, line if line != self._first else None
            role = Role.SAME if is_second else role
        if role is Role.SAME:
            self.was = Kind.SHAPE
            return
        if role is not Role.DATA:
            self.was = Kind.STRANGE if role is None and line.spelling in self._plan.spellings else Kind.TEXT
            if line.spelling == "one octet" and not line.bare and (line.stamp is not None or line.way):
                self.was = Kind.TEXT  # the length of what stands below
                yield from self._flush()
                self._head(line)
            return
        if line.broken:  # what is left of it would be taken for a frame
            self.was = Kind.STRANGE
            yield from self._flush()
            return
        if line.cut:
            self.was = Kind.STRANGE
        elif line.whole is not None and (octets := line.whole(line.octets)) != line.octets:
            line = replace(line, octets=octets)
            self.completed += 1
        if self._again and line.family == self._again and line.octets.startswith(bytes(self._held)):
            self._begin(line, line.way)
        elif self._joins(line):
            self._held += line.octets
        else:
            yield from self._flush()
            self._begin(line, line.way)
        self._family = line.family
        self._again = line.family if line.family in self._plan.growing else ""
        self._goes_on = line.goes_on
        self._recent = (self._recent + line.octets)[-WINDOW:]
        for way, octets in line.more:
            yield from self._flush()
            self._begin(replace(line, octets=octets, samples=None), way)
            self._recent = (self._recent + octets)[-WINDOW:]
        if len(self._held) >= LONGEST:
            yield from self._flush()
            self._glued = True

    def _joins(self, line: Line) -> bool:
        """Whether a line goes on with what is held."""
        if not self._held or line.samples is not None:
            return False
        if self._goes_on:
            return line.stamp is None and line.bare
        if line.stamp is not None and line.way and self._stamp is not None and line.stamp.tick < COARSE:
            before = 0 if self._plan.times.steps else self._stamp.time
            same = (line.stamp.time, line.way, line.family) == (before, self._way, self._family)
            return same and not ends_with_crc16(bytes(self._held))  # what one read brought in two pieces
        if self._plan.octetwise and len(line.octets) == 1:
            return line.stamp is None and line.way == self._way
        if not line.bare or line.stamp is not None:
            return False
        if self._plan.width is None and ends_with_crc16(bytes(self._held)):
            return False  # a message that is whole
        return self._heading is not None or self._plan.width is not None or bool(self._way) or self._plan.directed

    def _begin(self, line: Line, way: str) -> None:
        heading = self._heading
        self._held = bytearray(line.octets)
        self._samples = line.samples
        self._stamp, self._is_used_again = line.stamp, False
        self._way = way
        if line.stamp is None and heading is not None and (line.bare or not self._used):
            self._stamp, self._way = heading.stamp, way or heading.way
            self._is_used_again, self._used = self._used, True

    # -- rows of a hexdump -----------------------------------------------------------------------------------------

    def _take_row(self, line: Line) -> Iterator[Item]:
        try:
            offset = int(line.offset, self._plan.offsets or 16)
        except ValueError:
            self.was = Kind.STRANGE
            return
        if self._squeezed and self._expected < offset <= self._expected + _LARGEST and self._row:
            missing = offset - self._expected
            filled = min(missing, _MOST_REPEATED)
            self._held += (self._row * (filled // len(self._row) + 1))[:filled]
            self._expected = offset
            if filled < missing:
                yield from self._flush()
                yield LineEvent(self._last, LineEventKind.DROPPED, "too many rows alike", missing - filled)
        self._squeezed = False
        if not line.octets:  # the offset at the end
            most = len(self._row) if self._plan.margin.writing.cells in FILLED_UP else 2
            if 0 < self._expected - offset < most and self._held:
                del self._held[offset - self._expected :]  # what filled the last word or row up
            return
        goes_on = offset == self._expected and offset > 0 and self._is_at_once(line.stamp)
        if not goes_on and (offset != self._expected or (offset == 0 and self._held) or line.stamp is not None):
            yield from self._flush()
            self._expected = offset
        if not self._held:
            stamp, glued = line.stamp, self._glued
            self._is_used_again = stamp is None and self._used
            if stamp is None and self._heading is not None:
                stamp, self._used = self._heading.stamp, True
            self._stamp, self._glued, self._samples = stamp, glued, None
        self._held += line.octets
        self._row = line.octets
        self._expected += len(line.octets)
        if len(self._held) >= LONGEST:
            yield from self._flush()
            self._glued = True

    def _is_at_once(self, stamp: Stamp | None) -> bool:
        """Whether a row came with the first of its block: a tool that stamps each row of one message."""
        first = self._stamp
        return bool(self._held) and stamp is not None and first is not None and abs(stamp.time - first.time) < COARSE

    def _between_rows(self, line: Line, text: str) -> Iterator[Item]:
        if text.strip() == SAME_ROWS:
            self._squeezed = True
            self.was = Kind.SHAPE
            return
        if line.kind is Kind.OCTETS:
            is_row = line.broken and (line.bare or not line.stamp)
            self.was = Kind.STRANGE if (line.bare and not line.stamp) or is_row else Kind.TEXT
        elif line.kind is Kind.STRANGE and line.stamp is not None:
            self.was = Kind.TEXT  # what stands above rows: a number, a time, a length
        if line.kind is not Kind.REMARK:
            yield from self._flush()
            self._expected = 0
        if line.kind not in (Kind.REMARK, Kind.EMPTY):
            self._is_repeated = bool(self._plan.heads) and head_of(self._plan.margin.without(text)) in self._plan.heads
            self._whole = line.whole
        if line.kind is Kind.SHAPE and line.role is Role.HEADING:
            self._above = head_of(text)
        if line.stamp is not None:
            self._head(line)

    # -- times -----------------------------------------------------------------------------------------------------

    def _flush(self) -> Iterator[Item]:
        if not self._held:
            return
        octets = bytes(self._held)
        self._held.clear()
        if self._plan.offsets is not None:
            inside = carried(octets)
            self.unwrapped += inside != octets
            octets = inside
        if not octets:
            return
        if self._whole is not None and self._whole(octets) != octets:
            octets = self._whole(octets)
            if not octets or self._was_told(octets):
                return
            self.completed += 1
        self._message_last = self._above, octets
        length = len(octets) * (self._own_char if self._glued else self._char)  # no silence, however fast the line
        silence = 0 if self._glued or self._plan.width is not None else LINE_END
        self._glued = False
        if len(octets) == 1 and self._plan.octetwise and self._clocked:
            silence = 0
        time = self._last + length + (silence if self._any else 0)
        is_told, by = not self._plan.timed, None
        has_time = (self._stamp is not None and not self._is_used_again) or self._samples is not None
        if self._samples is not None and self._plan.bit_samples:
            ended = (self._samples[1] + self._plan.bit_samples) / self._plan.bit_samples * self._bit
            time, is_told = max(self._last, length, int(ended)) if ended < MOST else time, True
        elif self._stamp is not None:
            told, turned = self._calendar.time_of(self._stamp)
            if turned and self._clocked:
                yield from self._placing.close()
                yield turn(self._placing.last, turned)
            told += self._shift
            if not self._clocked:
                lead = self._last + LINE_END if self._any else 0  # of what stands ahead of the first time
                self._shift = max(0, length + lead - told)  # counted from a trigger, or since the last line
                told += self._shift  # no time before 1970
            told = told if 0 <= told < MOST else time  # steps that add up to no time
            is_told = told != self._told_last
            by = told + self._stamp.tick if has_time else None
            time = told if is_told else time
            self._told_last, self._clocked = told, True
        self._last, self._any = time, True
        chunk = Chunk(time, octets)
        if is_told:
            yield from self._placing.told(chunk, self._char, has_time)
        else:
            yield from self._placing.untold(chunk, by, has_time)

    def _was_told(self, octets: bytes) -> bool:
        """Whether a message that was completed is the one before, which the tool heard and now tells otherwise."""
        above, before = self._message_last
        return octets == before and above != self._above and not _SENT.search(f"{above} {self._above}")
