"""The frame control octet: what a telegram wants or says, by function code (IEC 61158-4-3; notes of pyprofibus)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

REQUEST = 0x40
FCB = 0x20
FCV = 0x10


@dataclass(frozen=True, slots=True)
class Function:
    """A request: its name, and whether somebody answers it."""

    name: str
    answered: bool


REQUESTS: dict[int, Function] = {
    0x0: Function("time event", False),
    0x3: Function("SDA low", True),
    0x4: Function("SDN low", False),
    0x5: Function("SDA high", True),
    0x6: Function("SDN high", False),
    0x7: Function("diagnosis request", True),
    0x9: Function("FDL status", True),
    0xC: Function("SRD low", True),
    0xD: Function("SRD high", True),
    0xE: Function("ident request", True),
    0xF: Function("LSAP status", True),
}
SDN = frozenset((0x4, 0x6))
FDL_STATUS = 0x9


class Status(Enum):
    """What an answer says of the request. The value is the function code; `short` its name in the standard."""

    OK = 0x0
    USER_ERROR = 0x1
    NO_RESOURCE = 0x2
    NOT_ACTIVATED = 0x3
    DATA_LOW = 0x8
    NO_DATA = 0x9
    DATA_HIGH = 0xA
    DATA_LOW_NO_RESOURCE = 0xC
    DATA_HIGH_NO_RESOURCE = 0xD

    @property
    def short(self) -> str:
        """As the standard abbreviates it."""
        return _SHORT[self]

    @property
    def words(self) -> str:
        """For people."""
        return _WORDS[self]

    @property
    def refuses(self) -> bool:
        """Whether the request was not carried out."""
        return self in (Status.USER_ERROR, Status.NO_RESOURCE, Status.NOT_ACTIVATED)

    @property
    def is_urgent(self) -> bool:
        """High priority: in cyclic exchange the slave has a diagnosis to fetch."""
        return self in (Status.DATA_HIGH, Status.DATA_HIGH_NO_RESOURCE)


_SHORT = {
    Status.OK: "OK",
    Status.USER_ERROR: "UE",
    Status.NO_RESOURCE: "RR",
    Status.NOT_ACTIVATED: "RS",
    Status.DATA_LOW: "DL",
    Status.NO_DATA: "NR",
    Status.DATA_HIGH: "DH",
    Status.DATA_LOW_NO_RESOURCE: "RDL",
    Status.DATA_HIGH_NO_RESOURCE: "RDH",
}
_WORDS = {
    Status.OK: "done",
    Status.USER_ERROR: "user error",
    Status.NO_RESOURCE: "no room for the data",
    Status.NOT_ACTIVATED: "service not activated",
    Status.DATA_LOW: "data",
    Status.NO_DATA: "no data",
    Status.DATA_HIGH: "data, high priority",
    Status.DATA_LOW_NO_RESOURCE: "data, but no room for those sent",
    Status.DATA_HIGH_NO_RESOURCE: "data, high priority, but no room for those sent",
}


class StationType(Enum):
    """Who answers."""

    SLAVE = 0
    MASTER_NOT_READY = 1
    MASTER_READY = 2
    MASTER_IN_RING = 3

    @property
    def words(self) -> str:
        """For people."""
        return _TYPE_WORDS[self.value]


_TYPE_WORDS = ("slave", "master, not ready", "master, ready for the ring", "master in the ring")
_STATUSES = {one.value: one for one in Status}
_REQUESTS_KNOWN = frozenset(REQUESTS)


@dataclass(frozen=True, slots=True)
class Control:
    """A frame control octet, taken apart."""

    octet: int

    @property
    def is_request(self) -> bool:
        """Whether it asks or sends; else it answers."""
        return bool(self.octet & REQUEST)

    @property
    def code(self) -> int:
        """The function code."""
        return self.octet & 0x0F

    @property
    def is_known(self) -> bool:
        """Whether the standard has it; all others are no telegram of this bus."""
        if self.octet & 0x80:
            return False
        return self.code in (_REQUESTS_KNOWN if self.is_request else _STATUSES)

    @property
    def wants_answer(self) -> bool:
        """Whether somebody must answer."""
        return self.is_request and self.code in REQUESTS and REQUESTS[self.code].answered

    @property
    def is_sdn(self) -> bool:
        """Send data with no acknowledge."""
        return self.is_request and self.code in SDN

    @property
    def fcb(self) -> bool:
        """The frame count bit, which alternates from request to request of one station."""
        return bool(self.octet & FCB)

    @property
    def fcv(self) -> bool:
        """Whether the frame count bit counts."""
        return bool(self.octet & FCV)

    @property
    def status(self) -> Status | None:
        """Of an answer; None where the code is unknown, or it is a request."""
        return None if self.is_request else _STATUSES.get(self.code)

    @property
    def station_type(self) -> StationType | None:
        """Of an answer, who gives it."""
        return None if self.is_request else StationType(self.octet >> 4 & 3)

    @property
    def words(self) -> str:
        """The function for people."""
        if self.is_request:
            return REQUESTS[self.code].name if self.code in REQUESTS else f"function {self.code:X}h"
        status = self.status
        return status.words if status is not None else f"status {self.code:X}h"
