"""Byte logs of other tools, read line by line: what a person finds on his disk from before he had this program.

| kind | a line | time is |
|---|---|---|
| candump-like | `(12.345678) bus 01 03 00 00 00 02 C4 0B`, `(12.3) rs485 123#0103`, `(12.3) can0 123 [2] 01 03` | \
end of the record |
| Docklight | `2/13/2006 12:23:47.123 [RX] - 01 03 00 <NUL>`, `13.02.2006 …`, `2006-02-13 …` | end of the record |
| jpnevulator | `2006-05-30 13:23:49.461075: /dev/ttyS0`, then lines of pairs | of the heading, for all below it |
| times and pairs | `0.031127 01 01 00 03 ; note` | end of the record |
| clock and pairs | `[12:23:47.123] RX: 01 03 00`, `2006-02-13 12:23:47.123 01 03 00` | end of the record |
| hexdump | `00000010  01 03 00 00 |....|`, `00000010: 0103 0000  ....` | none: back to back |
| pairs | `01 03 00 00`, `0x01, 0x03`, `01030000` | none: back to back |
| CSV | headings with a column of octets and of times: `octet_table.py` | as it says |

Neither line settings nor protocol are in such a file: give them with -s and -p. Times of logs are those of another
program: `FOREIGN_LATENCY` is assumed, except for a CSV that has the begin of each octet (`octet_table.py`). Lines of no
known form are passed over, counted, and said: a log that was cut or damaged gives what is whole.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from dissectors.frame import Chunk
from dissectors.line import NS_PER_S
from sniff.engine.capture import CaptureError
from sniff.engine.session import Adapter, Completeness, Item, LineEvent, Session
from sniff.formats.files import explain, open_capture
from sniff.formats.octet_table import columns, octets_of, seconds
from sniff.formats.records import foreign_session

if TYPE_CHECKING:
    from sniff.engine.blocks import Block

LONGEST_LINE = 1 << 20
MOST_ROWS = 5_000_000
"""Of a table, which is held in memory whole to be sorted: 140 octets of it a row."""

SAMPLE = 200
"""Lines looked at to tell the kind."""

_PAIRS = r"(?P<pairs>(?:[0-9A-Fa-f]{2}[ \t,]*)+)"
_DATE = r"(?P<date>\d{1,4}[-./]\d{1,2}[-./]\d{1,4})"
_CLOCK = r"(?P<clock>\d{1,2}:\d{2}:\d{2}(?:[.,]\d{1,9})?)"
_STAMP = rf"{_DATE}[ T]{_CLOCK}"
_WAY = r"\[?(?:TX|RX|IN|OUT|C1|C2|>>|<<|->|<-|>|<)\]?"
KINDS: dict[str, re.Pattern[str]] = {
    "candump": re.compile(
        rf"\s*\((?P<seconds>\d+(?:\.\d{{1,9}})?)\)\s+\S+\s+(?:[0-9A-Fa-f]+(?:#|\s+\[\d+\]\s+))?{_PAIRS}\s*"
    ),
    "Docklight": re.compile(rf"\s*{_STAMP}\s+\[(?:TX|RX|C1|C2)\]\s*-?\s*{_PAIRS}.*", re.IGNORECASE),
    "jpnevulator": re.compile(rf"\s*{_STAMP}:.*"),
    "times and pairs": re.compile(rf"\s*(?P<seconds>\d+\.\d{{1,9}})\s*[:;,]?\s+{_PAIRS}(?:[;#|].*)?"),
    "clock and pairs": re.compile(
        rf"\s*\[?(?:{_DATE}[ T])?{_CLOCK}\]?\s*[;,]?\s*(?:{_WAY}\s*:?\s*)?{_PAIRS}(?:[;#|].*)?", re.IGNORECASE
    ),
    "hexdump": re.compile(
        r"\s*[0-9A-Fa-f]{4,16}(?:"
        r":\s*(?P<pairs>(?:[0-9A-Fa-f]{2,4} )*[0-9A-Fa-f]{2,4})(?:  .*)?"  # as xxd: text after two spaces
        r"|\s+(?P<canonical>(?:[0-9A-Fa-f]{2}\s{1,2})*[0-9A-Fa-f]{2})\s*(?:\|.*)?)"  # as hexdump -C: text after |
    ),
}
BARE = "pairs"
KNOWN = (*KINDS, BARE, "CSV")
TIMELESS = ("hexdump", BARE)
_BARE = re.compile(r"\s*(?P<pairs>(?:(?:0[xX])?[0-9A-Fa-f]{2}(?:[ \t,;]+|(?=[0-9A-Fa-f])|$))+)")
_CONTINUED = re.compile(r"\s*(?P<pairs>(?:[0-9A-Fa-f]{2}[ \t]+)*[0-9A-Fa-f]{2})(?:\s{2,}.*)?\s*")
_NOTHING = {  # lines that are as they should be, and hold no octets
    "hexdump": re.compile(r"\s*[0-9A-Fa-f]{4,16}:?\s*"),  # the offset at the end
    "Docklight": re.compile(r"\s*Docklight.*"),
}
_SPACES = re.compile(r"\s{4,}")
_REMARK = ("#", ";", "//")


def read(path: Path) -> ByteLog:
    """Open a byte log. Raises CaptureError when no line of it is of a known kind."""
    return ByteLog(path)


class ByteLog:
    """A byte log as a capture. Lines that are of no known form are passed over and counted."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._passed = 0
        self._first_passed = 0  # number of the first such line
        lines = [line for _, line in zip(range(SAMPLE), self._lines(), strict=False)]
        self.kind = _kind_of(lines)
        if self.kind is None:
            raise CaptureError(
                f"{path}{_first_written(lines)}: no byte log that this program reads; it knows {', '.join(KNOWN)}"
            )
        session = foreign_session(str(path), None, 0, f"{self.kind} log")
        self.session: Session = session
        first = next(self.items(), None)
        table = columns(lines[0]) if self.kind == "CSV" else None
        exact = table is not None and table.exact
        adapter = Adapter("logic analyser", latency_from="exact times") if exact else session.adapter
        self.session = replace(session, started=first.time if first is not None else 0, adapter=adapter)

    def items(self) -> Iterator[Item]:
        """The octets in the order of the file, those of a table in order of time. Raises CaptureError."""
        self._passed = self._first_passed = 0
        give: Callable[[], Iterator[Item]] = self._table if self.kind == "CSV" else self._text
        return give()

    def blocks(self) -> Iterator[Block | LineEvent]:
        """The same as columns. Raises CaptureError."""
        from sniff.engine.blocks import blocks_of

        return blocks_of(self.items())

    def completeness(self) -> Completeness:
        """Whether every line was understood, as far as `items` has read; a text has no end mark."""
        if not self._passed:
            return Completeness(True, f"complete ({self.kind} log)")
        many = "1 line was" if self._passed == 1 else f"{self._passed} lines were"
        text = f"{many} not understood, the first is line {self._first_passed} ({self.kind} log)"
        return Completeness(False, text)

    def _lines(self) -> Iterator[str]:
        with open_capture(self.path) as stream:
            try:
                while line := stream.readline(LONGEST_LINE):
                    yield line.decode("utf-8", "replace").rstrip("\r\n").removeprefix("\ufeff")
            except OSError as error:
                raise explain(self.path, error) from None

    def _pass(self, number: int) -> None:
        self._passed += 1
        self._first_passed = self._first_passed or number

    def _text(self) -> Iterator[Item]:
        assert self.kind is not None
        pattern = KINDS.get(self.kind, _BARE)
        nothing = _NOTHING.get(self.kind)
        is_timed = self.kind not in TIMELESS
        time = 0
        for number, line in enumerate(self._lines(), 1):
            if not line.strip() or line.lstrip().startswith(_REMARK):
                continue
            line = _narrow(line)
            match = pattern.fullmatch(line)
            is_heading = match is not None
            if match is None and self.kind == "jpnevulator":
                match = _CONTINUED.fullmatch(line)
            found = match.groupdict() if match is not None else {}
            try:
                if match is not None and is_heading and is_timed:
                    time = _time(match)
                octets = octets_of(found.get("pairs") or found.get("canonical") or "")
            except ValueError:  # half a pair, or a time that is none
                octets, match = b"", None
            if octets:
                if not is_timed:
                    time += len(octets) * self.session.line.char
                yield Chunk(time, octets)
            elif match is None and (nothing is None or not nothing.fullmatch(line)):
                self._pass(number)

    def _table(self) -> Iterator[Item]:
        rows = csv.reader(self._lines())
        table = columns(",".join(next(rows, [])))
        found: list[Chunk] = []
        try:
            for row in rows:
                if not any(row) or table is None:
                    continue
                if len(found) >= MOST_ROWS:
                    raise CaptureError(f"{self.path}: a table of over {MOST_ROWS} rows; cut it into pieces")
                try:
                    found.append(table.chunk(row, self.session.line.char))
                except ValueError:
                    self._pass(rows.line_num)
        except csv.Error:  # a field that never ends, a zero octet
            self._pass(rows.line_num)
        yield from sorted(found, key=lambda chunk: chunk.time)  # two lines of a bus are listed one after the other


