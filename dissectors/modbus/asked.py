"""A request as the rules see it."""

from __future__ import annotations

from dataclasses import dataclass

from dissectors.frame import Frame, Header, Role
from dissectors.late_speakers import Due
from dissectors.modbus.envelope import ASCII_NAME
from dissectors.modbus.functions import BROADCAST, EXCEPTION_BIT, ITEMS_ASKED, answer_length
from dissectors.modbus.limits import beyond_limits
from dissectors.modbus.notation import CHECK, HEAD
from dissectors.modbus.poll_order import Asked
from dissectors.modbus.station_record import Key
from dissectors.quick_values import quickly_made

LONGEST_READ = 11
"""Octets: no RTU request that reads is longer, and what is stuck to it by noise."""

_USUAL_ANSWER = 8  # octets of an answer of unknown length, RTU


@quickly_made
@dataclass(frozen=True, slots=True)
class AskedRequest:
    """The request of an open transaction."""

    no: int
    frame: Frame
    header: Header
    octets: bytes
    is_behind_silence: bool = False  # a long one: what could be an answer may be one

    @property
    def unit(self) -> int:
        """The unit asked."""
        return self.octets[0] if self.octets else 0

    @property
    def key(self) -> Key:
        """What it asks for, as a poll list has it."""
        return self.header.kind, self.header.address

    @property
    def in_list(self) -> Asked:
        """The same, with whom it asks."""
        return self.unit, self.key

    @property
    def due(self) -> Due:
        """Its answer, as it is on the line."""
        is_ascii = self.frame.protocol == ASCII_NAME
        unit = b":" + self.octets[:1].hex().upper().encode() if is_ascii else self.octets[:1]
        begin = self._answer_begin()
        size = begin[-1] + HEAD + 1 + CHECK if begin else 0
        on_line = b":" + begin.hex().upper().encode() if is_ascii and begin else begin
        return Due(unit, on_line, size if size > LONGEST_READ and not is_ascii else 0)

    def _answer_begin(self) -> bytes:
        """Unit, function and count of its answer; empty where it may itself begin so."""
        code = self.octets[1] if len(self.octets) > 1 else 0
        length = answer_length(self.octets + bytes(CHECK)) if code in ITEMS_ASKED else None
        if length is None or length - HEAD - 1 - CHECK > 0xFF:
            return b""
        begin = self.octets[:HEAD] + bytes((length - HEAD - 1 - CHECK,))
        return b"" if self.octets.startswith(begin) else begin

    def answer_time(self, char: int) -> int:
        """ns that its answer lasts, where a character takes `char`."""
        octets = answer_length(self.octets + bytes(CHECK)) or _USUAL_ANSWER
        return char * (2 * octets + 1 if self.frame.protocol == ASCII_NAME else octets)

    @property
    def is_for_nobody(self) -> bool:
        """Whether it reads from address 0."""
        return self.unit == BROADCAST and self.header.role is Role.REQUEST and self.header.ok

    @property
    def beyond(self) -> str | None:
        """What it asks for that no request may, in words; damage alone may say that."""
        return beyond_limits(self.octets) if self.header.ok else None

    @property
    def fault(self) -> str | None:
        """What it says that contradicts itself, though its check is good."""
        return self.header.error if self.header.ok and not self.octets[1] & EXCEPTION_BIT else None
