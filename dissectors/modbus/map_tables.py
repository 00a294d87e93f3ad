"""Register maps as tables of text: comma, semicolon, tab or bar between the cells, columns known by their headings.

The first line that has a column for the number of the register is the heading; what stands above it is passed over.
Numbers are read as 40001-style where all of them can be, else as those of the wire, from 0. Pure, total.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from dissectors.profiles.checked import MOST
from dissectors.profiles.model import Access, Kind
from dissectors.register_maps import MOST_ENTRIES, Mapped, RegisterMap, kind_of, order_of

HEADINGS: Mapping[str, str] = {
    "address": "address addr register reg registeraddress regaddress modbusaddress modbusregister registernumber "
    "registerno regno startaddress startregister plcaddress hexaddress addresshex addressdec adresse "
    "registeradresse dataaddress addressdecimal addresshexadecimal pdu pduaddress",
    "name": "name alias tag tagname parameter parametername variable variablename signal label point pointname symbol "
    "registername bezeichnung item",
    "title": "description desc comment meaning title remarks text beschreibung",
    "type": "type datatype format dataformat valuetype datentyp encoding",
    "scale": "scale factor multiplier gain resolution scalefactor scaling scalingfactor faktor ratio",
    "divisor": "divisor div divider",
    "offset": "offset valueoffset bias",
    "unit": "unit units uom einheit engineeringunit engineeringunits eu",
    "function": "function fc functioncode functioncodes table registertype objecttype area registertable "
    "modbusfunction readfunction inputtype",
    "access": "access rw readwrite permission accesstype accessmode mode attribute",
    "registers": "count length size words quantity registers numberofregisters registercount noofregisters len "
    "wordcount",
    "order": "wordorder byteorder swap endian endianness order",
    "low": "min minimum low lowlimit minvalue",
    "high": "max maximum high highlimit maxvalue",
    "range": "range limits validrange valuerange setpointrange bereich",
    "states": "states enum enumeration values options valuemap valuelist",
    "station": "slave slaveid unitid station device deviceaddress slaveaddress node nodeid",
}
"""Column → headings that mean it, without spaces, signs and capitals."""

MOST_ABOVE = 50
"""Lines above the heading that are passed over."""

_BY_HEADING = {word: column for column, words in HEADINGS.items() for word in words.split()}
_SPACES = {
    "coil": "coil coils 1 01 5 05 15 0f fc1 fc01 fc5 fc05 fc15 0x do digitaloutput outputcoil readcoils",
    "discrete": "discrete discreteinput discreteinputs discreteinputregister 2 02 fc2 fc02 1x di digitalinput "
    "inputstatus contact",
    "holding": "holding holdingregister holdingregisters 3 03 6 06 16 10 fc3 fc03 fc6 fc06 fc16 4x hr "
    "readholdingregisters holdings 0306 0316 030616 36 316 3616",
    "input": "input inputregister inputregisters 4 04 fc4 fc04 3x ir readinputregisters",
}
_BY_FUNCTION = {word: space for space, words in _SPACES.items() for word in words.split()}
_TABLE_DIGIT = {0: "coil", 1: "discrete", 3: "input", 4: "holding"}
_HEX = re.compile(r"(?:0x|\$|#)([0-9a-f]{1,4})|([0-9a-f]{1,4})\s*h(?:ex)?", re.IGNORECASE)
_DECIMAL = re.compile(r"(\d{1,6})(?:\s*(-|…|\.\.|–|to|/|,|:)\s*(\d{1,6}))?")
_RANGE = re.compile(r"\s*([+-]?[\d.,]+?)\s*(?:-|–|…|\.\.+|~|to|bis)\s*([+-]?[\d.,]+)\s*(?:[%°A-Za-zµΩ]\S{0,8})?\s*")
_AMBIGUOUS = re.compile(r"\s*[+-]?[1-9]\d{0,2},\d{3}\s*")
_DECIMAL_COMMA = re.compile(r"\s*[+-]?(?:0,\d+|\d+,(?:\d{1,2}|\d{4,}))\s*")
_SPAN_SIGNS = ("-", "…", "..", "–", "to")
_GROUPED = re.compile(r"(\d{1,2}|[34]00)[,'’ \u00a0\u202f](\d{3})")
_NOTHING = ("", "-", "–", "n/a", "N/A")
_PREFIXED = re.compile(r"([0134])[xX:](\d{1,5})")


@dataclass(frozen=True, slots=True)
class _Number:
    """A register's number as it stands in a map. `digits`: as written, for 00001; `space`: where a prefix says it;
    `is_wire`: hexadecimal, which nobody counts from 1. `registers`: of a span."""

    value: int
    digits: str
    space: str = ""
    is_wire: bool = False
    registers: int | None = None

    @property
    def is_styled(self) -> bool:
        """Whether it can be 40001-style."""
        return not self.is_wire and len(self.digits) in (5, 6) and self.table in _TABLE_DIGIT and self.within > 0

    @property
    def table(self) -> int:
        """The digit in front of it."""
        return int(self.digits[:1] or 0)

    @property
    def within(self) -> int:
        """What follows that digit."""
        return int(self.digits[1:] or 0)


def read_csv(text: str, numbering: str = "auto", table: str | None = None) -> RegisterMap | None:
    """The map in a table of text; None where no line of it is a heading with a column for the number.

    `numbering`: one of `register_maps.NUMBERINGS`. `table`: of registers whose row does not say it (holding).
    """
    lines = text.splitlines()
    found = RegisterMap()
    heading = next((at for at, line in enumerate(lines[:MOST_ABOVE]) if "address" in _columns(_cells(line)[0])), None)
    if heading is None:
        return None
    cells, delimiter = _cells(lines[heading])
    columns = _columns(cells)
    unknown = [cell.strip() for cell in cells if cell.strip() and _column(cell) is None]
    if unknown:
        found.left_out[f"columns {', '.join(unknown[:12])}"] += len(unknown)
    rows = _rows(lines[heading + 1 :], delimiter, columns)
    _take(found, rows, numbering, table)
    return found


def _cells(line: str) -> tuple[list[str], str]:
    """The cells of a line that may be a heading, and what stands between them."""
    delimiter = max(",;\t|", key=line.count)
    try:
        return (next(csv.reader([line], delimiter=delimiter), []) if line.count(delimiter) else []), delimiter
    except csv.Error:
        return [], delimiter


def _column(heading: str) -> str | None:
    words = re.sub(r"\(.*?\)|\[.*?\]", "", heading.lower())
    return _BY_HEADING.get(re.sub(r"[^a-z0-9]", "", words))


def _columns(cells: Sequence[str]) -> dict[str, int]:
    """Where each column is; of two of a kind the first."""
    columns: dict[str, int] = {}
    for place, cell in enumerate(cells):
        column = _column(cell)
        if column is not None:
            columns.setdefault(column, place)
    return columns


def _rows(lines: Sequence[str], delimiter: str, columns: Mapping[str, int]) -> list[dict[str, str]]:
    rows = []
    try:
        for cells in csv.reader(lines, delimiter=delimiter):
            row = {name: cells[place].strip() for name, place in columns.items() if place < len(cells)}
            if any(row.values()):
                rows.append(row)
            if len(rows) > MOST_ENTRIES:
                break
    except csv.Error:  # a cell that is larger than any map has
        pass
    return rows


def _take(found: RegisterMap, rows: Sequence[dict[str, str]], numbering: str, table: str | None) -> None:
    numbers = [_number(row.get("address", "")) for row in rows]
    known = [number for number in numbers if number is not None]
    spoken = [row.get("function", "") for row in rows]
    styled = numbering == "40001" or (
        numbering == "auto" and bool(known) and all(one.is_styled or one.space for one in known) and _has_high(known)
    )
    how = {
        True: "numbers are 40001-style: 40001 is holding register 0 of the wire, 30001 input register 0",
        False: "numbers are taken as those of the wire, from 0; where the manual counts from 1, use --numbering 1",
    }[styled]
    found.said.append("numbers count from 1: 1 is 0 of the wire" if numbering == "1" else how)
    first = 1 if numbering == "1" else 0
    unsaid = 0
    for row, number, function in zip(rows, numbers, spoken, strict=True):
        if number is None:
            found.left_out["rows without a number that can be read"] += 1
            continue
        space, address = number.space, number.value - first * (not number.is_wire)
        if number.space:
            address = number.value - 1
        elif styled and number.is_styled:
            space, address = _TABLE_DIGIT[number.table], number.within - 1
        elif styled:
            found.left_out["numbers that are not 40001-style"] += 1
            continue
        said = _BY_FUNCTION.get(re.sub(r"[^a-z0-9]", "", function.lower()), "")
        unsaid += not (space or said)
        entry = _mapped(found, row, said or space or table or "holding", address, number.registers)
        if entry is not None:
            found.entries.append(entry)
    if unsaid and table is None:
        what = "1 row does" if unsaid == 1 else f"{unsaid} rows do"
        found.said.append(f"{what} not say which table; holding registers are taken (--table says another)")


def _has_high(numbers: Sequence[_Number]) -> bool:
    """Whether one at least is not a small number that only looks so: 10001 may be 10001."""
    return any(one.space or one.table in (3, 4) for one in numbers)


def _number(text: str) -> _Number | None:
    text = text.strip()
    if (match := _PREFIXED.fullmatch(text)) and (match[1] != "0" or match[0][1] == ":"):  # 0x1234 is hexadecimal
        return _Number(int(match[2]), match[2], _TABLE_DIGIT[int(match[1])])
    if match := _HEX.fullmatch(text):
        return _Number(int(match[1] or match[2], 16), "", is_wire=True)
    if (match := _GROUPED.fullmatch(text)) and (match[2][0] == "0" or int(match[2]) - int(match[1]) >= 4):  # no 99,100
        return _Number(int(match[1] + match[2]), match[1] + match[2])
    if match := _DECIMAL.fullmatch(text):
        value = int(match[1])
        behind = int(match[3]) - value if match[3] else 0
        is_span = 0 < behind < 4 or (behind > 0 and match[2] in _SPAN_SIGNS)
        return _Number(value, match[1], registers=behind + 1 if is_span else None)
    return None


def _mapped(found: RegisterMap, row: Mapping[str, str], space: str, address: int, spanned: int | None) -> Mapped | None:
    """One row as an entry; None where it is nothing that a profile can say."""
    told, doubts = row.get("type", ""), []
    registers = _whole(row.get("registers", "")) or spanned
    kind = kind_of(told, registers) if told else _untold(space, registers)
    if re.search(r"str|char|ascii|text", told.lower()):
        found.left_out["texts"] += 1
        return None
    if space in ("coil", "discrete"):
        kind = Kind.BIT
    elif kind is None:
        found.left_out[f"type {told!r}"] += 1
        kind = Kind.U16
        doubts.append(f"the map calls its type {told!r}")
    elif kind is Kind.BIT:
        kind = Kind.U16
    elif not told and kind.registers > 1:
        doubts.append("the map says how many registers, not which type")
    if registers is not None and registers > 1 and kind.registers != registers and space not in ("coil", "discrete"):
        found.left_out[f"{registers} registers as {told or 'no type'}"] += 1
        doubts.append(f"the map gives it {registers} registers")
    order = order_of(row.get("order", "")) or order_of(told) or (False, False)
    scale, offset = _scale(found, row), _decimal(row.get("offset", ""))
    low, high = _range(row)
    states = _states(row.get("states", ""))
    for column, what, is_read in (
        ("offset", "offsets", offset is not None),
        ("low", "limits", low is not None),
        ("high", "limits", high is not None),
        ("range", "ranges", low is not None and high is not None),
        ("states", "lists of states", bool(states)),
    ):
        if not is_read and row.get(column, "") not in _NOTHING:
            found.left_out[f"{what} that cannot be read"] += 1
    entry = Mapped(
        space,
        address,
        row.get("name", "") or row.get("title", ""),
        kind,
        order[0] and kind.registers > 1,
        order[1],
        scale,
        offset or 0.0,
        row.get("unit", ""),
        low,
        high,
        _access(row.get("access", ""), space),
        states,
        "; ".join(doubts),
        _whole(row.get("station", "")),
    )
    return replace(entry, unit="" if entry.unit in _NOTHING else entry.unit)


def _untold(space: str, registers: int | None) -> Kind:
    """The type of what has none."""
    if space in ("coil", "discrete"):
        return Kind.BIT
    return {2: Kind.U32, 4: Kind.U64}.get(registers or 1, Kind.U16)


def _scale(found: RegisterMap, row: Mapping[str, str]) -> float:
    """raw · scale; a divisor is the same the other way round."""
    text, divisor = row.get("scale", ""), _decimal(row.get("divisor", ""))
    scale = (1.0 if text in _NOTHING else _factor(text) or 0.0) / (divisor or 1.0)
    if 0 < abs(scale) < MOST:
        return scale
    found.left_out["scales that cannot be read"] += 1
    return 1.0


def _factor(text: str) -> float | None:
    """ "0.1", "0,1", "x0.1", "/10", "1/10", "10^-1"; None for others, and for 0."""
    text = text.strip().lower().lstrip("x×*").strip()
    if match := re.fullmatch(r"(?:([\d.,]+)\s*)?[/:]\s*([\d.,]+)", text):
        over, under = _decimal(match[1] or "1"), _decimal(match[2])
        return over / under if over and under else None
    if match := re.fullmatch(r"10\s*(?:\^|\*\*|e)\s*([+-]?\d{1,2})", text):
        return 10.0 ** int(match[1])
    return _decimal(text.partition(" ")[0]) or None


def _decimal(text: str) -> float | None:
    text = text.strip().replace(",", ".") if text.count(",") <= 1 else ""
    if not re.fullmatch(r"[+-]?(\d+(\.\d*)?|\.\d+)(e[+-]?\d{1,2})?", text, re.IGNORECASE):
        return None
    value = float(text)
    return value if abs(value) < MOST else None


def _range(row: Mapping[str, str]) -> tuple[float | None, float | None]:
    """Least and most value, of two columns or of one; none where "1,250" in it may be 1.25 as well as 1250."""
    low, high = row.get("low", ""), row.get("high", "")
    match = _RANGE.fullmatch(row.get("range", ""))
    if match is not None and _decimal(low) is None and _decimal(high) is None:
        low, high = match[1], match[2]
    if any(map(_AMBIGUOUS.fullmatch, (low, high))) and not any(map(_DECIMAL_COMMA.fullmatch, (low, high))):
        return None, None
    return _decimal(low), _decimal(high)


def _whole(text: str) -> int | None:
    text = text.strip()
    return int(text) if text.isascii() and text.isdigit() and len(text) < 6 else None


def _access(text: str, space: str) -> Access:
    if space in ("input", "discrete"):
        return Access.READ
    plain = re.sub(r"[^a-z]", "", text.lower())
    if plain in ("r", "ro", "read", "readonly"):
        return Access.READ
    return Access.WRITE if plain in ("w", "wo", "write", "writeonly") else Access.BOTH


def _states(text: str) -> dict[int, str]:
    """ "0=off; 1=on"; empty where it is no such list."""
    parts = [part for part in re.split(r"[;,|\n]\s*(?=-?\d+\s*[=:])", text.strip()) if part]
    states: dict[int, str] = {}
    for part in parts:
        match = re.fullmatch(r"\s*(\d{1,5})\s*[=:]\s*(.+?)\s*", part, re.DOTALL)
        if match is None:
            return {}
        states[int(match[1])] = match[2]
    return states
