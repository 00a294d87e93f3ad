"""Byte logs of other tools, read line by line: what a person finds on his disk from before he had this program.

A line is taken apart into a time, a direction and octets, wherever they stand and however they are written
(`log_clock.py`, `log_spellings.py`, `log_shapes.py` list how; `log_lines.py` does it). What the lines of one log mean,
of which some repeat others, is told by its first lines together (`log_plan.py`). Tables (CSV) are read by their
headings (`table_heading.py`).

Neither line settings nor protocol are in such a file. Times of logs are those of another program, taken as the end of
the last octet of a line; `FOREIGN_LATENCY` is assumed, or what the clock of the log leaves open if that is more. Where
there are no times, or times to the second, octets are back to back with LINE_END after each line: the line is a limit
of a frame, but not one that could not be doubted. Exact are tables that have the begin of each octet, one in a row.

Lines of other text are passed over. Lines that look like octets and are not understood are counted, and too many of
them are an error, raised when all that was understood has been given.
"""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from heapq import merge
from itertools import chain, islice, zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from dissectors.findings import counted
from dissectors.frame import Chunk
from dissectors.line import MS
from sniff.engine.capture import CaptureError
from sniff.engine.session import NO_TIMES, Adapter, Completeness, Item, LineEvent, Session
from sniff.formats.contents import utf16_of
from sniff.formats.files import explain, open_capture
from sniff.formats.log_assembly import Assembly
from sniff.formats.log_calendar import carried_on, turn
from sniff.formats.log_lines import Kind
from sniff.formats.log_margin import plain_signs
from sniff.formats.log_pieces import lines_in, rows_in
from sniff.formats.log_plan import LOOKED_AT, LOOKED_AT_CHARACTERS, Plan, plan_of
from sniff.formats.log_shapes import DECODED, REMARK
from sniff.formats.log_untimed import unknown_by
from sniff.formats.octet_table import TableLayout
from sniff.formats.records import foreign_session
from sniff.formats.set_back_clock import in_order
from sniff.formats.table_heading import delimiter_of, heading_of
from sniff.formats.timeless import LINE_END, SLOW

if TYPE_CHECKING:
    from sniff.engine.blocks import Block

MOST_ROWS = 5_000_000
"""Of a table, which is held in memory whole to be sorted: 140 octets of it a row."""

MOST_STRANGE = 0.2
"""Share of lines that are not understood, of those that tell octets, from which on a log is not read."""

_SAYS = 30
"""Lines by which such a text is told."""

_NUMBER_COLUMN = re.compile(r"\s*[\"']?#[\"']?\s*[,;\t|]")
"""The first heading of a table that numbers its rows, which is no remark."""

_RULED = re.compile(r"[\s+|:=-]*")
"""What stands between the rows of a table that is drawn."""

_FALLING, _FALLS_LEAST = 4, 8
"""Times that go back for one that goes on, and how many at least, where the newest line stands first."""

FINE = MS // 100
"""ns: who counts times in less of them may be as exact as any."""

TIMELESS = 50 * MS
"""What may lie between two octets of one frame where there are no times: LINE_END, and what a faster line leaves of so
many octets as most lines have; more where a line is longer."""

KNOWN = (
    "lines of pairs, numbers, 0x.., [..], \\x.. or characters, with and without times and directions; hexdumps; "
    "tables with headings"
)


def read(path: Path) -> ByteLog:
    """Open a byte log. Raises CaptureError when no line of it tells octets."""
    return ByteLog(path)


