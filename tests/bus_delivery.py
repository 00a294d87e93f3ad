"""How octets on a wire reach a program: exactly, or through a USB adapter that holds them back."""

from __future__ import annotations

import random
from collections.abc import Iterable, Sequence

from dissectors.frame import Chunk
from dissectors.line import Timing

MS = 1_000_000
FTDI_LATENCY = 17 * MS
"""The default latency timer of 16 ms, and a USB frame."""

Wire = list[tuple[int, int]]
"""Octets on the wire: (end in ns, octet), ascending."""


def exact(wire: Iterable[tuple[int, int]]) -> list[Chunk]:
    """One chunk an octet, at its end."""
    return [Chunk(end, bytes([octet])) for end, octet in wire]


def ftdi(wire: Sequence[tuple[int, int]], *, timer: int = 16 * MS, packet: int = 62) -> list[Chunk]:
    """One read whenever the latency timer runs out with something there, or a packet is full."""
    chunks: list[Chunk] = []
    held = bytearray()
    tick = (wire[0][0] // timer + 1) * timer if wire else 0
    for end, octet in wire:
        while end > tick:
            if held:
                chunks.append(Chunk(tick, bytes(held)))
                held.clear()
            tick += timer
        held.append(octet)
        if len(held) == packet:
            chunks.append(Chunk(end, bytes(held)))
            held.clear()
            tick = end + timer
    if held:
        chunks.append(Chunk(tick, bytes(held)))
    return chunks


def stalled(chunks: Iterable[Chunk], dice: random.Random, chance: float, worst: int) -> list[Chunk]:
    """The same reads by a host that now and then does not come round to reading, for up to `worst` ns."""
    read: list[Chunk] = []
    held, until = b"", 0
    for chunk in chunks:
        if held and chunk.time < until:
            held += chunk.octets
            continue
        if held:
            read.append(Chunk(until, held))
            held = b""
        if dice.random() < chance:
            held, until = chunk.octets, chunk.time + dice.randint(1 * MS, worst)
        else:
            read.append(chunk)
    if held:
        read.append(Chunk(until, held))
    return read


def laid_out(frames: Iterable[bytes], timing: Timing, gap: int, start: int = 0) -> Wire:
    """Frames on a wire, octets back to back, `gap` ns of silence before each."""
    now, wire = start, []
    for frame in frames:
        now += gap
        for octet in frame:
            now += timing.char
            wire.append((now, octet))
    return wire


def with_noise(wire: Wire, timing: Timing, dice: random.Random, gap: int) -> tuple[Wire, int]:
    """The same wire with 1 to 3 random octets at random places in every silence longer than `gap` ns.

    Gives the noisy wire and how many octets were put in. Octets never overlap.
    """
    char, noisy, added = timing.char, wire[:1], 0
    for end, octet in wire[1:]:
        begin, room = noisy[-1][0], end - char - noisy[-1][0]
        if room > gap:
            count = min(dice.randint(1, 3), room // char)
            spare = room - count * char
            for number, place in enumerate(sorted(dice.randint(0, spare) for _ in range(count)), 1):
                noisy.append((begin + place + number * char, dice.randrange(256)))
            added += count
        noisy.append((end, octet))
    return noisy, added
