"""Frames torn by a read that came late: nobody's damage.

A busy computer reads late. The part of a frame that it had read before stands alone, behind it a silence that there
never was, and the rest comes with all that followed. Where the read is no longer than the adapter itself may hold
octets back, its time proves nothing (`Frame.slack` is the adapter's). But the pieces, put together as they were heard,
are a good frame again, and no damage makes one.

A station that pauses inside its frames does the same. Whose frames are torn more than those of others is told of the
line (LN206), where all senders are compared; here none of it is damage.
"""

from __future__ import annotations

from collections import deque
from typing import Final

from dissectors.checksums import crc16_modbus, lrc
from dissectors.frame import Event, Frame
from dissectors.modbus.envelope import ASCII_NAME, hex_pairs

PIECES: Final = 8
"""Most rows that one torn frame is."""

_LONGEST = 513  # octets of an ASCII frame
_KEPT = 64
_LEAST_RTU, _LEAST_ASCII = 4, 3  # octets with the check


class TornFrames:
    """Fed every row; tells the transactions whose frames a late read tore."""

    def __init__(self) -> None:
        self._pieces: list[bytes] = []  # rows since the last good frame
        self._of: list[int] = []  # their transactions
        self._torn: deque[int] = deque(maxlen=_KEPT)
        self._behind: deque[int] = deque(maxlen=2 * _KEPT)  # rows of last pieces, and those after them
        self._is_ascii = False

    def see(self, no: int, event: Event, transaction: int | None, *, is_good_frame: bool) -> None:
        """Take a row; `transaction`: the one it belongs to, of noise that of the newest request."""
        if isinstance(event, Frame):
            self._is_ascii = event.protocol == ASCII_NAME
        if is_good_frame:
            self._clear()
            return
        self._pieces.append(event.octets)
        if transaction is not None:
            self._of.append(transaction)
        if len(self._pieces) > PIECES:
            self._clear()
        elif len(self._pieces) > 1 and self._is_whole():
            self._torn.extend(self._of)
            self._behind.extend((no, no + 1))
            self._clear()

    def is_torn(self, transaction: int | None) -> bool:
        """Whether a frame of the transaction was torn."""
        return transaction in self._torn

    def may_answer(self, response: int | None) -> bool:
        """Whether what is in this row may be the answer to a torn request."""
        return response in self._behind

    def _is_whole(self) -> bool:
        if sum(map(len, self._pieces)) > _LONGEST:
            return False
        whole = b"".join(self._pieces)
        return _is_good_ascii(whole) if self._is_ascii else len(whole) >= _LEAST_RTU and not crc16_modbus(whole)

    def _clear(self) -> None:
        self._pieces, self._of = [], []


def _is_good_ascii(octets: bytes) -> bool:
    start, pairs, end = hex_pairs(octets)
    if start != b":" or end not in (b"\r\n", b"\r") or len(pairs) < 2 * _LEAST_ASCII:
        return False
    values = bytes.fromhex(bytes(octet & 0x7F for octet in pairs).decode())  # bit 7 may be the parity bit
    return lrc(values[:-1]) == values[-1]
