"""Tables of octets as logic analysers write them (CSV): where octet, begin, end and errors stand in a row. Pure.

| column | its names |
|---|---|
| octet | octet, byte, data, value, hex: `0x01`, `01`, `'A' (0x41)`; several octets may stand in one cell |
| begin, s | t_start_s, start, start_s, begin; start_time, time [s] (Saleae Logic: begin of the start bit) |
| end, s | t_end_s, end, end_s, time, time_s, timestamp, t; or a duration beside the begin |
| errors | parity error, framing error (anything but empty, 0 and false); error: words that name them |
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation

from dissectors.frame import Chunk, LineError, Mark

OCTET = ("octet", "byte", "data", "value", "hex")
BEGIN = ("t_start_s", "start", "start_s", "begin", "start_time", "time [s]")
END = ("t_end_s", "end", "end_s", "time", "time_s", "timestamp", "t")
DURATION = ("duration", "duration_s", "duration [s]")
ERRORS = {"parity error": LineError.PARITY, "framing error": LineError.FRAMING}
ANY_ERROR = "error"

LATEST = 1 << 33
"""s; beyond it a number is no time."""

_SHOWN = re.compile(r"\(0[xX]([0-9A-Fa-f]{2})\)\s*")  # behind the character, as Saleae shows "ASCII and hex"
_PAIR = re.compile(r"[\s,;]*(?:0[xX])?([0-9A-Fa-f]{2})")


@dataclass(frozen=True, slots=True)
class Columns:
    """Where things stand in a row; None where there is no such column."""

    octet: int
    begin: int | None = None
    end: int | None = None
    duration: int | None = None
    errors: tuple[tuple[int, LineError | None], ...] = ()
    """Column → the error it tells; None: it names the error itself."""

    @property
    def exact(self) -> bool:
        """Whether the time of each octet is measured on the line: both its ends, or its begin."""
        return self.begin is not None

    def chunk(self, row: Sequence[str], char: int) -> Chunk:
        """The octets of a row, at their end; `char`: ns of a character, where only the begin is told.

        Raises ValueError for a row that says less than it should.
        """
        octets = octets_of(_cell(row, self.octet))
        if not octets:
            raise ValueError("no octets")
        return Chunk(self._end(row, len(octets) * char), octets, self._marks(row))

    def _end(self, row: Sequence[str], length: int) -> int:
        if self.end is not None:
            return seconds(_cell(row, self.end))
        begin = seconds(_cell(row, self.begin))
        return begin + (seconds(_cell(row, self.duration)) if self.duration is not None else length)

    def _marks(self, row: Sequence[str]) -> tuple[Mark, ...]:
        found = LineError(0)
        for place, error in self.errors:
            said = _cell(row, place).strip().lower()
            if error is None:
                for name in LineError:
                    found |= name if (name.name or "").lower() in said else LineError(0)
            elif said not in ("", "0", "false"):
                found |= error
        return (Mark(0, found),) if found else ()


def columns(heading: str) -> Columns | None:
    """The columns that a heading names; None when octets or times are not among them."""
    names = [name.strip().strip('"').lower() for name in heading.split(",")]

    def place(known: Iterable[str]) -> int | None:
        return next((names.index(name) for name in known if name in names), None)

    octet, begin, end = place(OCTET), place(BEGIN), place(END)
    if octet is None or (begin is None and end is None):
        return None
    errors = [(names.index(name), error) for name, error in ERRORS.items() if name in names]
    named = [(names.index(ANY_ERROR), None)] if ANY_ERROR in names else []
    return Columns(octet, begin, end, place(DURATION), (*errors, *named))


def octets_of(text: str) -> bytes:
    """The octets of a text of hexadecimal pairs: `01 03`, `0103`, `0x01, 0x03`, `'A' (0x41)`. Raises ValueError."""
    shown = _SHOWN.search(text)
    if shown is not None and shown.end() == len(text):
        return bytes.fromhex(shown[1])
    found, at = bytearray(), 0
    text = text.strip(" \t,;")
    while at < len(text):
        match = _PAIR.match(text, at)
        if match is None:
            raise ValueError(f"octets {text[at : at + 20]!r}: expected hexadecimal pairs")
        found.append(int(match[1], 16))
        at = match.end()
    return bytes(found)


def seconds(text: str) -> int:
    """Seconds as a decimal number → ns, exactly. Raises ValueError."""
    try:
        number = Decimal(text.strip().replace(",", "."))
    except InvalidOperation:
        raise ValueError(f"time {text[:20]!r}: expected seconds") from None
    if not number.is_finite() or abs(number) > LATEST:
        raise ValueError(f"time {text[:20]!r}: expected seconds, less than {LATEST}")
    return int(number * 1_000_000_000)


def _cell(row: Sequence[str], place: int | None) -> str:
    if place is None or place >= len(row):
        raise ValueError("a row that is too short")
    return row[place]
