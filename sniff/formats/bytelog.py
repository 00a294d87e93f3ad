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
from itertools import chain, islice
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
from sniff.formats.log_counts import FALLS_LEAST, Counts, Order
from sniff.formats.log_margin import plain_signs
from sniff.formats.log_order import are_lists, ordered
from sniff.formats.log_pieces import lines_in, rows_in
from sniff.formats.log_plan import LOOKED_AT, LOOKED_AT_CHARACTERS, Plan, plan_of
from sniff.formats.log_shapes import DECODED, REMARK
from sniff.formats.log_untimed import unknown_by
from sniff.formats.octet_table import TableLayout
from sniff.formats.records import foreign_session
from sniff.formats.set_back_clock import in_order
from sniff.formats.table_heading import delimiter_of, heading_of
from sniff.formats.table_reads import MOST_ROWS, each_row, reads_of_table
from sniff.formats.timeless import LINE_END, SLOW

if TYPE_CHECKING:
    from sniff.engine.blocks import Block

MOST_STRANGE = 0.2
"""Share of lines that are not understood, of those that tell octets, from which on a log is not read."""

_SAYS = 30
"""Lines by which such a text is told."""

_NUMBER_COLUMN = re.compile(r"\s*[\"']?#[\"']?\s*[,;\t|]")
"""The first heading of a table that numbers its rows, which is no remark."""

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
        self._counts = Counts()
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
        self._tick, self._has_lists = 1, False
        self._damage: CaptureError | None = None
        adapter = session.adapter
        if self._heading is not None:
            table = self._heading[1]
            exact = Adapter("logic analyser", latency_from="exact times")
            adapter = _as_coarse(exact if table.is_measured else adapter, table.tick)
        elif self._plan is not None:
            adapter = self._adapter(lines, adapter)
        first = self._first()
        self.session = replace(session, started=first.time if first is not None else 0, adapter=adapter)

    def items(self) -> Iterator[Item]:
        """The octets in the order of the file, those of a table in order of time. Raises CaptureError, at the end when
        too many lines were not understood.
        """
        self._counts = Counts()
        if self._heading is not None:
            at, table = self._heading
            rows = islice(self._lines(rows_in), at, None)
            yield from reads_of_table(self.path, rows, at, table, self.session.line.char, self._counts)
        else:
            yield from self._text()
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
        order = Order()
        for stamp in stamps:
            order.add(stamp.time)
        if order.falls >= FALLS_LEAST and order.is_newest_first and any(one.dated or one.daily for one in stamps):
            raise CaptureError(f"{self.path}: its times go back from line to line: newest first; turn it (`tac`)")
        told = self._told(lines)
        unknown = unknown_by([(read.time, is_told) for read, is_told in told])
        self._tick = min((stamp.tick for stamp in stamps), default=1)
        is_of_day = any(stamp.dated or stamp.daily for stamp in stamps)  # another clock begins anew where its tool does
        self._has_lists = is_of_day and are_lists([read for read, is_told in told if is_told], self._tick)
        if not stamps or unknown is None:
            longest = LINE_END + max((len(line.octets) for line in read), default=0) * SLOW.char
            return replace(adapter, latency=max(TIMELESS, longest), latency_from=NO_TIMES)
        if unknown > adapter.latency:
            return replace(adapter, latency=unknown, latency_from="lines without a time, between others that have one")
        return _as_coarse(adapter, self._tick)

    def _told(self, lines: list[str]) -> list[tuple[Chunk, bool]]:
        """The first reads, and whether the log says when each came."""
        assert self._plan is not None
        assembly = Assembly(self._plan, self.session.line)
        lines = list(self._plan.margin.joined(lines))
        taken = chain.from_iterable(assembly.take(self._plan.line(text), text) for text in lines)
        return [(item, assembly.has_time) for item in chain(taken, assembly.close()) if isinstance(item, Chunk)]

    def _lines(self, split: Callable[[Iterator[str]], Iterator[str]] = lines_in) -> Iterator[str]:
        with open_capture(self.path) as stream:
            try:
                start = stream.read(1 << 12)
                stream.seek(0)
                yield from split(_decoded(stream, utf16_of(start) or "utf-8"))
            except OSError as error:
                raise explain(self.path, error) from None

    def _text(self) -> Iterator[Item]:
        """The reads of the lines, in order of time."""
        assert self._plan is not None
        self._damage = None
        reads, char = self._reads(), self.session.line.char
        if self._has_lists:
            found = [item for item in islice(reads, MOST_ROWS + 1) if isinstance(item, Chunk)]
            if len(found) > MOST_ROWS:
                raise CaptureError(f"{self.path}: lists of over {MOST_ROWS} reads of one time; sort them (`sort`)")
            yield from in_order(found, char, lambda chunk: chunk.time)
        else:
            yield from ordered(reads, char, self._tick) if self._plan.timed else reads
        if self._damage is not None:  # what is before it was given
            raise self._damage

    def _reads(self) -> Iterator[Item]:
        assert self._plan is not None
        counts = self._counts
        assembly = Assembly(self._plan, self.session.line)
        try:
            for number, text in enumerate(self._plan.margin.joined(self._lines()), 1):
                line = self._plan.line(text)
                yield from assembly.take(line, text)
                counts.add(assembly.was, line.kind, number)
        except CaptureError as error:
            self._damage = error
        yield from assembly.close()
        counts.completed, counts.unwrapped = assembly.completed, assembly.unwrapped


def _as_coarse(adapter: Adapter, tick: int) -> Adapter:
    """The adapter with no more certainty than a clock has that counts so many ns."""
    if tick <= max(adapter.latency, FINE):
        return adapter
    return replace(adapter, latency=tick, latency_from=f"the log's clock, which counts {tick / MS:g} ms")


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
    for row in each_row(csv.reader(map(plain_signs, lines), delimiter=table.delimiter)):
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
