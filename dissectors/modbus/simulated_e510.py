"""A simulated TECO E510 drive: the register map of its device profile, a small model of a motor behind it.

    SimulatedE510(unit=1)      answers 03, 06, 08 and 10h like the manual says

Source: TECO E510 Communication Addendum (2017.08), 1.0.1 (frames, exception codes), 1.0.2 (registers 2500h … 252Fh),
1.0.3 (parameters). What the manual does not say (ramps, currents, voltages) is plausible, not measured.

Its manual disagrees with itself on exception codes: the table has 01 … 05, the worked examples 51h, 52h and 20h. So
does this drive: `examples=True` answers with the codes of the examples.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from dissectors.line import NS_PER_S
from dissectors.modbus.lengths import MAX_FRAME
from dissectors.modbus.simulated import ILLEGAL_ADDRESS, ModbusServer, Refused
from dissectors.profiles.packaged import packaged
from dissectors.simulated import Send

DATA_SETTING, WRITE_MODE = 4, 5  # exception codes of the manual's table beside the standard's 01 … 03
_LIMITS = packaged("teco-e510").limits_on("modbus")
LONGEST_FRAME = _LIMITS.frame or MAX_FRAME
RESPONSE_TIME = _LIMITS.response or 0

RUN, REVERSE, EXTERNAL_FAULT, FAULT_RESET = 0x0001, 0x0002, 0x0004, 0x0008  # command word 2501h
EXTERNAL_FAULT_CODE = 17  # 2521h
NOMINAL_DC_BUS = 3_250  # 0.1 V: a 230 V drive
IDENTITY = 0x0510  # 252Fh names the series; the manual gives no values


@dataclass(slots=True)
class Drive:
    """A motor that follows its frequency command at a constant rate, ns by ns.

    Frequencies in 0.01 Hz, voltage in 0.1 V, current in 0.1 A, as on the wire. `ramp`: 0.01 Hz a second.
    """

    ramp: int = 1_000
    command_word: int = 0
    set_point: int = 0
    output: float = 0.0
    fault: int = 0
    now: int | None = None

    @property
    def running(self) -> bool:
        return bool(self.command_word & RUN) and not self.fault

    def advance(self, now: int) -> None:
        """Let the motor follow up to `now`, ns."""
        elapsed = 0 if self.now is None else max(0, now - self.now)
        self.now = now
        target = self.set_point if self.running else 0
        step = self.ramp * elapsed / NS_PER_S
        distance = target - self.output
        self.output = target if abs(distance) <= step else self.output + math.copysign(step, distance)

    def obey(self, word: int) -> None:
        """Take a command word (2501h)."""
        if word & EXTERNAL_FAULT and not self.fault:
            self.fault = EXTERNAL_FAULT_CODE
        elif word & FAULT_RESET and not word & RUN:
            self.fault = 0
        self.command_word = word

    def set_frequency(self, value: int) -> None:
        """Take a frequency command (2502h), 0 … 599.00 Hz."""
        if value > 59_900:
            raise Refused(DATA_SETTING)
        self.set_point = value

    def status(self) -> int:
        """Bits of 2520h."""
        output = round(self.output)
        bits = {
            0: self.running,
            1: bool(self.command_word & REVERSE),
            2: not self.fault,
            3: bool(self.fault),
            5: output == 0,
            7: self.running and output == self.set_point,
            8: self.running and output == self.set_point,
        }
        return sum(1 << bit for bit, on in bits.items() if on)

    def frequency(self) -> int:
        """Output frequency, 2524h."""
        return round(self.output)

    def dc_bus(self) -> int:
        """DC bus voltage, 2526h: sags with load, with the mains' ripple on it."""
        ripple = 12 * math.sin((self.now or 0) / NS_PER_S * 2 * math.pi * 0.7)
        return round(NOMINAL_DC_BUS - self.output / 60 + ripple)

    def current(self) -> int:
        """Output current, 2527h: magnetising current, load, and more while it accelerates."""
        if self.output == 0:
            return 0
        accelerating = self.running and round(self.output) != self.set_point
        return round(12 + self.output / 150 + 30 * accelerating)


