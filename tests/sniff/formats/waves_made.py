"""Makes captures of logic analysers: characters on lines as edges, and edges as files of each kind."""

from __future__ import annotations

import struct
import zipfile
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from dissectors.line import NS_PER_S, LineSettings

NS_A_SAMPLE = 1000


def edges_of(
    frames: Iterable[tuple[int, bytes]],
    line: LineSettings,
    wrong_parity: Iterable[int] = (),
    no_stop: Iterable[int] = (),
    fast: float = 1.0,
) -> list[int]:
    """Times (ns) at which a line changes that is idle between frames, which begin at their times.

    `wrong_parity`, `no_stop`: characters, counted from 0, that are sent so; `fast`: times the rate.
    """
    wrong, unstopped = set(wrong_parity), set(no_stop)
    bit = NS_PER_S / line.baud / fast
    changes: list[int] = []
    level, count = 1, 0
    for begin, octets in frames:
        at = float(begin)
        for octet in octets:
            data = [octet >> place & 1 for place in range(line.data_bits)]
            bits = [0, *data]
            if line.parity != "N":
                bits.append((sum(data) & 1) ^ (line.parity == "O") ^ (count in wrong))
            bits += [0, 1] if count in unstopped else [1]
            for value in bits:
                if value != level:
                    changes.append(round(at))
                    level = value
                at += bit
            at += bit * (line.stop_bits - 1)
            count += 1
    return changes


def as_sigrok(path: Path, channels: dict[str, tuple[int, Sequence[int]]], pieces: int = 3, rate: str = "1 MHz") -> Path:
    """Channels by name (level before, edges in ns) as a sigrok session of a sample a microsecond."""
    end = max([edges[-1] for _, edges in channels.values() if len(edges)], default=0) + 5_000_000
    samples = np.zeros(end // NS_A_SAMPLE, np.uint8)
    for place, (level, edges) in enumerate(channels.values()):
        toggles = np.zeros(len(samples), np.uint8)
        at = -(-np.array(edges, np.int64) // NS_A_SAMPLE)
        np.add.at(toggles, at[at < len(samples)], 1)
        samples |= ((np.cumsum(toggles) + level) & 1).astype(np.uint8) << place
    named = "".join(f"probe{place + 1}={name}\n" for place, name in enumerate(channels))
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("version", "2")
        file.writestr(
            "metadata",
            "[global]\nsigrok version=0.5.2\n\n[device 1]\ncapturefile=logic-1\n"
            f"total probes={len(channels)}\nsamplerate={rate}\ntotal analog=0\n{named}unitsize=1\n",
        )
        for number, piece in enumerate(np.array_split(samples, pieces), 1):
            file.writestr(f"logic-1-{number}", piece.tobytes())
    return path


def as_vcd(path: Path, channels: dict[str, tuple[int, Sequence[int]]]) -> Path:
    """The same as a value change dump with times in ns."""
    codes = "!\"#$%&'"
    text = ["$date today $end", "$timescale 1 ns $end", "$scope module top $end"]
    text += [f"$var wire 1 {code} {name} $end" for code, name in zip(codes, channels, strict=False)]
    text += ["$var wire 8 z word [7:0] $end", "$upscope $end", "$enddefinitions $end", "#0 $dumpvars"]
    text += [f"{level}{code}" for code, (level, _) in zip(codes, channels.values(), strict=False)]
    text.append("$end")
    for time, changed in _changes(channels):
        text.append(f"#{time}")
        text += [f"{level}{codes[place]}" for place, level in changed.items()] + ["b1010 z"]
    path.write_text("\n".join(text) + "\n")
    return path


def as_csv(path: Path, channels: dict[str, tuple[int, Sequence[int]]], iso: bool = False) -> Path:
    """The same as Saleae Logic exports digital channels."""

    def stamp(time: int) -> str:
        seconds, rest = divmod(time, NS_PER_S)
        return f"2026-03-01T10:00:{seconds:02d}.{rest:09d}+00:00" if iso else f"{seconds}.{rest:09d}"

    levels = [level for level, _ in channels.values()]
    lines = ["Time [s]," + ",".join(channels), ",".join((stamp(0), *map(str, levels)))]
    for time, changed in _changes(channels):
        levels = [changed.get(place, level) for place, level in enumerate(levels)]
        lines.append(",".join((stamp(time), *map(str, levels))))
    path.write_text("\n".join(lines) + "\n")
    return path


def as_binary(path: Path, level: int, edges: Sequence[int]) -> Path:
    """One channel as Saleae Logic exports it in binary."""
    header = struct.pack("<8siiIddQ", b"<SALEAE>", 0, 0, level, 0.0, edges[-1] / NS_PER_S, len(edges))
    path.write_bytes(header + np.array([edge / NS_PER_S for edge in edges], "<f8").tobytes())
    return path


def _changes(channels: dict[str, tuple[int, Sequence[int]]]) -> list[tuple[int, dict[int, int]]]:
    found: dict[int, dict[int, int]] = {}
    for place, (level, edges) in enumerate(channels.values()):
        for edge in edges:
            level ^= 1
            found.setdefault(edge, {})[place] = level
    return sorted(found.items())
