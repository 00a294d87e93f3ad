"""Where octet, time and errors stand in a row of a table (CSV) that a logic analyser or a monitor wrote. Pure."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from dissectors.frame import Chunk, LineError, Mark
from sniff.formats.column_names import TYPES_WITH_OCTETS
from sniff.formats.log_times import AS_WRITTEN, Times
from sniff.formats.table_cells import MOST, time_of

BETWEEN = 10_000_000
"""ns from a request to its answer, where a row has one time for both."""

LONGEST_HEADING = 4096
"""Characters."""


@dataclass(frozen=True, slots=True)
class TableLayout:
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
    behind: int = 0
    """The column behind those that hold an octet each, of which `octet` is the first; 0 where one holds all."""
    other: int | None = None
    """Where octets stand of the other direction, instead or too."""
    day: int | None = None
    """Where the day of the time stands."""
    tick: int = 1
    """ns: the place of the last digit that a time has."""
    octetwise: bool = False
    """Whether rows hold an octet each."""
    daily: bool = False
    """Whether times are those of a day; `local`: whether they say a date and no zone."""
    local: bool = False

    @property
    def exact(self) -> bool:
        """Whether rows say when they began on the line: both ends, or the begin."""
        return self.begin is not None

    @property
    def is_measured(self) -> bool:
        """Whether the time of each octet is measured on the line; of rows that are frames nobody knows by what."""
        return self.exact and self.octetwise

    def holds(self, row: Sequence[str]) -> bool:
        """Whether a row is of a type that holds octets."""
        if self.kind is None or self.kind >= len(row):
            return True
        return row[self.kind].strip().lower() in TYPES_WITH_OCTETS

    def has_time(self, row: Sequence[str]) -> bool:
        """Whether its time can be read."""
        try:
            return abs(self._end(row, 0)) < MOST
        except ValueError:
            return False

    def more(self, row: Sequence[str]) -> bytes:
        """The octets of a row that goes on with those of the row above: it has nothing else; b"" where it does not."""
        others = (cell for place, cell in enumerate(row) if place != self.octet)
        if self.exact or self.behind or self.octet >= len(row) or any(map(str.strip, others)):
            return b""
        try:
            return self.read(row[self.octet])
        except ValueError:
            return b""

    def chunks(self, row: Sequence[str], char: int) -> Iterator[Chunk]:
        """The octets of a row, at their end, of one direction after the other; `char`: ns of a character, where only
        the begin is told.

        Raises ValueError for a row that says less than it should.
        """
        first = self._chunk(row, char)
        yield first
        if self.other is not None and _cell(row, self.octet).strip() and _cell(row, self.other).strip():
            octets = self.read(_cell(row, self.other))
            yield Chunk(first.time + BETWEEN + len(octets) * char, octets)

    def _chunk(self, row: Sequence[str], char: int) -> Chunk:
        if self.behind:
            octets = b"".join(self.read(cell) for cell in row[self.octet : self.behind] if cell.strip())
        else:
            cell = _cell(row, self.octet)
            octets = self.read(cell if cell.strip() or self.other is None else _cell(row, self.other))
        if not octets:
            raise ValueError("no octets")
        time = self._end(row, len(octets) * char)
        if abs(time) >= MOST:
            raise ValueError("no time")
        return Chunk(time, octets, self._marks(row))

    def _end(self, row: Sequence[str], length: int) -> int:
        if self.end is not None:
            day = "" if self.day is None else f"{_cell(row, self.day).strip()} "
            return time_of(day + _cell(row, self.end), self.unit, self.times)
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


def _cell(row: Sequence[str], place: int | None) -> str:
    if place is None or place >= len(row):
        raise ValueError("a row that is too short")
    return row[place]