Read = Callable[[Drive], int]
Write = Callable[[Drive, int], None]


@dataclass(frozen=True, slots=True)
class Register:
    """One register of the map: how it is read, and how it is written if it may be."""

    address: int
    name: str
    read: Read | None = None
    write: Write | None = None


def _command(drive: Drive) -> int:
    return drive.command_word


def _set_point(drive: Drive) -> int:
    return drive.set_point


def _fault(drive: Drive) -> int:
    return drive.fault


def _digital_inputs(drive: Drive) -> int:
    return drive.command_word >> 6 & 0x3F  # inputs S1 … S6 may be set by the command word


def _relay(drive: Drive) -> int:
    return int(drive.running)


def _identity(drive: Drive) -> int:
    return IDENTITY


def _nothing(drive: Drive) -> int:
    return 0


_BEHAVIOUR: dict[str, tuple[Read, Write | None]] = {
    "command": (_command, Drive.obey),
    "set-frequency": (_set_point, Drive.set_frequency),
    "status": (Drive.status, None),
    "fault": (_fault, None),
    "inputs": (_digital_inputs, None),
    "frequency-command": (_set_point, None),
    "output-frequency": (Drive.frequency, None),
    "dc-voltage": (Drive.dc_bus, None),
    "output-current": (Drive.current, None),
    "outputs": (_relay, None),
    "analog-output-1": (lambda drive: drive.frequency() // 60, None),
    "series": (_identity, None),
}
"""What stands behind a point of the profile. Any other is a plain store, or 0 where it cannot be written."""

_ONLY_IN_AN_EXAMPLE = 0x0123  # the manual's worked example reads it; its tables have no such register


def _registers() -> Iterator[Register]:
    """The register map of the profile with the motor behind it."""
    for entry in packaged("teco-e510").in_space("holding"):
        if entry.address == _ONLY_IN_AN_EXAMPLE:
            continue
        read, write = _BEHAVIOUR.get(entry.name, (None, None))
        if read is None and (entry.reserved or not entry.access.writable):
            read = _nothing
        for step in range(entry.kind.registers):
            yield Register(entry.address + step, entry.title, read, write)


REGISTERS: tuple[Register, ...] = tuple(_registers())

_EXAMPLE_CODES = {(code, cause): 0x52 for code in (3, 6, 16) for cause in range(1, 6)} | {(8, 3): 0x20}


class _Map:
    """The register map as a bank of holding registers."""

    def __init__(self, drive: Drive) -> None:
        self.drive = drive
        self.stored = {register.address: 0 for register in REGISTERS if register.read is None}

    def read(self, address: int) -> int:
        register = _register(address)
        return self.stored[address] if register.read is None else register.read(self.drive)

    def write(self, address: int, value: int) -> None:
        register = _register(address)
        if register.write is not None:
            register.write(self.drive, value)
        elif register.read is None:
            self.stored[address] = value
        else:
            raise Refused(WRITE_MODE)


def _register(address: int) -> Register:
    try:
        return _BY_ADDRESS[address]
    except KeyError:
        raise Refused(ILLEGAL_ADDRESS) from None


_BY_ADDRESS = {register.address: register for register in REGISTERS}


class SimulatedE510(ModbusServer):
    """One drive at a unit address (1 … 254); `drive` is the motor behind the registers."""

    def __init__(
        self,
        unit: int,
        *,
        is_ascii: bool = False,
        delay: int = RESPONSE_TIME,
        examples: bool = False,
        ramp: int = 1_000,
    ) -> None:
        self.drive = Drive(ramp=ramp)
        super().__init__(
            unit,
            holding=_Map(self.drive),
            is_ascii=is_ascii,
            delay=delay,
            functions=frozenset((3, 6, 8, 16)),
            codes=_EXAMPLE_CODES if examples else None,
            longest=LONGEST_FRAME,
            loopback_only=True,
        )

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        """See `dissectors.simulated.Station`; the motor has turned on meanwhile."""
        self.drive.advance(now)
        return super().hear(now, octets, quiet)
