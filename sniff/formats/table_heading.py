"""The heading of a table of octets: which column holds what, by its name or by what stands below it. Pure.

| column | its names |
|---|---|
| octet | octet, byte, data, value, hex, payload …: one or more, in any spelling of `log_spellings.py`, decimal, \
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
from decimal import Decimal, InvalidOperation
from itertools import pairwise

from dissectors.frame import LineError
from sniff.formats.column_names import (
    ANALYSER,
    ANY_ERROR,
    BEGIN,
    DAYS,
    DURATION,
    END,
    ERRORS,
    OCTET,
    PAIRS,
    TIME_WORDS,
    TYPE,
    TYPES_WITH_OCTETS,
    named,
)
from sniff.formats.log_calendar import calendar_of
from sniff.formats.log_times import AS_WRITTEN, UNIT_NAMES, Times, is_count, order_of, unit_of
from sniff.formats.octet_table import LONGEST_HEADING, TableLayout
from sniff.formats.table_cells import DIGITS, UNITS, fits, octets_of, spelling_of, tick_of, time_of

_DELIMITERS = (",", ";", "\t", "|")

SALEAE_TIME = "time [s]"
"""Of Saleae Logic: the begin of the start bit."""

FEW_TIMES = 3
"""Times of a column that tell how fine it counts; zeros at the end of one may have been left out."""


def delimiter_of(heading: str) -> str:
    """What stands between the cells of a heading."""
    return max(_DELIMITERS, key=heading.count)


def heading_of(heading: str, delimiter: str, rows: Sequence[str]) -> TableLayout | None:
    """The columns that a heading names; None when octets or times are not among them. `rows`: the next lines, which
    tell how octets are written.
    """
    if len(heading) > LONGEST_HEADING:
        return None
    written = [name.strip().strip('"').strip().lower() for name in heading.split(delimiter)]
    cells = [[cell.strip().strip('"').strip() for cell in row.split(delimiter)] for row in rows if row.strip()]
    table = _Heading(written, cells)
    begin, end = table.times_named()
    octet, behind = table.octets_named(), 0
    if begin is None and end is None:
        end = _named_times(table.names, cells, octet)
    if octet is None:
        octet, behind = _numbered(table.names, cells)
    if _is_heading(written, cells):
        octet = octet if octet is not None else _column(cells, len(written), _are_octets)
        if begin is None and end is None:
            end = _column(cells, len(written), lambda column: _are_times(column) and not _are_octets(column))
    when = begin if begin is not None else end
    if octet is None or when is None or octet == when or len(written) < 2:
        return None
    return table.layout(delimiter, octet, behind, begin, end)


class _Heading:
    """The names of columns, as `written` and as they are known (`names`), and the cells below them."""

    def __init__(self, written: Sequence[str], cells: list[list[str]]) -> None:
        self.written, self.cells = written, cells
        self.names, self.units = zip(*(named(name) for name in written), strict=True)

    def times_named(self) -> tuple[int | None, int | None]:
        """The columns named for begin and end."""
        if SALEAE_TIME in self.written:
            return self.written.index(SALEAE_TIME), None
        return self._place(BEGIN), self._place(END)

    def octets_named(self) -> int | None:
        """The column named for octets, or after an analyser that gives them."""
        octet = _named_octets(self.written, self.names, self.cells)
        if octet is not None:
            return octet
        return next((number for number, name in enumerate(self.names) if ANALYSER.fullmatch(name)), None)

    def layout(self, delimiter: str, octet: int, behind: int, begin: int | None, end: int | None) -> TableLayout:
        """Where everything stands; octets and one of the times are known."""
        names = self.names
        when = begin if begin is not None else end
        assert when is not None
        day = self._day(octet, when)
        kind = names.index(TYPE) if TYPE in names else None
        data = [cell for cell in self._with_days(day, when) if _holds_octets(cell, kind, max(octet, when))]
        if not behind and octet > when and _go_on(names, octet, data):
            behind = LONGEST_HEADING
        partners = [two for pair in PAIRS for one, two in (pair, pair[::-1]) if names[octet] == one and two in names]
        other = names.index(partners[0]) if partners else None
        told = [
            [one for one in cell[octet:behind] if one] if behind else [_either(cell, octet, other)] for cell in data
        ]
        read = spelling_of([one for cell in told for one in cell])
        lengths = [_length(cell, read) for cell in told]
        unit, times = _times_of([cell[when] for cell in data], lengths, self.units[when])
        ticks = [tick for cell in data if (tick := tick_of(cell[when], unit, times)) is not None]
        daily, local = calendar_of([cell[when] for cell in data[:FEW_TIMES]], times)
        return TableLayout(
            octet=octet,
            read=read,
            delimiter=delimiter,
            begin=begin,
            end=end,
            duration=self._place(DURATION),
            unit=unit,
            kind=kind,
            errors=self._errors(),
            times=times,
            behind=behind,
            other=other,
            day=day,
            tick=min(ticks) if len(ticks) >= FEW_TIMES else 1,
            octetwise=10 * lengths.count(1) >= 9 * len(lengths),
            daily=daily,
            local=local,
        )

    def _place(self, known: Iterable[str]) -> int | None:
        """The first column that has one of these names."""
        for name in known:
            for row in (self.written, self.names):
                if name in row:
                    return row.index(name)
        return None

    def _day(self, octet: int, when: int) -> int | None:
        """The column of the day, where that of the times has times of day."""
        day = next((self.names.index(name) for name in DAYS if name in self.names), None)
        if day is None or day in (octet, when) or not _are_of_days(self.cells, day, when):
            return None
        return day

    def _with_days(self, day: int | None, when: int) -> list[list[str]]:
        """The cells, with the day before the time."""
        if day is None:
            return self.cells
        return [
            [*row[:when], f"{row[day]} {row[when]}", *row[when + 1 :]] if max(day, when) < len(row) else row
            for row in self.cells
        ]

    def _errors(self) -> tuple[tuple[int, LineError | None], ...]:
        """The columns that tell errors of the line."""
        errors = [(self.names.index(name), error) for name, error in ERRORS.items() if name in self.names]
        telling = [(self.names.index(ANY_ERROR), None)] if ANY_ERROR in self.names else []
        return (*errors, *telling)


def _holds_octets(cells: Sequence[str], kind: int | None, least: int) -> bool:
    """Whether a row is long enough and of a type that holds octets."""
    if least >= len(cells):
        return False
    return kind is None or kind >= len(cells) or cells[kind].lower() in TYPES_WITH_OCTETS


def _named_octets(written: Sequence[str], names: Sequence[str], cells: Sequence[Sequence[str]]) -> int | None:
    """The column that is named for octets; of several the first, unless another has many more: one may have their
    number."""
    known = [row.index(name) for name in OCTET for row in (written, names) if name in row]
    if not known:
        return None
    many = {number: sum(_length([cell], octets_of) for cell in _of_column(cells, number)) for number in known}
    most = max(known, key=lambda number: many[number])
    return most if many[most] > 2 * many[known[0]] else known[0]


def _named_times(names: Sequence[str], cells: Sequence[Sequence[str]], octet: int | None) -> int | None:
    """The column that is named for times; of several the first that has more than days."""
    known = [number for number, name in enumerate(names) if TIME_WORDS.fullmatch(name) and number != octet]
    with_times = (number for number in known if not all(map(_DAY.fullmatch, _of_column(cells, number))))
    return next(with_times, known[0] if known else None)


def _of_column(cells: Sequence[Sequence[str]], number: int) -> list[str]:
    """What stands in a column."""
    return [row[number] for row in cells if number < len(row) and row[number]]


def _either(row: Sequence[str], octet: int, other: int | None) -> str:
    return row[octet] if row[octet] or other is None or other >= len(row) else row[other]


_DAY = re.compile(r"\d{1,4}[-./]\d{1,2}[-./]\d{1,4}")
_TIME_OF_DAY = re.compile(r"\d{1,2}:\d{2}:\d{2}.*")


def _are_of_days(cells: Sequence[Sequence[str]], day: int, when: int) -> bool:
    """Whether one column has dates and the other times of day."""
    rows = [row for row in cells if max(day, when) < len(row) and (row[day] or row[when])]
    return bool(rows) and all(_DAY.fullmatch(row[day]) and _TIME_OF_DAY.fullmatch(row[when]) for row in rows[:50])


_NUMBERED_NAME = re.compile(r"(?:[a-z]{1,6}[ _#]?)?\[?[0-9a-f]{1,3}\]?|")
_COUNTED = re.compile(r"([a-z]{1,8})[ _#]?\[?(\d{1,3})\]?")
_ONE_OCTET = re.compile(r"(?:0x)?[0-9a-f]{1,2}h?|[0-9]{1,3}|", re.IGNORECASE)


def _go_on(names: Sequence[str], octet: int, rows: Sequence[Sequence[str]]) -> bool:
    """Whether the octets of a row stand in a cell each: behind the column that is named for them come more that have a
    number for a name, or none.
    """
    if not all(_NUMBERED_NAME.fullmatch(name) for name in names[octet + 1 :]):
        return False
    more = [row for row in rows if any(row[octet + 1 :])]
    return 2 * len(more) > len(rows) and all(_ONE_OCTET.fullmatch(cell) for row in more for cell in row[octet:])


def _numbered(names: Sequence[str], cells: Sequence[Sequence[str]]) -> tuple[int | None, int]:
    """The columns data0, data1 … with an octet in each: the first and the one behind the last; None, 0 without."""
    found = [_COUNTED.fullmatch(name) for name in names]
    begin, many = 0, 0
    for place, (before, match) in enumerate(pairwise((None, *found))):
        goes_on = before and match and before[1] == match[1] and int(match[2]) == int(before[2]) + 1
        begin, many = (begin, many + 1) if goes_on else (place, 1)
        is_last = place + 1 == len(found)
        behind = LONGEST_HEADING if is_last else place + 1  # a row may go on behind the names
        ends = is_last or not found[place + 1]
        if ends and many > 1 and _are_octets_each([row[begin:behind] for row in cells]):
            return begin, behind
    return None, 0


def _are_octets_each(cells: Sequence[Sequence[str]]) -> bool:
    """Whether each cell holds an octet; levels of lines have one digit each."""
    filled = [cell for row in cells for cell in row if cell]
    return any(len(cell) > 1 for cell in filled) and all(_ONE_OCTET.fullmatch(cell) for cell in filled)


def _is_heading(names: Sequence[str], cells: Sequence[Sequence[str]]) -> bool:
    """Whether a line is one of names: nothing in it is a number, and the rows below have as many cells."""
    if len(names) < 2 or len(cells) < 2 or any(not _is_name(name) for name in names if name):
        return False
    return sum(len(row) == len(names) for row in cells) >= 0.8 * len(cells) and sum(bool(name) for name in names) >= 2


_NAME = re.compile(r"[^\W\d][\w .#/()\[\]%°:-]{0,39}")


def _is_name(text: str) -> bool:
    """Whether it may be the name of a column."""
    return _NAME.fullmatch(text) is not None and not fits(octets_of, text)


def _column(cells: Sequence[Sequence[str]], many: int, wanted: Callable[[Sequence[str]], bool]) -> int | None:
    """The first column whose cells are as wanted."""
    for number in range(many):
        column = _of_column(cells, number)
        if len(column) >= 2 and wanted(column):
            return number
    return None


_NEARLY_ALL = 0.9
_FRACTION = re.compile(r"[+-]?\d+[.,]\d+")


def _are_octets(column: Sequence[str]) -> bool:
    """Whether cells are runs of octets: more than one in most. Two groups and a dot in each are a number."""
    if all(_FRACTION.fullmatch(cell) or _DAY.fullmatch(cell) for cell in column[:200]):
        return False
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
        if number.is_finite() and number.adjusted() <= DIGITS and length:
            numbers.append(number)
            of_them.append(length)
    if 2 * len(numbers) < len(cells) or len(numbers) < 2:
        return UNITS["s"], order_of(cells)
    unit, _, is_sure = unit_of(numbers, of_them)
    return unit, AS_WRITTEN if is_sure else Times(said=(f"times taken as {UNIT_NAMES[unit]}",))
