"""A question is one command of this program, run in a process of its own, its answer bounded.

So that this process, which holds libraries under Apache-2.0, never loads scapy; and so that a capture which is large
or hostile costs no more than the process that reads it, which ends when its time is over.
"""

from __future__ import annotations

import asyncio
import json
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

TIMEOUT = 120.0
"""Seconds that a command may take."""

MOST_OCTETS = 4 << 20
"""Of what a command prints; what comes behind is not read."""

MOST_AT_ONCE = 2
"""Commands that run at the same time."""


class Refused(Exception):
    """A question that could not be answered: one line for whoever asked."""


@dataclass(frozen=True, slots=True)
class Said:
    """What a command printed: its whole lines; `whole`: whether that is all of them."""

    lines: list[str]
    whole: bool

    def objects(self) -> list[dict[str, Any]]:
        """Its lines as JSON objects."""
        return [json.loads(line) for line in self.lines]


class Asking:
    """Runs commands, some at once."""

    def __init__(self, timeout: float = TIMEOUT) -> None:
        self._timeout = timeout
        self._free = asyncio.Semaphore(MOST_AT_ONCE)

    async def ask(self, arguments: Sequence[str], most_octets: int = MOST_OCTETS) -> Said:
        """What a command prints. Raises `Refused` where it fails or takes too long."""
        async with self._free:
            process = await asyncio.create_subprocess_exec(
                sys.executable,
                "-m",
                "sniff",
                *arguments,
                stdin=asyncio.subprocess.DEVNULL,
                stdout=asyncio.subprocess.PIPE,
                stderr=asyncio.subprocess.PIPE,
                env={**os.environ, "PYTHONIOENCODING": "utf-8"},  # whatever the language of this machine
            )
            try:
                async with asyncio.timeout(self._timeout):
                    return await _heard(process, most_octets)
            except TimeoutError:
                said = f"took longer than {self._timeout:g} s and was ended; a filter or a shorter capture helps"
                raise Refused(said) from None
            finally:
                if process.returncode is None:
                    process.kill()
                    await process.wait()


async def _heard(process: asyncio.subprocess.Process, most: int) -> Said:
    assert process.stdout is not None
    assert process.stderr is not None
    errors = asyncio.ensure_future(_some(process.stderr, 1 << 14))
    octets = await _some(process.stdout, most + 1)
    if len(octets) > most:
        errors.cancel()
        return Said(octets[: octets.rfind(b"\n", 0, most) + 1].decode().splitlines(), whole=False)
    said = (await errors).decode(errors="replace")
    if await process.wait() not in (0, 1):
        lines = [line.removeprefix("sniff485: ") for line in said.splitlines() if line.startswith("sniff485")]
        raise Refused("; ".join(lines[-2:]) or "the program failed")
    return Said(octets.decode().splitlines(), whole=True)


async def _some(stream: asyncio.StreamReader, most: int) -> bytes:
    """All that comes, up to `most` octets."""
    octets = bytearray()
    while len(octets) < most and (part := await stream.read(min(1 << 16, most - len(octets)))):
        octets += part
    return bytes(octets)