def _kind_of(lines: list[str]) -> str | None:
    if lines and columns(lines[0]) is not None:
        return "CSV"
    lines = [_narrow(line) for line in lines]
    counts = {kind: sum(1 for line in lines if pattern.fullmatch(line)) for kind, pattern in KINDS.items()}
    best = max(counts, key=lambda kind: counts[kind])
    if counts[best]:
        return best
    written = [line for line in lines if line.strip() and not line.lstrip().startswith(_REMARK)]
    bare = sum(1 for line in written if _BARE.fullmatch(line))
    return BARE if bare and 2 * bare >= len(written) else None


def _first_written(lines: list[str]) -> str:
    """ ":3", the first line that is not empty and no remark, as the place of an error; "" when there is none."""
    for number, line in enumerate(lines, 1):
        if line.strip() and not line.lstrip().startswith(_REMARK) and not _BARE.fullmatch(_narrow(line)):
            return f":{number}"
    return ""


def _narrow(line: str) -> str:
    """The line without long runs of spaces, which would make matching slow."""
    return _SPACES.sub("   ", line)


def _time(match: re.Match[str]) -> int:
    found = match.groupdict()
    if found.get("seconds"):
        return seconds(found["seconds"])
    return _midnight(found.get("date") or "") + _of_day(found["clock"])


def _of_day(clock: str) -> int:
    """ns since midnight."""
    hours, minutes, rest = clock.replace(",", ".").split(":")
    return (int(hours) * 60 + int(minutes)) * 60 * NS_PER_S + seconds(rest)


def _midnight(date: str) -> int:
    """ns since the epoch, as UTC; 13.02.2006 is day first, 2/13/2006 is month first, 2006-02-13 year first."""
    if not date:
        return 0
    parts = [int(part) for part in re.split(r"[-./]", date)]
    if parts[0] > 31:
        year, month, day = parts
    elif "." in date:
        day, month, year = parts
    else:
        month, day, year = parts
    try:
        midnight = datetime(year if year > 99 else 2000 + year, month, day, tzinfo=UTC)
    except ValueError:
        return 0
    return int(midnight.timestamp()) * NS_PER_S
