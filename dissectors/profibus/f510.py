"""Outputs to a TECO F510 and its inputs by its PROFIBUS card: sixteen words each way (manual, 1.3.6 and 1.3.7)."""

from __future__ import annotations

IDENT = 0xF510
CONFIGURATION = b"\x7f"

RUN, REVERSE = 0x0001, 0x0002
_RUNNING, _REVERSED, _READY, _ZERO, _AGREE, _FROM_BUS = 0x01, 0x02, 0x04, 0x20, 0x80, 0x2000


def outputs(command: int, hertz: float) -> bytes:
    """The words that a master gives: command bits, frequency in Hz."""
    words = [command, round(hertz * 100)] + [0] * 14
    return b"".join(word.to_bytes(2, "big") for word in words)


def drive(told: bytes, now: int) -> bytes:
    """The words that a drive gives while it does what it is told: the motor follows at once."""
    command, wanted = int.from_bytes(told[0:2], "big"), int.from_bytes(told[2:4], "big")
    runs = bool(command & RUN)
    speed = wanted if runs else 0
    status = _READY | _FROM_BUS | (_RUNNING | _AGREE if runs else _ZERO)
    if command & REVERSE:
        status |= _REVERSED
    current = 42 + speed // 250 if runs else 0
    volts = speed * 4400 // 6000
    words = [
        status,
        0,
        command >> 6 & 0x3F,
        wanted,
        speed,
        0,
        volts,
        current,
        0,
        1 if runs else 0,
        0,
        0,
        250,
        480,
        0,
        0,
    ]
    return b"".join(word.to_bytes(2, "big") for word in words)
