"""Tables of octets as logic analysers and monitors write them (CSV): where octet, time and errors stand in a row. Pure.

| column | its names |
|---|---|
| octet | octet, byte, data, value, hex, payload …: one or more, in any spelling of `log_octets.py`, decimal, \
binary or as characters; which one is told by the whole column |
| begin, s | t_start_s, start, start_s, begin; start_time, time [s] (Saleae Logic: begin of the start bit) |
| end, s | t_end_s, end, end_s, time, time_s, timestamp, t; or a duration beside the begin |
| unit | behind the name: time[ns], time (ms), t_us; else told by the numbers; a time may also be a date and time |
| errors | parity error, framing error (anything but empty, 0 and false); error: words that name them |
| kind | type: rows of another type than data hold no octet |

Where no name is known, the column is told by its cells: numbers or dates that rise are times, runs of octets octets.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from itertools import pairwise

from dissectors.frame import Chunk, LineError, Mark
from sniff.formats.log_times import AS_WRITTEN, UNIT_NAMES, Times, is_count, order_of, unit_of

OCTET = (
    "octet",
    "octets",
    "byte",
    "bytes",
    "data",
    "value",
    "hex",
    "payload",
    "data (hex)",
    "hex data",
    "raw",
    "message",
    "decoded protocol result",
    "decoded result",
    "telegram",
)
ANALYSER = re.compile(r".*\b(?:uart|rs-?485|rs-?232|async serial|serial)\b.*")
"""A column that is named for its decoder, when no other holds octets."""
BEGIN = ("t_start_s", "start", "start_s", "begin", "start_time", "start time")
END = ("t_end_s", "end", "end_s", "time", "time_s", "timestamp", "t", "date", "datetime", "date/time", "date time")
DURATION = ("duration", "duration_s")
ERRORS = {"parity error": LineError.PARITY, "framing error": LineError.FRAMING}
ANY_ERROR = "error"
TYPE = "type"
TYPES_WITH_OCTETS = ("", "data", "result", "rx", "tx", "read", "write", "irp_mj_read", "irp_mj_write")

TIME_WORDS = re.compile(
    r"(?:ts|t|time|timestamp|when|zeit|zeitstempel|uhrzeit|datum|date|время|дата|temps|hora|heure|clock|epoch|uptime|"
    r"elapsed|millis)"
)
"""Words of which a time is named."""

MOST = 1 << 62
"""ns: a number beyond it is no time."""

UNITS = {"s": 1_000_000_000, "ms": 1_000_000, "us": 1000, "µs": 1000, "μs": 1000, "ns": 1}
_UNIT = re.compile(
    r"(?P<name>[^\[(]*)[\[(](?P<unit>s|ms|us|µs|μs|ns)[\])]"
    r"|(?P<stem>.+?)[_ ,/-]+(?:in[_ ])?"
    r"(?P<last>s|secs?|seconds|ms|millis(?:econds)?|us|µs|μs|micros(?:econds)?|ns|nanos)"
)
_LONG = {"sec": "s", "millis": "ms", "micros": "us", "nanos": "ns"}
_WITH_UNIT = re.compile(r"(?P<number>[+-]?\d{1,18}(?:[.,]\d{1,12})?) ?(?P<unit>s|ms|us|µs|μs|ns)")
_DELIMITERS = (",", ";", "\t", "|")

MOST_CELL = 1 << 16
LONGEST_HEADING = 4096
"""Characters."""

LATEST = 1 << 33
"""s; beyond it a number is no time."""

_SHOWN = re.compile(r"\(0[xX]([0-9A-Fa-f]{2})\)\s*")  # behind the character, as Saleae shows "ASCII and hex"
_PAIR = re.compile(r"[\s,;]*(?:0[xX])?([0-9A-Fa-f]{2})")
_DECIMAL = re.compile(r"\d{1,3}")
_BINARY = re.compile(r"(?:0b)?[01]{4}[ _]?[01]{4}")
_QUOTED = re.compile(r"'(\d{1,3})'")
_WORDS_OF_CHARACTERS = {"comma": ",", "' '": " ", "\\t": "\t", "\\r": "\r", "\\n": "\n", "\\\\": "\\", "\\0": "\0"}


@dataclass(frozen=True, slots=True)
class Table:
    """Where things stand in a row; None where there is no such column."""

    octet: int
    read: Callable[[str], bytes]
    """How the cells of the octets are written."""
    delimiter: str = ","
    begin: int | None = None
    end: int | None = None
    duration: int | None = None
    unit: int = 1_000_000_000
    kind: int | None = None
    errors: tuple[tuple[int, LineError | None], ...] = ()
    """Column → the error it tells; None: it names the error itself."""
    times: Times = AS_WRITTEN
    """How dates are read, and what was assumed."""
    tail: bool = False
    """Whether each cell from `octet` on holds one octet."""

    @property
    def exact(self) -> bool:
        """Whether the time of each octet is measured on the line: both its ends, or its begin."""
        return self.begin is not None

    def holds(self, row: Sequence[str]) -> bool:
        """Whether a row is of a type that holds octets."""
        if self.kind is None or self.kind >= len(row):
            return True
        return row[self.kind].strip().lower() in TYPES_WITH_OCTETS

    def chunk(self, row: Sequence[str], char: int) -> Chunk:
        """The octets of a row, at their end; `char`: ns of a character, where only the begin is told.

        Raises ValueError for a row that says less than it should.
        """
        if self.tail:
            octets = b"".join(self.read(cell) for cell in row[self.octet :] if cell.strip())
        else:
            octets = self.read(_cell(row, self.octet))
        if not octets:
            raise ValueError("no octets")
        time = self._end(row, len(octets) * char)
        if abs(time) >= MOST:
            raise ValueError("no time")
        return Chunk(time, octets, self._marks(row))

    def _end(self, row: Sequence[str], length: int) -> int:
        if self.end is not None:
            return time_of(_cell(row, self.end), self.unit, self.times)
        begin = time_of(_cell(row, self.begin), self.unit, self.times)
        if self.duration is None:
            return begin + length
        try:
            return begin + time_of(_cell(row, self.duration), self.unit)
        except ValueError:
            return begin + length  # in words, or left out

    def _marks(self, row: Sequence[str]) -> tuple[Mark, ...]:
        found = LineError(0)
        for place, error in self.errors:
            said = _cell(row, place).strip().lower() if place < len(row) else ""
            if error is None:
                for name in LineError:
                    found |= name if (name.name or "").lower() in said else LineError(0)
            elif said not in ("", "0", "false"):
                found |= error
        return (Mark(0, found),) if found else ()


def delimiter_of(heading: str) -> str:
    """What stands between the cells of a heading."""
    return max(_DELIMITERS, key=heading.count)


def heading_of(heading: str, delimiter: str, rows: Sequence[str]) -> Table | None:
    """The columns that a heading names; None when octets or times are not among them. `rows`: the next lines, which
    tell how octets are written.
    """
    if len(heading) > LONGEST_HEADING:
        return None
    written = [name.strip().strip('"').strip().lower() for name in heading.split(delimiter)]
    names, units = zip(*(_named(name) for name in written), strict=True)

    def place(known: Iterable[str]) -> int | None:
        found = (
            written.index(name) if name in written else names.index(name)
            for name in known
            if name in (*written, *names)
        )
        return next(found, None)

    cells = [[cell.strip().strip('"').strip() for cell in row.split(delimiter)] for row in rows if row.strip()]
    begin, end = place(BEGIN), place(END)
    if "time [s]" in written:  # of Saleae Logic
        begin, end = written.index("time [s]"), None
    octet = place(OCTET)
    if octet is None:
        octet = next((number for number, name in enumerate(names) if ANALYSER.fullmatch(name)), None)
    if begin is None and end is None:
        end = next((number for number, name in enumerate(names) if TIME_WORDS.fullmatch(name)), None)
    if _is_heading(written, cells):
        octet = octet if octet is not None else _column(cells, len(written), _are_octets)
        if begin is None and end is None:
            end = _column(cells, len(written), lambda column: _are_times(column) and not _are_octets(column))
    when = begin if begin is not None else end
    if octet is None or when is None or octet == when or len(names) < 2:
        return None
    errors = [(names.index(name), error) for name, error in ERRORS.items() if name in names]
    named = [(names.index(ANY_ERROR), None)] if ANY_ERROR in names else []
    kind = names.index(TYPE) if TYPE in names else None
    data = [
        cell
        for cell in cells
        if max(octet, when) < len(cell)
        and (kind is None or kind >= len(cell) or cell[kind].lower() in TYPES_WITH_OCTETS)
    ]
    tail = octet > when and _go_on(names, octet, data)
    told = [[one for one in cell[octet:] if one] if tail else [cell[octet]] for cell in data]
    read = spelling_of([one for cell in told for one in cell])
    unit, times = _times_of([cell[when] for cell in data], [_length(cell, read) for cell in told], units[when])
    return Table(
        octet, read, delimiter, begin, end, place(DURATION), unit, kind, (*errors, *named), times, tail
    )  # fmt: skip


_NUMBERED_NAME = re.compile(r"(?:[a-z]{1,6}[ _#]?)?\[?[0-9a-f]{1,3}\]?|")
_ONE_OCTET = re.compile(r"(?:0x)?[0-9a-f]{1,2}h?|[0-9]{1,3}|", re.IGNORECASE)


def _go_on(names: Sequence[str], octet: int, rows: Sequence[Sequence[str]]) -> bool:
    """Whether the octets of a row stand in a cell each: behind the column that is named for them come more that have a
    number for a name, or none.
    """
    if not all(_NUMBERED_NAME.fullmatch(name) for name in names[octet + 1 :]):
        return False
    more = [row for row in rows if any(row[octet + 1 :])]
    return 2 * len(more) > len(rows) and all(_ONE_OCTET.fullmatch(cell) for row in more for cell in row[octet:])


def _named(name: str) -> tuple[str, str]:
    """The name of a column without its unit, and the unit, "" where it has none."""
    match = _UNIT.fullmatch(name)
    if name in ("ms", "us", "µs", "μs", "ns"):
        return "time", name
    if match is None:
        return name, ""
    if match["unit"] is not None:
        return match["name"].strip(), match["unit"]
    return match["stem"].strip(), _short(match["last"])


def _short(unit: str) -> str:
    """ "ms" of "milliseconds"."""
    return next((short for start, short in _LONG.items() if unit.startswith(start)), unit)


def _is_heading(names: Sequence[str], cells: Sequence[Sequence[str]]) -> bool:
    """Whether a line is one of names: nothing in it is a number, and the rows below have as many cells."""
    if len(names) < 2 or len(cells) < 2 or any(not _is_name(name) for name in names if name):
        return False
    return sum(len(row) == len(names) for row in cells) >= 0.8 * len(cells) and sum(bool(name) for name in names) >= 2


_NAME = re.compile(r"[^\W\d][\w .#/()\[\]%°:-]{0,39}")


def _is_name(text: str) -> bool:
    """Whether it may be the name of a column."""
    return _NAME.fullmatch(text) is not None and not _fits(octets_of, text)


def _column(cells: Sequence[Sequence[str]], many: int, wanted: Callable[[Sequence[str]], bool]) -> int | None:
    """The first column whose cells are as wanted."""
    for number in range(many):
        column = [row[number] for row in cells if number < len(row) and row[number]]
        if len(column) >= 2 and wanted(column):
            return number
    return None


def _are_octets(column: Sequence[str]) -> bool:
    """Whether cells are runs of octets: more than one in most."""
    found = 0
    for cell in column[:200]:
        try:
            found += len(octets_of(cell)) > 1 and not (cell.isdigit() and len(cell) < 6)
        except ValueError:
            continue
    return found >= 0.8 * len(column[:200])


def _are_times(column: Sequence[str]) -> bool:
    """Whether cells are dates, or numbers that rise and do not just number the rows."""
    try:
        found = [time_of(cell, 1) for cell in column]
    except ValueError:
        return False
    rising = sum(later >= earlier for earlier, later in pairwise(found))
    many = len(set(found))
    return many > 1 and rising >= 0.9 * (len(found) - 1) and not is_count([Decimal(time) for time in found])


def _length(cells: Sequence[str], read: Callable[[str], bytes]) -> int:
    """Octets that cells tell; 0 where one tells none."""
    try:
        return sum(len(read(cell)) for cell in cells)
    except ValueError:
        return 0


def _times_of(cells: Sequence[str], lengths: Sequence[int], named: str) -> tuple[int, Times]:
    """ns that a number of the column of times counts, and how its dates are read. `lengths`: octets of each row."""
    if named:
        return UNITS[named], AS_WRITTEN
    numbers: list[Decimal] = []
    of_them: list[int] = []
    for cell, length in zip(cells, lengths, strict=True):
        try:
            number = Decimal(cell.replace(",", "."))
        except InvalidOperation:
            continue
        if number.is_finite() and length:
            numbers.append(number)
            of_them.append(length)
    if 2 * len(numbers) < len(cells) or len(numbers) < 2:
        return UNITS["s"], order_of(cells)
    unit, _, is_sure = unit_of(numbers, of_them)
    return unit, AS_WRITTEN if is_sure else Times(said=(f"times taken as {UNIT_NAMES[unit]}",))


def spelling_of(cells: Sequence[str]) -> Callable[[str], bytes]:
    """How a column of octets is written, told by all its cells: hexadecimal, unless only another fits.

    One of `10` and `1` is decimal, since a column of hexadecimal octets has two digits in each.
    """
    cells = [cell for cell in cells if cell]
    if cells and all(_BINARY.fullmatch(cell) for cell in cells):
        return lambda text: bytes((int(re.sub("[^01]", "", text.strip().removeprefix("0b")), 2),))
    if any(_QUOTED.fullmatch(cell) or cell.lower() in _WORDS_OF_CHARACTERS for cell in cells):
        return _character
    widths = {len(cell) for cell in cells}
    if cells and all(_DECIMAL.fullmatch(cell) for cell in cells) and (widths != {2}) and widths <= {1, 2, 3}:
        return _decimal
    fitting = sum(_fits(octets_of, cell) for cell in cells)
    if cells and 2 * fitting < len(cells) and all(len(cell) == 1 for cell in cells):
        return _character
    return octets_of


def _fits(read: Callable[[str], bytes], cell: str) -> bool:
    try:
        return bool(read(cell))
    except ValueError:
        return False


def _decimal(text: str) -> bytes:
    return bytes((int(text),))


def _character(text: str) -> bytes:
    """A character; 'N' is the number of one that cannot be shown (Saleae Logic)."""
    quoted = _QUOTED.fullmatch(text.strip())
    if quoted is not None:
        return bytes((int(quoted[1]),))
    text = _WORDS_OF_CHARACTERS.get(text.strip().lower(), text.strip() or " ")
    shown = _SHOWN.search(text)
    if shown is not None:
        return bytes.fromhex(shown[1])
    escape = re.fullmatch(r"\\x([0-9A-Fa-f]{2})", text)
    if escape is not None:
        return bytes.fromhex(escape[1])
    if len(text) != 1:
        raise ValueError(f"{text[:20]!r}: expected one character")
    return text.encode("latin-1")


def octets_of(text: str) -> bytes:
    """The octets of a text: `01 03`, `0103`, `0x01, 0x03`, `'A' (0x41)`, as in lines of logs. Raises ValueError."""
    shown = _SHOWN.search(text)
    if shown is not None and shown.end() == len(text):
        return bytes.fromhex(shown[1])
    found, at = bytearray(), 0
    text = text.strip(" \t,;")
    while at < len(text):
        match = _PAIR.match(text, at)
        if match is None:
            return _as_in_a_line(text)
        found.append(int(match[1], 16))
        at = match.end()
    return bytes(found)


def _as_in_a_line(text: str) -> bytes:
    from sniff.formats.log_octets import octets_in

    run = octets_in(text[:MOST_CELL])
    if run is None or run.begin or run.end < len(text.rstrip()):
        raise ValueError(f"octets {text[:20]!r}: expected hexadecimal pairs")
    return run.octets


def time_of(text: str, unit: int, times: Times = AS_WRITTEN) -> int:
    """A cell with a time → ns: a number of `unit`s (ns), or a date and time. Raises ValueError."""
    from sniff.formats.log_clock import stamp_of

    counted = _WITH_UNIT.fullmatch(text.strip())
    try:
        return scaled(text, unit) if counted is None else scaled(counted["number"], UNITS[counted["unit"]])
    except ValueError:
        stamp = stamp_of(text.strip(), times)
        if stamp is None or stamp.begin:
            raise
        return stamp.time


def seconds(text: str) -> int:
    """Seconds as a decimal number → ns, exactly. Raises ValueError."""
    return scaled(text, UNITS["s"])


def scaled(text: str, unit: int) -> int:
    """A decimal number of `unit`s (ns) → ns, exactly. Raises ValueError."""
    try:
        number = Decimal(text.strip().replace(",", "."))
    except InvalidOperation:
        raise ValueError(f"time {text[:20]!r}: expected seconds") from None
    if not number.is_finite() or abs(number) * unit > LATEST * UNITS["s"]:
        raise ValueError(f"time {text[:20]!r}: expected seconds, less than {LATEST}")
    return int(number * unit)


def _cell(row: Sequence[str], place: int | None) -> str:
    if place is None or place >= len(row):
        raise ValueError("a row that is too short")
    return row[place]
