"""Byte logs of other tools, read line by line: what a person finds on his disk from before he had this program.

| kind | a line | time is |
|---|---|---|
| candump-like | `(12.345678) bus 01 03 00 00 00 02 C4 0B`, `(12.3) rs485 123#0103` | end of the record |
| Docklight | `2/13/2006 12:23:47.123 [RX] - 01 03 00 <NUL>`, `13.02.2006 …`, `2006-02-13 …` | end of the record |
| jpnevulator | `2006-05-30 13:23:49.461075: /dev/ttyS0`, then lines of pairs | of the heading, for all below it |
| time and pairs | `0.031127 01 01 00 03 ; note` | end of the record |
| hexdump | `00000010  01 03 00 00 |....|`, `00000010: 0103 0000  ....` | none: back to back |
| CSV | headings with a column of octets (octet, data, value, hex) and of times (start, end, time) | as it says |

Neither line settings nor protocol are in such a file: give them with -s and -p. Times of logs are those of another
program: `FOREIGN_LATENCY` is assumed, except for a CSV that has both begin and end of each octet.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from dissectors.frame import Chunk
from dissectors.line import NS_PER_S
from sniff.formats import CaptureError
from sniff.formats.files import open_capture
from sniff.formats.records import foreign_session
from sniff.session import Adapter, Completeness, Item, Session

LONGEST_LINE = 1 << 20
SAMPLE = 200
"""Lines looked at to tell the kind."""

_PAIRS = r"(?P<pairs>(?:[0-9A-Fa-f]{2}[ \t,]*)+)"
_STAMP = r"(?P<date>\d{1,4}[-./]\d{1,2}[-./]\d{1,4})[ T](?P<clock>\d{1,2}:\d{2}:\d{2}(?:[.,]\d{1,9})?)"
KINDS: dict[str, re.Pattern[str]] = {
    "candump": re.compile(rf"\s*\((?P<seconds>\d+(?:\.\d{{1,9}})?)\)\s+\S+\s+(?:[0-9A-Fa-f]+#)?{_PAIRS}\s*"),
    "Docklight": re.compile(rf"\s*{_STAMP}\s+\[(?:TX|RX|C1|C2)\]\s*-?\s*{_PAIRS}.*", re.IGNORECASE),
    "jpnevulator": re.compile(rf"\s*{_STAMP}:.*"),
    "times and pairs": re.compile(rf"\s*(?P<seconds>\d+\.\d{{1,9}})\s*[:;,]?\s+{_PAIRS}(?:[;#|].*)?"),
    "hexdump": re.compile(
        r"\s*[0-9A-Fa-f]{4,16}(?:"
        r":\s*(?P<pairs>(?:[0-9A-Fa-f]{2,4} )*[0-9A-Fa-f]{2,4})(?:  .*)?"  # as xxd: text after two spaces
        r"|\s+(?P<canonical>(?:[0-9A-Fa-f]{2}\s{1,2})*[0-9A-Fa-f]{2})\s*(?:\|.*)?)"  # as hexdump -C: text after |
    ),
}
_CONTINUED = re.compile(r"\s*(?P<pairs>(?:[0-9A-Fa-f]{2}[ \t]+)*[0-9A-Fa-f]{2})(?:\s{2,}.*)?\s*")
OCTET_COLUMNS = ("octet", "byte", "data", "value", "hex")
START_COLUMNS = ("t_start_s", "start", "start_s", "begin")
END_COLUMNS = ("t_end_s", "end", "end_s", "time", "time_s", "timestamp", "t", "time [s]", "start_time")


def read(path: Path) -> ByteLog:
    """Open a byte log. Raises CaptureError when no line of it is of a known kind."""
    return ByteLog(path)


class ByteLog:
    """A byte log as a capture. Lines that are of no known form are passed over and counted."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._passed = 0
        lines = [line for _, line in zip(range(SAMPLE), self._lines(), strict=False)]
        self.kind = _kind_of(lines)
        if self.kind is None:
            known = ", ".join((*KINDS, "CSV"))
            raise CaptureError(f"{path}: no byte log that this program reads; it knows {known}")
        session = foreign_session(str(path), None, 0, f"{self.kind} log")
        self.session: Session = session
        first = next(self.items(), None)
        exact = self.kind == "CSV" and _columns(lines[0])[1] is not None
        adapter = Adapter("logic analyser", latency_from="exact times") if exact else session.adapter
        self.session = replace(session, started=first.time if first is not None else 0, adapter=adapter)

    def items(self) -> Iterator[Item]:
        """The octets in the order of the file."""
        self._passed = 0
        give: Callable[[], Iterator[Item]] = self._csv if self.kind == "CSV" else self._text
        return give()

    def completeness(self) -> Completeness:
        """Always whole: a text has no end mark. Says how many lines were not understood, as far as `items` has read."""
        note = f"; {self._passed} lines were not understood" if self._passed else ""
        return Completeness(True, f"complete ({self.kind} log{note})")

    def _lines(self) -> Iterator[str]:
        with open_capture(self.path) as stream:
            while line := stream.readline(LONGEST_LINE):
                yield line.decode("utf-8", "replace").rstrip("\r\n")

    def _text(self) -> Iterator[Item]:
        assert self.kind is not None
        pattern = KINDS[self.kind]
        time = 0
        for line in self._lines():
            if not line.strip() or line.lstrip().startswith("#"):
                continue
            match = pattern.fullmatch(line)
            if match is None and self.kind == "jpnevulator":
                match = _CONTINUED.fullmatch(line)
            elif match is not None:
                time = _time(match) if self.kind != "hexdump" else time
            found = match.groupdict() if match is not None else {}
            octets = _octets(found.get("pairs") or found.get("canonical"))
            if octets:
                if self.kind == "hexdump":
                    time += len(octets) * self.session.line.char
                yield Chunk(time, octets)
            elif match is None:
                self._passed += 1

    def _csv(self) -> Iterator[Item]:
        rows = csv.reader(self._lines())
        octet_at, start_at, end_at = _columns(",".join(next(rows, [])))
        assert octet_at is not None
        found: list[Chunk] = []
        for row in rows:
            try:
                octets = _octets(row[octet_at].strip().removeprefix("0x"))
                end = _seconds(row[end_at]) if end_at is not None else None
                start = _seconds(row[start_at]) if start_at is not None else None
            except (IndexError, ValueError):
                octets, end, start = b"", None, None
            time = end if end is not None else start + self.session.line.char if start is not None else None
            if not octets or time is None:
                self._passed += 1
                continue
            found.append(Chunk(time, octets))
        yield from sorted(found, key=lambda chunk: chunk.time)  # two lines of a bus are listed one after the other


