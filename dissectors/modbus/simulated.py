"""A Modbus server for a virtual bus: octets and times in, octets and times out.

    ModbusServer(unit=1, holding=Cells({0x2520: 7}))      answers what is addressed to it, obeys broadcasts

It implements `dissectors.simulated.Station`, and speaks RTU, or ASCII when told so. The master is in
`simulated_master.py`, a drive made of such a server in `simulated_e510.py`.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

from dissectors.line import MS
from dissectors.modbus.envelope import seal_ascii, seal_rtu, unseal
from dissectors.modbus.functions import BROADCAST, DIAGNOSTIC_LISTEN_ONLY, DIAGNOSTIC_LOOPBACK, EXCEPTION_BIT, FUNCTIONS
from dissectors.modbus.layout import (
    MAX_READ_BITS,
    MAX_READ_REGISTERS,
    MAX_READ_WRITE_REGISTERS,
    MAX_WRITE_BITS,
    MAX_WRITE_REGISTERS,
    MEI_DEVICE_IDENTIFICATION,
)
from dissectors.simulated import Send

ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE = 1, 2, 3


class Refused(Exception):
    """A request that is answered with an exception; `code` is the exception code."""

    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code


class Bank(Protocol):
    """Registers or bits by address, 0 … 65535. Both raise Refused."""

    def read(self, address: int) -> int:
        """Value at an address: 0 … 65535, or 0 … 1 of a bit."""
        ...

    def write(self, address: int, value: int) -> None:
        """Store a value."""
        ...


@dataclass(slots=True)
class Cells:
    """A bank of what is in a dict: a number is stored there, a function gives the value at each reading.

    An address that is not there is refused as illegal, and so is writing to a function.
    """

    cells: dict[int, int | Callable[[], int]] = field(default_factory=dict)

    def read(self, address: int) -> int:
        cell = self._cell(address)
        return cell() if callable(cell) else cell

    def write(self, address: int, value: int) -> None:
        if callable(self._cell(address)):
            raise Refused(ILLEGAL_ADDRESS)
        self.cells[address] = value

    def _cell(self, address: int) -> int | Callable[[], int]:
        try:
            return self.cells[address]
        except KeyError:
            raise Refused(ILLEGAL_ADDRESS) from None


class ModbusServer:
    """A server at one unit address.

    `functions`: those it knows; others are refused with code 1. `delay`: ns from the end of a request to its answer.
    `codes`: exception codes it uses instead of the standard's, by function and standard code ({(3, 2): 0x52}).
    `longest`: octets of the longest RTU frame it takes or sends; a request beyond is refused with code 3.
    `loopback_only`: of the diagnostics it knows sub-function 0000 alone.
    """

    def __init__(
        self,
        unit: int,
        holding: Bank | None = None,
        input: Bank | None = None,
        coils: Bank | None = None,
        discrete: Bank | None = None,
        *,
        is_ascii: bool = False,
        delay: int = 5 * MS,
        functions: frozenset[int] = frozenset((1, 2, 3, 4, 5, 6, 7, 8, 11, 15, 16, 17, 22, 23, 43)),
        codes: Mapping[tuple[int, int], int] | None = None,
        longest: int = 256,
        loopback_only: bool = False,
        server_id: bytes = b"sim\xff",
        identification: Mapping[int, bytes] | None = None,
    ) -> None:
        self.unit = unit
        self.banks: dict[int, Bank] = {1: coils or Cells(), 2: discrete or Cells(), 4: input or Cells()}
        self.holding = self.banks[3] = holding or Cells()
        self.is_ascii = is_ascii
        self.delay = delay
        self.functions = functions
        self.codes = dict(codes or {})
        self.longest = longest
        self.loopback_only = loopback_only
        self.server_id = server_id
        self.identification = dict(identification or {0: b"sniff485", 1: b"simulated", 2: b"1"})
        self.listening_only = False
        self.heard = self.damaged = self.refused = self.addressed = self.unanswered = 0

    # ---- Station

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        """See `dissectors.simulated.Station`."""
        answer = self.answer(octets)
        return () if answer is None else (Send(now + self.delay, answer),)

    def wake(self, now: int) -> tuple[Send, ...]:
        """A server speaks only when asked."""
        return ()

    def next_wake(self) -> int | None:
        """Never."""
        return None

    # ---- the server

    def answer(self, octets: bytes) -> bytes | None:
        """The answer to one transmission, in its envelope; None where a server is silent."""
        request = unseal(octets, self.is_ascii)
        if request is None:
            self.damaged += 1
            return None
        self.heard += 1
        reply = self.respond(request)
        if reply is None:
            return None
        return seal_ascii(reply) if self.is_ascii else seal_rtu(reply)

    def respond(self, request: bytes) -> bytes | None:
        """The answer to unit and PDU, as unit and PDU; None where a server is silent."""
        if len(request) < 2 or request[0] not in (self.unit, BROADCAST):
            return None
        self.addressed += 1
        code = request[1]
        muted = self.listening_only
        if muted and request[1:4] != b"\x08\x00\x01":
            self.unanswered += 1
            return None
        if request[0] == BROADCAST and not (code in FUNCTIONS and FUNCTIONS[code].writes) and code != 8:
            return None
        try:
            data = self._serve(code, request)
        except Refused as refused:
            self.refused += 1
            used = self.codes.get((code, refused.code), refused.code)
            data = bytes((code | EXCEPTION_BIT, used))
        silent = request[0] == BROADCAST or muted or self.listening_only
        self.unanswered += silent
        return None if silent else bytes((self.unit,)) + data

    def _serve(self, code: int, request: bytes) -> bytes:
        serve = _SERVICES.get(code)
        if serve is None or code not in self.functions:
            raise Refused(ILLEGAL_FUNCTION)
        if len(request) + 2 > self.longest:
            raise Refused(ILLEGAL_VALUE)
        try:
            data = serve(self, request)
        except (struct.error, IndexError):  # shorter than the function needs
            raise Refused(ILLEGAL_VALUE) from None
        return data

    def _read_bits(self, request: bytes) -> bytes:
        code, start, quantity = struct.unpack_from(">BHH", request, 1)
        _within(quantity, self._most(MAX_READ_BITS, per_octet=8))
        bits = [self.banks[code].read(address) for address in _addresses(start, quantity)]
        packed = sum(1 << i for i, bit in enumerate(bits) if bit).to_bytes((quantity + 7) // 8, "little")
        return bytes((code, len(packed))) + packed

    def _most(self, standard: int, per_octet: int = 1) -> int:
        """How many items fit into the longest answer, at 5 octets around the data."""
        return min(standard, (self.longest - 5) * per_octet)

    def _read_registers(self, request: bytes) -> bytes:
        code, start, quantity = struct.unpack_from(">BHH", request, 1)
        _within(2 * quantity, self._most(2 * MAX_READ_REGISTERS))
        values = [self.banks[code].read(address) & 0xFFFF for address in _addresses(start, quantity)]
        return struct.pack(f">BB{quantity}H", code, 2 * quantity, *values)

    def _write_coil(self, request: bytes) -> bytes:
        address, value = struct.unpack_from(">HH", request, 2)
        if value not in (0x0000, 0xFF00):
            raise Refused(ILLEGAL_VALUE)
        self.banks[1].write(address, value >> 15)
        return request[1:6]

    def _write_register(self, request: bytes) -> bytes:
        self.holding.write(*struct.unpack_from(">HH", request, 2))
        return request[1:6]

    def _write_coils(self, request: bytes) -> bytes:
        start, quantity, count = struct.unpack_from(">HHB", request, 2)
        _within(quantity, MAX_WRITE_BITS)
        packed = request[7 : 7 + count]
        if count != (quantity + 7) // 8 or len(packed) != count:
            raise Refused(ILLEGAL_VALUE)
        for i, address in enumerate(_addresses(start, quantity)):
            self.banks[1].write(address, packed[i >> 3] >> (i & 7) & 1)
        return request[1:6]

    def _write_registers(self, request: bytes) -> bytes:
        start, quantity, count = struct.unpack_from(">HHB", request, 2)
        _within(quantity, MAX_WRITE_REGISTERS)
        self._store(start, quantity, count, request[7:])
        return request[1:6]

    def _mask_write(self, request: bytes) -> bytes:
        address, and_mask, or_mask = struct.unpack_from(">HHH", request, 2)
        value = self.holding.read(address)
        self.holding.write(address, (value & and_mask) | (or_mask & ~and_mask & 0xFFFF))
        return request[1:8]

    def _read_write(self, request: bytes) -> bytes:
        start, quantity, to, written, count = struct.unpack_from(">HHHHB", request, 2)
        _within(2 * quantity, self._most(2 * MAX_READ_REGISTERS))
        _within(written, MAX_READ_WRITE_REGISTERS)
        self._store(to, written, count, request[11:])
        values = [self.holding.read(address) & 0xFFFF for address in _addresses(start, quantity)]
        return struct.pack(f">BB{quantity}H", 23, 2 * quantity, *values)

    def _store(self, start: int, quantity: int, count: int, data: bytes) -> None:
        if count != 2 * quantity or len(data) != count:
            raise Refused(ILLEGAL_VALUE)
        for address, (value,) in zip(_addresses(start, quantity), struct.iter_unpack(">H", data), strict=True):
            self.holding.write(address, value)

    def _diagnostics(self, request: bytes) -> bytes:
        (sub,) = struct.unpack_from(">H", request, 2)
        counters = {0x0B: self.heard, 0x0C: self.damaged, 0x0D: self.refused, 0x0E: self.addressed}
        counters[0x0F] = self.unanswered
        if sub == DIAGNOSTIC_LOOPBACK:
            return request[1:]
        if self.loopback_only:
            raise Refused(ILLEGAL_VALUE)
        if sub in counters:
            return struct.pack(">BHH", 8, sub, counters[sub] & 0xFFFF)
        if sub == 0x01:
            self.listening_only = False
        elif sub == DIAGNOSTIC_LISTEN_ONLY:
            self.listening_only = True
        elif sub == 0x0A:
            self.heard = self.damaged = self.refused = self.addressed = self.unanswered = 0
        else:
            raise Refused(ILLEGAL_VALUE)
        return request[1:6]

    def _status(self, request: bytes) -> bytes:
        return b"\x07\x00"

    def _event_counter(self, request: bytes) -> bytes:
        return struct.pack(">BHH", 11, 0, (self.addressed - self.refused) & 0xFFFF)

    def _server_id(self, request: bytes) -> bytes:
        return bytes((17, len(self.server_id))) + self.server_id

    def _identify(self, request: bytes) -> bytes:
        if request[2] != MEI_DEVICE_IDENTIFICATION or not 1 <= request[3] <= 4:
            raise Refused(ILLEGAL_FUNCTION)
        wanted = [number for number in sorted(self.identification) if number >= request[4]]
        if request[3] == 4:
            wanted = [number for number in wanted if number == request[4]]
            if not wanted:
                raise Refused(ILLEGAL_ADDRESS)
        objects = [bytes((n, len(self.identification[n]))) + self.identification[n] for n in wanted]
        return bytes((43, request[2], request[3], 0x81, 0, 0, len(objects))) + b"".join(objects)


_SERVICES: dict[int, Callable[[ModbusServer, bytes], bytes]] = {
    1: ModbusServer._read_bits,
    2: ModbusServer._read_bits,
    3: ModbusServer._read_registers,
    4: ModbusServer._read_registers,
    5: ModbusServer._write_coil,
    6: ModbusServer._write_register,
    7: ModbusServer._status,
    8: ModbusServer._diagnostics,
    11: ModbusServer._event_counter,
    15: ModbusServer._write_coils,
    16: ModbusServer._write_registers,
    17: ModbusServer._server_id,
    22: ModbusServer._mask_write,
    23: ModbusServer._read_write,
    43: ModbusServer._identify,
}


def _within(quantity: int, most: int) -> None:
    if not 1 <= quantity <= most:
        raise Refused(ILLEGAL_VALUE)


def _addresses(start: int, quantity: int) -> range:
    if start + quantity > 0x10000:
        raise Refused(ILLEGAL_ADDRESS)
    return range(start, start + quantity)
