"""Cells of a table: octets and times as tools write them. Pure."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from decimal import Decimal, InvalidOperation

from sniff.formats.log_times import AS_WRITTEN, Times

MOST = 1 << 62
"""ns: a number beyond it is no time."""

UNITS = {"s": 1_000_000_000, "ms": 1_000_000, "us": 1000, "µs": 1000, "μs": 1000, "ns": 1}
_WITH_UNIT = re.compile(r"(?P<number>[+-]?\d{1,18}(?:[.,]\d{1,12})?) ?(?P<unit>s|ms|us|µs|μs|ns)")

_NUMBER = re.compile(r"[+-]?\d{1,18}(?:[.,](?P<decimals>\d{1,18}))?(?:[eE](?P<power>[+-]?\d{1,3}))?")

MOST_CELL = 1 << 16
LATEST = 1 << 33
"""s; beyond it a number is no time."""

_SHOWN = re.compile(r"\(0[xX]([0-9A-Fa-f]{2})\)\s*")  # behind the character, as Saleae shows "ASCII and hex"
_PAIR = re.compile(r"[\s,;]*(?:0[xX]|h)?([0-9A-Fa-f]{2})")
_DECIMAL = re.compile(r"\d{1,3}")
_BINARY = re.compile(r"(?:0b)?[01]{4}[ _]?[01]{4}")
_QUOTED = re.compile(r"'(\d{1,3})'")
_WORDS_OF_CHARACTERS = {"comma": ",", "' '": " ", "\\t": "\t", "\\r": "\r", "\\n": "\n", "\\\\": "\\", "\\0": "\0"}


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
    fitting = sum(fits(octets_of, cell) for cell in cells)
    if cells and 2 * fitting < len(cells) and all(len(cell) == 1 for cell in cells):
        return _character
    if 2 * fitting < len(cells) <= 2 * sum(fits(_among_words, cell) for cell in cells):
        return _among_words
    return octets_of


def fits(read: Callable[[str], bytes], cell: str) -> bool:
    """Whether a cell is written so."""
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


def _among_words(text: str) -> bytes:
    """The octets in a message of a program."""
    from sniff.formats.log_octets import octets_in

    run = octets_in(text[:MOST_CELL])
    if run is None or len(run.octets) < 3 or run.broken:
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


def tick_of(text: str, unit: int, times: Times = AS_WRITTEN) -> int | None:
    """The place of the last digit of such a cell, ns; None of one that holds no time."""
    from sniff.formats.log_clock import stamp_of

    counted = _WITH_UNIT.fullmatch(text.strip())
    number, unit = (text.strip(), unit) if counted is None else (counted["number"], UNITS[counted["unit"]])
    match = _NUMBER.fullmatch(number)
    if match is not None:
        place = len(match["decimals"] or "") - int(match["power"] or 0)
        tick: int = unit // 10**place if place >= 0 else unit * 10 ** min(-place, DIGITS)
        return max(1, tick)
    stamp = stamp_of(text.strip(), times)
    return None if stamp is None or stamp.begin else stamp.tick


def seconds(text: str) -> int:
    """Seconds as a decimal number → ns, exactly. Raises ValueError."""
    return scaled(text, UNITS["s"])


DIGITS = 40
"""With more of them before its point a number is none; with a million of them nothing can be reckoned with it."""


def scaled(text: str, unit: int) -> int:
    """A decimal number of `unit`s (ns) → ns, exactly. Raises ValueError."""
    try:
        number = Decimal(text.strip().replace(",", "."))
    except InvalidOperation:
        raise ValueError(f"time {text[:20]!r}: expected seconds") from None
    if not number.is_finite() or number.adjusted() > DIGITS or abs(number) * unit > LATEST * UNITS["s"]:
        raise ValueError(f"time {text[:20]!r}: expected seconds, less than {LATEST}")
    return int(number * unit)