class ByteLog:
    """A byte log as a capture."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._counts = _Counts()
        lines = list(_first(self._lines()))
        start = "\n".join(lines[:_SAYS])
        for written, what, instead in DECODED:
            if written.search(start) is not None:
                raise CaptureError(f"{path}: {what}; give this program {instead}")
        self._heading = _heading(lines)
        self._plan: Plan | None = None
        if self._heading is None:
            self._plan = plan_of(lines)
            if self._plan is None:
                raise CaptureError(
                    f"{path}{_first_written(lines)}: no byte log that this program reads; it knows {KNOWN}"
                )
        self.kind = "CSV" if self._plan is None else self._plan.kind
        session = foreign_session(str(path), None, 0, f"{self.kind} log")
        self.session: Session = session
        first = self._first()
        adapter = session.adapter
        if self._heading is not None:
            table = self._heading[1]
            exact = Adapter("logic analyser", latency_from="exact times")
            adapter = _as_coarse(exact if table.is_measured else adapter, table.tick)
        elif self._plan is not None:
            adapter = self._adapter(lines, adapter)
        self.session = replace(session, started=first.time if first is not None else 0, adapter=adapter)

    def items(self) -> Iterator[Item]:
        """The octets in the order of the file, those of a table in order of time. Raises CaptureError, at the end when
        too many lines were not understood.
        """
        self._counts = _Counts()
        give: Callable[[], Iterator[Item]] = self._table if self._plan is None else self._text
        yield from give()
        counts = self._counts
        if counts.strange > 1 and counts.strange > MOST_STRANGE * counts.data:
            raise CaptureError(f"{self.path}:{counts.first}: {self._strange_words()}")

    def blocks(self) -> Iterator[Block | LineEvent]:
        """The same as columns. Raises CaptureError."""
        from sniff.engine.blocks import blocks_of

        return blocks_of(self.items())

    def completeness(self) -> Completeness:
        """Whether every line was understood, as far as `items` has read; a text has no end mark."""
        counts = self._counts
        if counts.strange:
            return Completeness(False, f"{self._strange_words()}, the first is line {counts.first} ({self.kind} log)")
        said = [f"{self.kind} log"]
        if counts.same:
            repeats = "repeats" if counts.same == 1 else "repeat"
            said.append(f"{counted(counts.same, 'line')} that {repeats} others passed over")
        if counts.completed:
            many, whose = counted(counts.completed, "message"), "its" if counts.completed == 1 else "their"
            said.append(f"{many} that the tool writes without {whose} check completed with it")
        if counts.unwrapped:
            said.append(f"taken out of {counted(counts.unwrapped, 'packet')} of a network")
        said += self._times_said()
        said += [f"{counted(counts.text, 'line')} of other text passed over"] if counts.text else []
        return Completeness(True, f"complete ({'; '.join(said)})")

    def _times_said(self) -> tuple[str, ...]:
        """What was assumed of the times."""
        if self._plan is not None:
            return self._plan.times.said
        return self._heading[1].times.said if self._heading is not None else ()

    def _strange_words(self) -> str:
        many = self._counts.strange
        return "1 line was not understood" if many == 1 else f"{many} lines were not understood"

    def _first(self) -> Chunk | None:
        """The first read; of a log that is damaged as a whole, too."""
        try:
            return next((item for item in self.items() if isinstance(item, Chunk)), None)
        except CaptureError:
            if self._heading is not None and not self._counts.data:
                return None
            raise

    def _adapter(self, lines: list[str], adapter: Adapter) -> Adapter:
        assert self._plan is not None
        read = list(map(self._plan.line, self._plan.margin.joined(lines)))
        stamps = [line.stamp for line in read if line.stamp is not None]
        order = _Order()
        for stamp in stamps:
            order.add(stamp.time)
        if order.falls >= _FALLS_LEAST and order.is_newest_first and any(one.dated or one.daily for one in stamps):
            raise CaptureError(f"{self.path}: its times go back from line to line: newest first; turn it (`tac`)")
        unknown = unknown_by(self._told(lines))
        if not stamps or unknown is None:
            longest = LINE_END + max((len(line.octets) for line in read), default=0) * SLOW.char
            return replace(adapter, latency=max(TIMELESS, longest), latency_from=NO_TIMES)
        if unknown > adapter.latency:
            return replace(adapter, latency=unknown, latency_from="lines without a time, between others that have one")
        return _as_coarse(adapter, min(stamp.tick for stamp in stamps))

    def _told(self, lines: list[str]) -> list[tuple[int, bool]]:
        """When each of the first reads came, and whether the log says so."""
        assert self._plan is not None
        assembly = Assembly(self._plan, self.session.line)
        lines = list(self._plan.margin.joined(lines))
        taken = chain.from_iterable(assembly.take(self._plan.line(text), text) for text in lines)
        return [(item.time, assembly.has_time) for item in chain(taken, assembly.close()) if isinstance(item, Chunk)]

    def _lines(self, split: Callable[[Iterator[str]], Iterator[str]] = lines_in) -> Iterator[str]:
        with open_capture(self.path) as stream:
            try:
                start = stream.read(1 << 12)
                stream.seek(0)
                yield from split(_decoded(stream, utf16_of(start) or "utf-8"))
            except OSError as error:
                raise explain(self.path, error) from None

    def _text(self) -> Iterator[Item]:
        assert self._plan is not None
        counts = self._counts
        assembly = Assembly(self._plan, self.session.line)
        try:
            for number, text in enumerate(self._plan.margin.joined(self._lines()), 1):
                line = self._plan.line(text)
                yield from assembly.take(line, text)
                counts.add(assembly.was, line.kind, number)
        except CaptureError:  # a file that ends in damage gives what is before it
            yield from assembly.close()
            raise
        yield from assembly.close()
        counts.completed, counts.unwrapped = assembly.completed, assembly.unwrapped

    def _table(self) -> Iterator[Item]:
        assert self._heading is not None
        at, table = self._heading
        rows = csv.reader(map(plain_signs, islice(self._lines(rows_in), at, None)), delimiter=table.delimiter)
        next(rows, None)
        found: list[Chunk] = []
        char, order = self.session.line.char, _Order()
        for row in _each(rows):
            if row is None:
                self._counts.pass_over(at + rows.line_num)
                continue
            if not any(row):
                continue
            if len(found) >= MOST_ROWS:
                raise CaptureError(f"{self.path}: a table of over {MOST_ROWS} rows; cut it into pieces")
            if not table.holds(row) or all(_RULED.fullmatch(cell) for cell in row):
                self._counts.text += 1
                continue
            if found and (more := table.more(row)):
                found[-1] = replace(found[-1], octets=found[-1].octets + more)
                self._counts.data += 1
                continue
            try:
                told = list(table.chunks(row, char))
                order.add(told[0].time - len(told[0].octets) * char * table.exact)
                found += told
                self._counts.data += 1
            except ValueError:
                self._counts.pass_over(at + rows.line_num)
        if order.is_newest_first:
            found.reverse()
        turns: list[Item] = []
        if table.daily or table.local:
            times = carried_on([chunk.time for chunk in found], table.daily, table.local)
            for at, (time, turned) in enumerate(times):
                turns += [turn(found[at - 1].time, turned)] if turned else []
                found[at] = found[at] if found[at].time == time else replace(found[at], time=time)
        first = min((chunk.time - len(chunk.octets) * char for chunk in found), default=0)
        if first < 0:  # counted from a trigger: no time is before 1970
            found = [replace(chunk, time=chunk.time - first) for chunk in found]

        def begin(chunk: Chunk) -> int:
            return chunk.time - len(chunk.octets) * char

        has_begin = table.exact and table.duration is None
        items = list(in_order(found, char, begin if has_begin else lambda chunk: chunk.time))
        read = [item for item in items if isinstance(item, Chunk)]  # two lines of a bus, one after another
        turns += [item for item in items if isinstance(item, LineEvent)]
        yield from merge(_one_after_another(read, begin) if has_begin else read, turns, key=lambda item: item.time)


def _one_after_another(read: list[Chunk], begin: Callable[[Chunk], int]) -> Iterator[Chunk]:
    """Reads in the order of their begin, which is told; nobody knows how fast the line was: one of several octets ends
    before the next begins, and after what began with it."""
    last = 0
    for chunk, after in zip_longest(read, map(begin, read[1:])):
        time = chunk.time
        if len(chunk.octets) > 1:
            if after is not None and after > begin(chunk):
                time = min(time, max(after - LINE_END, (begin(chunk) + after) // 2))
            if begin(chunk) < last:
                time = last + LINE_END + chunk.time - begin(chunk)
        last = max(last, time)
        yield chunk if last == chunk.time else replace(chunk, time=last)


def _as_coarse(adapter: Adapter, tick: int) -> Adapter:
    """The adapter with no more certainty than a clock has that counts so many ns."""
    if tick <= max(adapter.latency, FINE):
        return adapter
    return replace(adapter, latency=tick, latency_from=f"the log's clock, which counts {tick / MS:g} ms")


def _each(rows: Iterator[list[str]]) -> Iterator[list[str] | None]:
    """The rows of a table; None for one that is none: a field that never ends, a zero octet."""
    while True:
        try:
            yield next(rows)
        except csv.Error:
            yield None
        except StopIteration:
            return


class _Order:
    """How often times go on and back from one to the next."""

    def __init__(self) -> None:
        self.rises = self.falls = 0
        self._before: int | None = None

    def add(self, time: int) -> None:
        """The next."""
        if self._before is not None:
            self.rises += time > self._before
            self.falls += time < self._before
        self._before = time

    @property
    def is_newest_first(self) -> bool:
        """Whether they go back nearly always."""
        return self.falls > _FALLING * self.rises


class _Counts:
    """Lines of a log, by what became of them. `first`: number of the first that was not understood."""

    def __init__(self) -> None:
        self.data = self.same = self.text = self.strange = self.first = self.completed = 0
        self.unwrapped = 0

    def add(self, was: Kind, kind: Kind, number: int) -> None:
        """Count a line. `was`: what it turned out to be."""
        if was is Kind.OCTETS:
            self.data += 1
        elif was is Kind.STRANGE:
            self.pass_over(number)
        elif was is Kind.TEXT:
            self.text += 1
        elif was is Kind.SHAPE and kind in (Kind.OCTETS, Kind.ROW):
            self.same += 1

    def pass_over(self, number: int) -> None:
        """Count a line that was not understood."""
        self.strange += 1
        self.first = self.first or number


def _heading(lines: list[str]) -> tuple[int, TableLayout] | None:
    """The line with the headings of a table and what it says; remarks may stand before it."""
    for number, line in enumerate(map(plain_signs, lines[:20])):
        if not line.strip() or (line.lstrip().startswith(REMARK) and not _NUMBER_COLUMN.match(line)):
            continue
        below = lines[number + 1 : number + 500]
        table = heading_of(line, delimiter_of(line), below)
        if table is not None and _has_times(table, below):
            return number, table
    return None


def _has_times(table: TableLayout, lines: list[str]) -> bool:
    """Whether a table's column of times holds any; else its lines are read as those of a log, which has more clocks."""
    told = unread = 0
    for row in _each(csv.reader(map(plain_signs, lines), delimiter=table.delimiter)):
        if row is not None and any(row) and table.holds(row):
            is_read = table.has_time(row)
            told, unread = told + is_read, unread + (not is_read)
    return told > 0 or not unread


def _decoded(stream: BinaryIO, codec: str) -> Iterator[str]:
    decoder = codecs.getincrementaldecoder(codec)("replace")
    while octets := stream.read(1 << 16):
        yield decoder.decode(octets)
    yield decoder.decode(b"", final=True)


def _first(lines: Iterator[str]) -> Iterator[str]:
    """The lines that tell what a log is."""
    left = LOOKED_AT_CHARACTERS
    for line in islice(lines, LOOKED_AT):
        yield line
        left -= len(line)
        if left < 0:
            return


def _first_written(lines: list[str]) -> str:
    """ ":3", the first line that is not empty and no remark, as the place of an error; "" when there is none."""
    for number, line in enumerate(lines, 1):
        if line.strip() and not line.lstrip().startswith(REMARK):
            return f":{number}"
    return ""
