"""A request as the rules see it."""

from __future__ import annotations

from dataclasses import dataclass

from dissectors.frame import Frame, Header, Role
from dissectors.modbus.functions import BROADCAST, EXCEPTION_BIT
from dissectors.modbus.station_record import Key


@dataclass(frozen=True, slots=True)
class AskedRequest:
    """The request of an open transaction."""

    no: int
    frame: Frame
    header: Header
    octets: bytes

    @property
    def unit(self) -> int:
        """The unit asked."""
        return self.octets[0] if self.octets else 0

    @property
    def key(self) -> Key:
        """What it asks for, as a poll list has it."""
        return self.header.kind, self.header.address

    @property
    def is_for_nobody(self) -> bool:
        """Whether it reads from address 0."""
        return self.unit == BROADCAST and self.header.role is Role.REQUEST and self.header.ok

    @property
    def fault(self) -> str | None:
        """What it says that contradicts itself, though its check is good."""
        return self.header.error if self.header.ok and not self.octets[1] & EXCEPTION_BIT else None
