"""What each protocol's bus says on a good day, with the truth beside it, for `framing_table.py`.

One entry of TRAFFIC a protocol: a further protocol is a function that makes its traffic, and a line there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from random import Random

from dissectors.frame import Frame
from dissectors.line import LineSettings

MS = 1_000_000
S = 1_000 * MS


@dataclass(frozen=True, slots=True)
class Said:
    """One frame as it was said.

    `pause`: ns of silence before it. `station`: whom a request is for and an answer is from; who sent it, where frames
    pass between equals. `asks`: whether it is a request, None where frames pass between equals (what is made of it on
    an undisturbed line is then the truth). `answers`: which frame it answers (its index in the traffic).
    """

    octets: bytes
    pause: int
    station: int
    asks: bool | None = None
    answers: int | None = None


@dataclass(frozen=True, slots=True)
class Traffic:
    """A protocol by its name in the registry, its line, and what was said, in order."""

    protocol: str
    line: LineSettings
    said: Sequence[Said]


def n2(dice: Random, frames: int) -> Traffic:
    """A supervisor that polls four drives, reads and overrides points; one of thirty commands is not answered."""
    from dissectors.n2.f510 import POINTS
    from dissectors.n2.simulated import Follower, command, overriding, reading

    said: list[Said] = []
    drives = {address: Follower(address) for address in (1, 2, 17, 200)}

    def ask(address: int, octets: bytes) -> None:
        asked = len(said)
        said.append(Said(octets, dice.randint(15, 80) * MS, address, True))
        (answer,) = drives[address].hear(0, octets, True)
        if dice.random() < 1 / 30:
            said.append(Said(octets, dice.randint(250, 300) * MS, address, True))
            asked += 1
        said.append(Said(answer.octets, dice.randint(4, 40) * MS, address, False, asked))

    for address in drives:
        ask(address, command(address, "F"))
    while len(said) < frames:
        address = dice.choice(list(drives))
        point = dice.choice(POINTS)
        drives[address].set(1, 10, dice.randint(0, 600) / 10)
        ask(address, command(address, dice.choice(("04", "05"))))
        ask(address, reading(address, point.region, point.number).octets)
        if dice.random() < 0.2:
            ask(address, overriding(address, 3, dice.randint(1, 3), dice.randint(0, 500) / 10).octets)
    return Traffic("n2", LineSettings.parse("9600,8N1"), said)


def _modbus(dice: Random, frames: int, *, is_ascii: bool) -> Traffic:
    from dissectors.modbus.envelope import seal_ascii, seal_rtu

    seal = seal_ascii if is_ascii else seal_rtu
    said: list[Said] = []
    while len(said) < frames:
        unit, asked = dice.choice((1, 2, 5, 17, 200)), len(said)
        pdus = [_read, _read, _read, _read_bits, _write, _write_many, _exception][dice.randrange(7)](dice)
        request, answer = (seal(bytes((unit,)) + pdu) for pdu in pdus)
        said.append(Said(request, dice.randint(15, 80) * MS, unit, True))
        if dice.random() < 1 / 30:
            said.append(Said(request, dice.randint(250, 300) * MS, unit, True))
            asked += 1
        said.append(Said(answer, dice.randint(4, 40) * MS, unit, False, asked))
    line = LineSettings.parse("19200,7E1" if is_ascii else "19200,8E1")
    return Traffic("modbus-ascii" if is_ascii else "modbus-rtu", line, said)


def modbus_rtu(dice: Random, frames: int) -> Traffic:
    """A master that reads and writes registers of five units; one of thirty requests is repeated."""
    return _modbus(dice, frames, is_ascii=False)


def modbus_ascii(dice: Random, frames: int) -> Traffic:
    """The same in the other envelope."""
    return _modbus(dice, frames, is_ascii=True)


def _two(value: int) -> bytes:
    return value.to_bytes(2, "big")


def _read(dice: Random) -> tuple[bytes, bytes]:
    count = dice.choice((1, 2, 2, 4, 10, 30))
    function = dice.choice((3, 4))
    values = b"".join(_two(dice.choice((0, dice.randrange(1000), dice.randrange(65536)))) for _ in range(count))
    return bytes((function,)) + _two(dice.randrange(0x3000)) + _two(count), bytes((function, 2 * count)) + values


def _read_bits(dice: Random) -> tuple[bytes, bytes]:
    count = dice.choice((8, 16, 40))
    return b"\x01" + _two(dice.randrange(500)) + _two(count), bytes((1, count // 8)) + dice.randbytes(count // 8)


def _write(dice: Random) -> tuple[bytes, bytes]:
    pdu = b"\x06" + _two(dice.randrange(0x3000)) + _two(dice.randrange(1000))
    return pdu, pdu


def _write_many(dice: Random) -> tuple[bytes, bytes]:
    count = dice.randint(1, 8)
    head = b"\x10" + _two(dice.randrange(0x3000)) + _two(count)
    return head + bytes((2 * count,)) + dice.randbytes(2 * count), head


def _exception(dice: Random) -> tuple[bytes, bytes]:
    return b"\x03" + _two(dice.randrange(0x3000)) + _two(4), bytes((0x83, dice.choice((1, 2, 3))))


def mstp(dice: Random, frames: int) -> Traffic:
    """A ring of four masters, two of which ask the others."""
    from sniff.simulation.wire import Wire
    from tests.faults.buses import MSTP_LINE, _mstp_parties

    parties = _mstp_parties((1, 2, 5, 9), {}, {}, None, 50, 1, ())
    stations = {party.name: int(party.name.split()[1]) for party in parties}
    said: list[Said] = []
    end = 0
    for burst in Wire(MSTP_LINE, parties, (), dice.randrange(1000)).run(600 * S):
        for sent in burst.sent:
            said.append(Said(sent.octets, max(0, sent.start - end), stations[sent.party]))
            end = sent.end
        if len(said) >= frames:
            break
    return Traffic("mstp", MSTP_LINE, said)


def profibus(dice: Random, frames: int) -> Traffic:
    """A ring of two masters with two drives and a valve."""
    from tests.faults.profibus_cases import profibus as bus

    plan = bus(seed=dice.randrange(1000))
    stations = {"controller": 1, "second master": 2, "drive 5": 5, "drive 6": 6, "valve": 12}
    said: list[Said] = []
    end = 0
    for burst in plan.wire().run(600 * S):
        for sent in burst.sent:
            said.append(Said(sent.octets, max(0, sent.start - end), stations[sent.party]))
            end = sent.end
        if len(said) >= frames:
            break
    return Traffic("profibus", plan.line, said)


TRAFFIC: dict[str, Callable[[Random, int], Traffic]] = {
    "rtu": modbus_rtu,
    "ascii": modbus_ascii,
    "n2": n2,
    "mstp": mstp,
    "profibus": profibus,
}
"""Name on the command line → what makes about so many frames of traffic."""


def is_same(frame: Frame, octets: bytes) -> bool:
    """Whether a good frame says what was said: hex digits may have changed their case, a line end be half."""
    if frame.protocol not in ("n2", "modbus-ascii"):
        return frame.octets == octets
    return frame.octets.upper().rstrip(b"\r\n") == octets.rstrip(b"\r\n")
