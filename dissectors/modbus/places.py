"""The place of a Modbus value: its register or coil in words, and its octets in the frame."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from dissectors.modbus.envelope import ASCII_NAME, adu
from dissectors.readings import Origin, Reading

if TYPE_CHECKING:
    from dissectors.frame import Frame
    from dissectors.meaning import Span

_WORDS = {"holding": "Register", "input": "Input register", "coil": "Coil", "discrete": "Discrete input"}
_FIRST = {"holding": 4, "input": 3}
_WRITTEN_AT = {0x05: 4, 0x06: 4, 0x0F: 7, 0x10: 7, 0x17: 11}
_ANSWERED_AT = 3


def place(reading: Reading, number: str, offset: int) -> str:
    """`Register 2524h (wire 0x2524)` where the manual has a number, else as the field: `Register 0x2524 (49509)`.

    Coils and inputs of one bit count from 1: `Coil 17 (wire 0x0010)`.
    """
    word, wire = _WORDS.get(reading.space, reading.space), f"0x{reading.address:04X}"
    if number:
        differs = f", the manual's {offset:+d}".replace("-", "−") if offset else ""
        return f"{word} {number} (wire {wire}{differs})"
    first = _FIRST.get(reading.space)
    if first is None:
        return f"{word} {reading.address + 1} (wire {wire})"
    return f"{word} {wire} ({first}{reading.address + 1:0{4 if reading.address < 9999 else 5}d})"


def spans(frame: Frame, readings: Sequence[Reading]) -> list[Span | None]:
    """The octets of each reading of a frame that carries them one behind the other. Total."""
    octets = adu(frame)
    if len(octets) < 2 or not readings:
        return [None] * len(readings)
    begin = _ANSWERED_AT if readings[0].how is Origin.READ else _WRITTEN_AT.get(octets[1], len(octets))
    step = 0 if octets[1] == 0x05 else 1
    found: list[Span | None] = []
    for place, reading in enumerate(readings):
        bit = reading.space not in _FIRST
        at = begin + (step * place // 8 if bit else 2 * place)
        end = at + (2 if not bit or octets[1] == 0x05 else 1)
        if end > len(octets):
            found.append(None)
        elif frame.protocol == ASCII_NAME:
            found.append((1 + 2 * at, 1 + 2 * end))
        else:
            found.append((at, end))
    return found
