"""Stations and masters that do well and are easily taken for ill: slow, with functions of their own, looking around."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import count

from dissectors.checksums import crc16_modbus
from dissectors.modbus.envelope import seal_rtu, unseal
from dissectors.modbus.simulated import Cells, ModbusServer
from dissectors.modbus.simulated_master import read_holding
from dissectors.n2.simulated import Master, command
from dissectors.simulated import Send, Station
from tests.faults.stations import Wrapped

MS = 1_000_000


class OwnFunctions(Wrapped):
    """Knows functions of its maker, whose layout nobody else does: `times` ns by function code."""

    def __init__(self, inner: Station, unit: int, times: dict[int, int]) -> None:
        super().__init__(inner)
        self.unit, self.times = unit, times
        self.asked = 0

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        request = unseal(octets, False)
        if request is None or request[0] != self.unit or request[1] not in self.times:
            return super().hear(now, octets, quiet)
        self.asked += 1
        data = bytes((self.asked * step) & 0xFF for step in range(1, 4 + self.asked % 9))
        return (Send(now + self.times[request[1]], seal_rtu(request[:2] + data)),)


class NeverByItself(Wrapped):
    """Answers only: a slave. What the node inside would begin by itself it does not."""

    def wake(self, now: int) -> tuple[Send, ...]:
        return ()

    def next_wake(self) -> int | None:
        return None


class AsksWithoutToken:
    """Sends these octets in turn every `every` ns, whoever has a token: on a bus of slaves nobody has one."""

    def __init__(self, octets: Iterable[bytes], every: int) -> None:
        self.octets, self.every = tuple(octets), every
        self.turn, self.due = 0, every

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        return ()

    def wake(self, now: int) -> tuple[Send, ...]:
        if now < self.due:
            return ()
        self.due += self.every
        self.turn += 1
        return (Send(now, self.octets[self.turn % len(self.octets)]),)

    def next_wake(self) -> int | None:
        return self.due


class LooksAround(Wrapped):
    """An N2 master that asks once who is at each of `addresses`, from `at` on, between two of its usual commands."""

    def __init__(self, inner: Station, at: int, addresses: Iterable[int], wait: int = 300 * MS) -> None:
        super().__init__(inner)
        assert isinstance(inner, Master)
        self.master, self.at, self.wait = inner, at, wait
        self.left = list(addresses)
        self.due: int | None = None

    def wake(self, now: int) -> tuple[Send, ...]:
        if not self._looks(now):
            return self.inner.wake(now)
        if self.due is not None and now < self.due:
            return ()
        self.due = now + self.wait
        return (Send(now, command(self.left.pop(0), "F")),)

    def next_wake(self) -> int | None:
        due = self.inner.next_wake()
        if self.due is None or due is None:
            return due
        return self.due if self.left else max(due, self.due)

    def _looks(self, now: int) -> bool:
        return now >= self.at and bool(self.left) and self.master._asked is None


def counting_server(unit: int, delay: int, first: int = 0) -> ModbusServer:
    """A meter: registers 0 and 1 are a counter of 32 bits that grows by one each time it is read."""
    counter = count(first)
    held = [first]

    def high() -> int:
        held[0] = next(counter)
        return held[0] >> 16 & 0xFFFF

    def low() -> int:
        return held[0] & 0xFFFF

    return ModbusServer(unit, holding=Cells({0: high, 1: low}), delay=delay)


def zero_checked(unit: int, delay: int) -> ModbusServer:
    """A server whose answers to reads of registers 0 and 1, 2 and 3, … each have a CRC with a 00."""
    values: dict[int, int] = {}
    for at, number in enumerate(_with_zero(bytes((unit, 3, 4)), 4, 12)):
        values[2 * at], values[2 * at + 1] = number >> 16, number & 0xFFFF
    return ModbusServer(unit, holding=Cells(dict(values)), delay=delay)


def zero_checked_requests(unit: int) -> tuple[bytes, ...]:
    """Reads of two registers whose answers `zero_checked` gives."""
    return tuple(read_holding(unit, 2 * at, 2) for at in range(12))


def requests_ending_in_zero(unit: int, registers: int) -> tuple[bytes, ...]:
    """Reads of one register below `registers` whose last octet on the line, of the CRC, is 00."""
    made = (read_holding(unit, at, 1 + at % 3) for at in range(registers - 3))
    return tuple(one for one in made if crc16_modbus(one) >> 8 == 0)


def _with_zero(front: bytes, size: int, many: int) -> Iterator[int]:
    """Numbers of `size` octets that give, behind `front`, a CRC whose last octet, or any, is 00; small ones first."""
    found = 0
    for number in count(200):
        check = crc16_modbus(front + number.to_bytes(size, "big"))
        if check >> 8 == 0 or (found % 3 == 2 and check & 0xFF == 0):
            yield number
            found += 1
            if found == many:
                return
