"""Anything at all through framers, dissectors, trackers, judges and readers: no exception, no octet lost, linear time.

`FUZZ_SECONDS=600 make bench ARGS="-k fuzz -s"`: each protocol so long, by default 10 s; FUZZ_SEED (random, printed).
"""

from __future__ import annotations

import os
import random
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from dissectors import registry
from dissectors.frame import Chunk, LineError, Mark
from dissectors.line import LineSettings
from sniff.analysis.judging import Judging
from sniff.bus.capture_writer import create
from sniff.engine.capture import CaptureError
from sniff.engine.follow_settings import SessionEngine
from sniff.engine.session import Item, LineEvent, LineEventKind, Session
from sniff.formats import FRAMES, ITEMS, read
from sniff.formats.table import writers
from sniff.simulation.scenarios import scenario, simulate
from sniff.simulation.tap import CH340

SECONDS = float(os.environ.get("FUZZ_SECONDS", "10"))
SEED = int(os.environ.get("FUZZ_SEED", "0")) or random.SystemRandom().randrange(1, 1 << 31)
BASE = 1_772_359_200_000_000_000
DELIMITERS = (b"\x00", b"\xff", b"\x55\xff", b":", b">", b"\r", b"\r\n", b"\x01\x2b", b"\x68", b"\x01\x03", b"\x16")
"""What frames begin or end with, and what makes framers look twice."""


def good(name: str) -> list[bytes]:
    """Reads of a simulated bus of that protocol."""
    _, items = simulate(scenario(name, SEED), 10, CH340, BASE)
    return [item.octets for item in items if isinstance(item, Chunk)]


def octets(dice: random.Random, samples: list[bytes]) -> bytes:
    """Some hundred octets: good ones, damaged ones, cut ones, repeated ones, noise."""
    kind = dice.randrange(7)
    if kind == 0:
        return dice.randbytes(dice.randrange(1, 600))
    if kind == 1:
        return dice.choice(DELIMITERS) * dice.randrange(1, 400)
    begin = dice.randrange(len(samples))
    taken = bytearray(b"".join(samples[begin : begin + dice.randrange(1, 30)]))
    if kind == 2:
        for _ in range(dice.randrange(1, 8)):
            taken[dice.randrange(len(taken))] = dice.randrange(256)
    elif kind == 3:
        del taken[dice.randrange(len(taken)) :]
    elif kind == 4:
        at = dice.randrange(len(taken))
        taken[at:at] = dice.randbytes(dice.randrange(1, 20))
    elif kind == 5:
        taken = taken[: dice.randrange(1, 12)] * dice.randrange(1, 60)
    return bytes(taken) or b"\x00"


def items(dice: random.Random, samples: list[bytes]) -> Iterator[Item]:
    """A capture: octets in any cuts, with any times."""
    now, left = BASE, b""
    for _ in range(dice.randrange(3, 40)):
        left += octets(dice, samples)
        while left:
            size = dice.choice((1, 8, 9, 32, 500, 5000))
            piece, left = left[:size], left[size:]
            now += dice.choice((0, 1000, 100_000, 1_000_000, 5_000_000, 40_000_000, 2_000_000_000))
            if dice.random() < 0.002:
                now = dice.choice((BASE, -now, now - 10**10, (1 << 62) - dice.randrange(10**12)))
            marks: tuple[Mark, ...] = ()
            if dice.random() < 0.02:
                marks = (Mark(dice.randrange(len(piece)), LineError(dice.randrange(1, 16))),)
            yield Chunk(now, piece, marks)
            if dice.random() < 0.002:
                yield LineEvent(now, dice.choice(tuple(LineEventKind)), "line=9600,8N1", dice.randrange(-5, 5))


