"""Undo the marking that a tty does with PARMRK set; a stateful decoder over any cut of the stream.

      on the line                      what read() gives
      FF                               FF FF
      octet x with an error            FF 00 x
      break (or octet 00 in error)     FF 00 00
      anything else                    itself

Source: termios(3), PARMRK; Linux n_tty also doubles FF where no error can occur, as on a pseudo-terminal. The driver
does not say whether parity or framing failed. Without parity it can only be framing; with parity both are marked.
An octet 00 with an error looks exactly like a break and is called one.
"""

from __future__ import annotations

from dissectors.frame import LineError, Mark

_ESCAPE = 0xFF
_ERROR = 0x00


class ParmrkDecoder:
    """Gives octets and marks; an escape cut by the end of a read is finished by the next one.

    `parity`: whether the line has a parity bit. Any octets: never raises. Octets after an escape that mean nothing
    (a driver would not send them) are kept as they came.
    """

    def __init__(self, parity: bool) -> None:
        self.error = LineError.PARITY | LineError.FRAMING if parity else LineError.FRAMING
        self._held = b""  # FF, or FF 00: an escape that is not complete

    def feed(self, data: bytes) -> tuple[bytes, tuple[Mark, ...]]:
        """Octets as on the line and their marks, offsets from the first octet given now."""
        if self._held:
            data = self._held + data
            self._held = b""
        at = data.find(_ESCAPE)
        if at < 0:
            return data, ()
        octets = bytearray()
        marks: list[Mark] = []
        begin = 0
        while at >= 0:
            octets += data[begin:at]
            escaped = data[at : at + 3]
            if len(escaped) < 2 or (len(escaped) < 3 and escaped[1] == _ERROR):
                self._held = escaped
                begin = len(data)
            elif escaped[1] == _ERROR:
                error = self.error if escaped[2] else LineError.BREAK
                marks.append(Mark(len(octets), error))
                octets.append(escaped[2])
                begin = at + 3
            else:
                octets.append(_ESCAPE)
                begin = at + 2 if escaped[1] == _ESCAPE else at + 1
            at = data.find(_ESCAPE, begin)
        octets += data[begin:]
        return bytes(octets), tuple(marks)

    def flush(self) -> bytes:
        """What an unfinished escape held, as it came; the stream ends or its settings change here."""
        held, self._held = self._held, b""
        return held