def _kind_of(lines: list[str]) -> str | None:
    if lines and _columns(lines[0])[0] is not None:
        return "CSV"
    counts = {kind: sum(1 for line in lines if pattern.fullmatch(line)) for kind, pattern in KINDS.items()}
    best = max(counts, key=lambda kind: counts[kind])
    return best if counts[best] else None


def _columns(heading: str) -> tuple[int | None, int | None, int | None]:
    """Where octet, start and end stand in a CSV; all None when it is none."""
    names = [name.strip().strip('"').lower() for name in heading.split(",")]

    def place(known: tuple[str, ...]) -> int | None:
        return next((names.index(name) for name in known if name in names), None)

    octet, start, end = place(OCTET_COLUMNS), place(START_COLUMNS), place(END_COLUMNS)
    return (octet, start, end) if octet is not None and (start is not None or end is not None) else (None, None, None)


def _octets(pairs: str | None) -> bytes:
    text = re.sub(r"[ \t,]", "", pairs or "")
    return bytes.fromhex(text) if len(text) % 2 == 0 else b""


def _time(match: re.Match[str]) -> int:
    found = match.groupdict()
    if found.get("seconds"):
        return _seconds(found["seconds"])
    return _clock(found["date"], found["clock"])


def _seconds(text: str) -> int:
    whole, _, fraction = text.strip().partition(".")
    return int(whole or 0) * NS_PER_S + int(fraction[:9].ljust(9, "0") or 0)


def _clock(date: str, clock: str) -> int:
    """ns since the epoch, as UTC; 13.02.2006 is day first, 2/13/2006 is month first, 2006-02-13 year first."""
    parts = [int(part) for part in re.split(r"[-./]", date)]
    if parts[0] > 31:
        year, month, day = parts
    elif "." in date:
        day, month, year = parts
    else:
        month, day, year = parts
    hours, minutes, rest = clock.replace(",", ".").split(":")
    try:
        midnight = datetime(year if year > 99 else 2000 + year, month, day, tzinfo=UTC)
    except ValueError:
        return 0
    return int(midnight.timestamp()) * NS_PER_S + (int(hours) * 60 + int(minutes)) * 60 * NS_PER_S + _seconds(rest)
