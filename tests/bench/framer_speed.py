"""How many octets a second every framer takes, whatever it is fed: a table of inputs × framers, in kB/s.

    python -m tests.bench.framer_speed [OCTETS …]       (default 10000 100000 1000000)

Nothing here is a frame that a healthy bus sends: the inputs are those that a framer could be slow at, repeated. A line
broken at the wrong place sends exactly such things for hours. Where kB/s falls with the number of octets, the cost is
not linear.
"""

from __future__ import annotations

import gc
import random
import sys
import time
from collections.abc import Callable, Iterator, Sequence

from dissectors import registry
from dissectors.checksums import crc16_modbus
from dissectors.frame import Chunk
from dissectors.framer import Framer
from dissectors.line import LineSettings, Timing

READ = 256
"""Octets a read, back to back: what a driver gives at full load."""


def _sealed(text: str) -> bytes:
    body = bytes.fromhex(text)
    return body + crc16_modbus(body).to_bytes(2, "little")


PATTERNS: dict[str, bytes] = {
    "zeros": b"\0",
    "FF": b"\xff",
    "55": b"\x55",
    "55 FF": b"\x55\xff",
    "':'": b":",
    "':0'": b":0",
    "':01'": b":01",
    "':01030000'": b":01030000",
    "':' of 7 bits, parity": b"\xba",
    "hex digits": b"0123456789ABCDEF",
    "CR": b"\r",
    "LF": b"\n",
    "CR LF": b"\r\n",
    "':' CR": b":\r",
    "'>'": b">",
    "'>01'": b">01",
    "'A'": b"A",
    "'A' CR": b"A\r",
    "55 FF 05 00": bytes.fromhex("55 FF 05 00 01 01 F5"),
    "55 FF, length only": bytes.fromhex("55 FF 06 01 02 01 F5"),
    **{f"01 {code:02X}": bytes((1, code)) for code in (1, 3, 5, 7, 8, 0x0C, 0x10, 0x11, 0x14, 0x15, 0x17, 0x18, 0x2B)},
    "01 83": b"\x01\x83",
    "01 01 FF": b"\x01\x01\xff",
    "01 2B 0E": b"\x01\x2b\x0e",
    "2B": b"\x2b",
    "2B 0E 01": b"\x2b\x0e\x01",
    "01 2B 0E 01 .. 80, empty objects": bytes.fromhex("01 2B 0E 01 01 00 00 80") + bytes(118),
    "RTU frames, good, glued": _sealed("01 03 0000 0002") + _sealed("01 03 04 000A 000B"),
    "RTU exceptions, glued": _sealed("01 83 02"),
    "RTU of four octets, glued": _sealed("01 07"),
    "RTU long answer, spoilt": _sealed("01 03 F0" + "01 03" * 120)[:-1] + b"\x55",
    "RTU vendor function, glued": _sealed("01 41 02 E9 00 03"),
    "RTU vendor function, four octets, glued": _sealed("01 41"),
    "good ASCII, glued": b":010300000002FA\r\n",
}
_FRAMERS = ("modbus-rtu", "modbus-ascii", "n2", "mstp")


def _glued(dice: random.Random, count: int, codes: Sequence[int], least: int, most: int, times: int) -> bytes:
    """Good frames of nine stations, `times` of them one after the other of the same station and function."""
    octets = bytearray()
    while len(octets) < count:
        head = bytes((dice.randint(1, 9), dice.choice(codes)))
        for _ in range(times):
            octets += _sealed((head + dice.randbytes(dice.randint(least, most))).hex())
    return bytes(octets[:count])


def inputs(count: int) -> Iterator[tuple[str, bytes]]:
    """Every input, `count` octets of each."""
    for name, pattern in PATTERNS.items():
        yield name, (pattern * (count // len(pattern) + 1))[:count]
    dice = random.Random(485)
    yield "random", dice.randbytes(count)
    yield "random 0 … 3", bytes(dice.choices((0, 1, 2, 3), k=count))
    codes = (1, 2, 3, 4, 7, 8, 0x0C, 0x0F, 0x10, 0x11, 0x14, 0x15, 0x16, 0x17, 0x18, 0x2B, 0x83)
    yield "random function codes", bytes(dice.choices(codes, k=count))
    yield "RTU exchanges of vendor functions, glued", _glued(dice, count, (65, 66, 72, 100, 110), 0, 4, 2)
    yield "RTU of four octets, any station, glued", _glued(dice, count, (7, 11, 12, 17), 0, 0, 1)
    yield "random hex digits", bytes(dice.choices(b"0123456789ABCDEF", k=count))
    yield "random ':' hex CR LF", bytes(dice.choices(b"0123456789ABCDEF::::\r\n", k=count))


def rate(factory: Callable[[Timing], Framer], octets: bytes) -> float:
    """kB/s of processor time that a framer takes octets at, read back to back."""
    timing = Timing(LineSettings.parse("115200"), 17_000_000)
    framer, now, given = factory(timing), 0, 0
    gc.collect()
    begin = time.process_time()
    for at in range(0, len(octets), READ):
        part = octets[at : at + READ]
        now += len(part) * timing.char
        given += sum(len(event.octets) for event in framer.feed(Chunk(now, part)))
    given += sum(len(event.octets) for event in framer.close())
    spent = time.process_time() - begin
    assert given == len(octets)
    return len(octets) / max(spent, 1e-9) / 1000


def main(counts: list[int]) -> None:
    """Print the table."""
    names = [name for name in _FRAMERS if name in registry.names()]
    for name in names:
        rate(registry.get(name).framer, bytes(READ))  # what is loaded at first use
    for count in counts:
        print(f"\n{count} octets; kB/s")
        print(f"{'':42}" + "".join(f"{name:>14}" for name in names))
        for label, octets in inputs(count):
            rates = [rate(registry.get(name).framer, octets) for name in names]
            print(f"{label:42}" + "".join(f"{each:14.0f}" for each in rates), flush=True)


if __name__ == "__main__":
    main([int(argument) for argument in sys.argv[1:]] or [10_000, 100_000, 1_000_000])
