"""What came in place of one station's answers and is none of its frames, in words. Pure."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from dissectors.findings import Finding, counted, times
from dissectors.modbus.bus_record import BusRecord
from dissectors.modbus.rules import RULES
from dissectors.modbus.station_record import StationRecord

_TEXT_SHOWN: Final = 24
_HEX_SHOWN: Final = 16

_BAD_COPY: Final = (
    "whoever listens here hears the request once more, and badly: a driver that is not switched on, or a pair that "
    "is not driven (A and B, supply, ground); the station need not be at fault"
)
_BAD_COPY_NEXT: Final = "the adapter's direction control and wiring; then whether the station answers"
_SEVEN_BITS: Final = "the device sends 7 data bits and a parity bit, where this line has 8: as for Modbus ASCII"
_SEVEN_BITS_NEXT: Final = "data bits, parity and mode (RTU, ASCII) in the device's settings"


def foreign_answers(seen: BusRecord, name: str, station: StationRecord) -> Finding | None:
    """Octets in place of answers that are always the same, or those of another baud rate."""
    garbage = station.garbage
    same, factor = garbage.always(), garbage.slower_by()
    if not garbage.is_system or 2 * garbage.tally.count < station.damaged.count:
        return None
    if garbage.is_copy:
        words = f"{times(garbage.copied)} the request came back, with bits changed to one side"
        words += f": {_hex(garbage.stretches[-1])}"
        return replace(garbage.tally.found(RULES["MB018"], name, words), means=_BAD_COPY, next=_BAD_COPY_NEXT)
    if same is not None and 2 * garbage.begun > garbage.tally.count:
        words = f"{counted(garbage.tally.count, 'damaged answer')}, always the same {_octets(len(same))}: {_hex(same)}"
        return garbage.tally.found(RULES["MB015"], name, words)
    text, parity = garbage.text(), garbage.parity()
    if factor is None and text is None and not parity and station.answered > garbage.tally.count:
        return None  # it speaks as this line does; what falls on its answers always begins so late
    words = f"{times(garbage.tally.count)} something that is not this protocol came in answer"
    if same is not None:
        words += f", always the same {_octets(len(same))}: {_hex(same)}"
    if factor is not None:
        baud = seen.timing.line.baud
        rates = f": about {baud // factor} Bd, not {baud}" if seen.timing.has_rate else ", whose baud rate nobody said"
        words += f"; its bits are {factor} times as long as those of this line{rates}"
    elif text is not None:
        words += f"; it is text{f' with 7 data bits and {text[1]} parity' if text[1] else ''}: {_quoted(text[0])}"
    elif parity:
        words += f"; all its octets have {parity} parity, as 7 data bits and a parity bit have"
        seven = garbage.tally.found(RULES["MB014"], name, words)
        return replace(seven, means=_SEVEN_BITS, next=_SEVEN_BITS_NEXT)
    return garbage.tally.found(RULES["MB014"], name, words)


def _quoted(text: str) -> str:
    return ascii(text[:_TEXT_SHOWN])[1:-1].join("“”") + (" …" if len(text) > _TEXT_SHOWN else "")


def _octets(count: int) -> str:
    return counted(count, "octet")


def _hex(octets: bytes) -> str:
    return octets[:_HEX_SHOWN].hex(" ").upper() + (" …" if len(octets) > _HEX_SHOWN else "")
