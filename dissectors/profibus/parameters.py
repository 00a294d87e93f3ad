"""Parameters from a master to a slave: Set_Prm, Global_Control, Set_Slave_Add (IEC 61158-6-3; notes of pyprofibus)."""

from __future__ import annotations

from dataclasses import dataclass

LEAST = 7
WATCHDOG, FREEZE, SYNC, UNLOCK, LOCK = 0x08, 0x10, 0x20, 0x40, 0x80
STATUS = ((WATCHDOG, "watchdog"), (FREEZE, "freeze"), (SYNC, "sync"), (UNLOCK, "unlock"), (LOCK, "lock"))
_MILLISECOND_BASE, _DPV1_ENABLED = 0x04, 0x80  # in the first octet of DP-V1 parameters
CLEAR, UNFREEZE, DO_FREEZE, UNSYNC, DO_SYNC = 0x02, 0x04, 0x08, 0x10, 0x20
_CONTROLS = ((CLEAR, "clear"), (UNFREEZE, "unfreeze"), (DO_FREEZE, "freeze"), (UNSYNC, "unsync"), (DO_SYNC, "sync"))


@dataclass(frozen=True, slots=True)
class Parameters:
    """`status`: the request bits. `factors`: of the watchdog. `tsdr`: least bits until it answers. `user`: the rest."""

    status: int
    factors: tuple[int, int]
    tsdr: int
    ident: int
    groups: int
    user: bytes

    @property
    def watchdogs_ms(self) -> tuple[int, int] | None:
        """Least and most time after which the slave drops out when its master is silent, ms; None: no watchdog.

        In steps of 10 ms, of 1 ms where the DP-V1 octet behind asks for that. Only the slave's GSD tells whether it is
        one: of other slaves that octet is the maker's. One that does not enable DP-V1 may be either.
        """
        if not self.status & WATCHDOG:
            return None
        steps = self.factors[0] * self.factors[1]
        first = self.user[0] if self.user else 0
        if not first & _MILLISECOND_BASE:
            return 10 * steps, 10 * steps
        return steps, steps if first & _DPV1_ENABLED else 10 * steps

    @property
    def watchdog_words(self) -> str:
        """The same in words: "300 ms"; empty without a watchdog."""
        if self.watchdogs_ms is None:
            return ""
        least, most = self.watchdogs_ms
        return f"{most} ms" if least == most else f"{most} ms, {least} ms if the slave is of DP-V1"

    @property
    def words(self) -> tuple[str, ...]:
        """The request bits in words."""
        return tuple(word for bit, word in STATUS if self.status & bit)


def parse_parameters(data: bytes) -> Parameters | None:
    """The parameters in the data of Set_Prm; None where it is too short."""
    if len(data) < LEAST:
        return None
    return Parameters(data[0], (data[1], data[2]), data[3], data[4] << 8 | data[5], data[6], data[LEAST:])


@dataclass(frozen=True, slots=True)
class GlobalControl:
    """`command`: bits; `groups`: those meant, 0 is all."""

    command: int
    groups: int

    @property
    def is_clear(self) -> bool:
        """Whether outputs are to be zero."""
        return bool(self.command & CLEAR)

    @property
    def words(self) -> str:
        """The commands in words; operate where there is none."""
        return ", ".join(word for bit, word in _CONTROLS if self.command & bit) or "operate"


def parse_global_control(data: bytes) -> GlobalControl | None:
    """The command in the data of Global_Control; None where it is too short."""
    return GlobalControl(data[0], data[1]) if len(data) >= 2 else None


@dataclass(frozen=True, slots=True)
class NewAddress:
    """`address`: the one to take; `is_final`: whether it may not be changed again."""

    address: int
    ident: int
    is_final: bool
    user: bytes


def parse_new_address(data: bytes) -> NewAddress | None:
    """The data of Set_Slave_Add; None where it is too short."""
    return NewAddress(data[0], data[1] << 8 | data[2], bool(data[3]), data[4:]) if len(data) >= 4 else None