@pytest.mark.timeout(0)
@pytest.mark.benchmark(group="fuzz")
@pytest.mark.parametrize("name", registry.names())
def test_fuzz_protocol(benchmark: Any, name: str) -> None:
    dice, samples = random.Random(SEED), good(name)
    line = LineSettings.parse(registry.get(name).default_line)
    count = sequences = 0
    slowest = (0.0, 0)

    def run() -> None:
        nonlocal count, sequences, slowest
        until = time.monotonic() + SECONDS
        while time.monotonic() < until:
            sequences += 1
            session = Session("fuzz", line, name, BASE)
            engine, judging = SessionEngine(session), Judging(session, registry.get(name))
            fed = found = 0
            began = time.process_time()
            for item in items(dice, samples):
                output = engine.take(item)
                if isinstance(item, Chunk):
                    fed += len(item.octets)
                else:
                    judging.add_line_event(item)
                found += sum(len(row.event.octets) for row in output.rows)
                judging.add(output)
            output = engine.close()
            found += sum(len(row.event.octets) for row in output.rows)
            judging.add(output)
            judging.findings()
            assert fed == found, f"sequence {sequences} of seed {SEED}"
            count += fed
            if fed > 5000:
                slowest = max(slowest, ((time.process_time() - began) / fed, sequences))

    benchmark.pedantic(run, rounds=1)
    print(
        f"\n  {name}, seed {SEED}: {sequences} sequences, {count / 1e6:.1f} M octets in {SECONDS:.0f} s, none lost, no "
        f"exception; slowest sequence {1e-3 / slowest[0] if slowest[0] else 0:.0f} kB/s (number {slowest[1]})"
    )


@pytest.mark.timeout(0)
@pytest.mark.benchmark(group="fuzz")
def test_fuzz_readers(benchmark: Any, tmp_path: Path) -> None:
    """Files of every format with octets changed, cut, repeated: a capture or one line that says why not."""
    dice, samples = random.Random(SEED), good("modbus-rtu")
    whole: dict[str, bytes] = {}
    for suffix in (*writers(ITEMS), *writers(FRAMES)):
        path = tmp_path / f"seed{suffix}"
        with create(path, Session("fuzz", LineSettings(19200, 8, "E", 1), "modbus-rtu", BASE)) as writer:
            for number, piece in enumerate(samples[:60]):
                writer.write(Chunk(BASE + number * 20_000_000, piece))
        whole[suffix] = path.read_bytes()
    whole[".log"] = whole[".csv"] = whole[".hex"] = whole[".txt"] = whole[".cap.txt"]
    files = octets_read = refused = longest = 0

    def run() -> None:
        nonlocal files, octets_read, refused, longest
        until = time.monotonic() + SECONDS
        while time.monotonic() < until:
            files += 1
            suffix = dice.choice(tuple(whole))
            content = bytearray(whole[suffix])
            for _ in range(dice.randrange(1, 12)):
                at = dice.randrange(len(content)) if content else 0
                kind = dice.randrange(5)
                if kind == 0 and content:
                    content[at] = dice.randrange(256)
                elif kind == 1:
                    content[at:at] = dice.randbytes(dice.randrange(1, 50))
                elif kind == 2:
                    del content[at : at + dice.randrange(1, 50)]
                elif kind == 3:
                    content[at : at + 8] = dice.choice((b"\xff" * 8, bytes(8), b"\x7f" + b"\xff" * 7, b"\n" * 8))
                else:
                    del content[dice.randrange(len(content) // 2, len(content) + 1) :]
            path = tmp_path / f"damaged{suffix}"
            path.write_bytes(content)
            try:
                capture = read(path)
                octets_read += sum(len(item.octets) for item in capture.items() if isinstance(item, Chunk))
                capture.completeness()
            except CaptureError as error:
                refused += 1
                longest = max(longest, len(str(error).splitlines()))

    benchmark.pedantic(run, rounds=1)
    assert longest == 1
    figures = (
        f"{files} damaged files, {refused} refused in one line, {octets_read / 1e6:.1f} M octets read from the others"
    )
    print(f"\n  readers, seed {SEED}: {figures}, no exception")
