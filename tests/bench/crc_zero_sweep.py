"""Every function, both directions: thousands of exchanges whose CRC has octets that are 00, on every bus and adapter.

    python -m tests.bench.crc_zero_sweep [EXCHANGES]       (default 300 for each function)

Three ways: each exchange as a capture of its own; all of a function in a row; requests alone, which nobody answers.
Printed are frames whose limits were wrong; frames whose limits were right and whose direction the tracker missed; and
those whose direction it left open (answered or repeated), as it must where nothing on the bus tells.
What is only ever confirmed by a copy of the request (functions 5, 6, 8, 21, 22) tells no direction where an adapter
hides the times; beside a poll that teaches them it must be right.
"""

from __future__ import annotations

import random
import sys
from collections.abc import Iterable, Iterator

from tests.dissectors.modbus.crc_zeros import (
    ADAPTERS,
    CODES,
    PACES,
    VENDOR_CODES,
    exchanges_with_zeros,
    misread,
    sealed,
    zeros_of,
)

LINES = ("9600,8N1", "19200,8E1", "115200,8N1")


def _beside_polls(sent: list[tuple[bytes, bytes]]) -> Iterator[tuple[bytes, bytes]]:
    """The same with two polls of the same station before each."""
    for asked, answered in sent:
        unit = asked[:1]
        poll = sealed(unit + b"\x03\0\0\0\1"), sealed(unit + b"\x03\x02\x12\x34")
        yield from (poll, poll, (asked, answered))


def _of_another_unit_each(frames: Iterable[bytes]) -> list[bytes]:
    """Without those of the same unit as the one before: what looks like a vendor function's answer, nobody can tell."""
    kept: list[bytes] = []
    for frame in frames:
        if not kept or kept[-1][0] != frame[0]:
            kept.append(frame)
    return kept


def sweep(count: int) -> None:
    """Print a line for each way, bus and adapter."""
    print(f"{'':44}{'exchanges':>10}{'limits':>8}{'direction':>11}{'open':>8}")
    for way in ("alone", "in a row", "beside polls", "not answered"):
        for adapter in ADAPTERS:
            for name, pace in PACES.items():
                for line in LINES:
                    tried, limits, directions, left_open = 0, 0, 0, 0
                    for code in (*CODES, *VENDOR_CODES):
                        sent = list(exchanges_with_zeros(code, random.Random(f"{code} {line} {name}"), count))
                        if way == "not answered":
                            asked = list(dict.fromkeys(frame for frame, _ in sent if zeros_of(frame)))
                            if code in VENDOR_CODES:
                                asked = _of_another_unit_each(asked)
                            sent = [(frame, b"") for frame in asked]
                        tried += len(sent)
                        runs = [[one] for one in sent] if way == "alone" else [sent]
                        if way == "beside polls":
                            runs = [list(_beside_polls(sent))]
                        for run in runs:
                            wrong = misread(run, line, pace, adapter)
                            limits += sum(" read as " in each for each in wrong)
                            is_open = sum(" taken for a either" in each for each in wrong)
                            directions += sum(" taken for " in each for each in wrong) - is_open
                            left_open += is_open
                            for each in wrong[:1]:
                                if " read as " in each:
                                    print("   ", each)
                    found = f"{tried:10}{limits:8}{directions:11}{left_open:8}"
                    print(f"{way:14}{adapter:8}{name:8}{line:14}{found}", flush=True)


if __name__ == "__main__":
    sweep(int(sys.argv[1]) if len(sys.argv) > 1 else 300)
