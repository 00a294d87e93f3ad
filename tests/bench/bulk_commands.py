"""Whole commands on long captures, against tshark on the same frames, or against the same command row by row
(`--reference`) where tshark has no such thing, in pairs A B A B in one run.

    python -m tests.bench.bulk_commands [FRAMES [ROUNDS]]        1000000 frames, 2 rounds

Processor time (user and system) of the whole process and its children, the least of the rounds; wall time beside it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dissectors.columns import Reads
from dissectors.line import LineSettings
from sniff.engine.session import Session
from tests.bench import bulk_mstp, bulk_rtu
from tests.bench.bulk_files import laid, write_mcap, write_pcap

EXPORTED_PDU = 252
PEER_FRAMES = 100_000
"""tshark's cost of Modbus RTU grows with the square of the frames: more would take it many minutes."""

ROUNDS = 2
_BASE = 1_772_359_200_000_000_000
_TAGS = bytes.fromhex("000c0008") + b"mbrtu\0\0\0" + bytes(4)


@dataclass(frozen=True, slots=True)
class Cost:
    """Seconds: of all processors, and on the clock."""

    processor: float
    wall: float


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the table; `peer` None where there is none, else `against`."""

    work: str
    frames: int
    ours: Cost
    peer: Cost | None
    against: str = "tshark"


def captures(folder: Path, frames: int) -> dict[str, Path]:
    """The files by name: MS/TP and RTU, clean and with 0.5 % of the frames damaged; for the peer as pcap."""
    made: dict[str, Path] = {}
    for name, damaged in (("mstp", 0.0), ("mstp-damaged", 0.005)):
        reads = bulk_mstp.reads(frames, damaged=damaged)
        made[name] = _recorded(folder / f"{name}.mcap", reads, bulk_mstp.LINE, "mstp")
        made[f"{name}.pcap"] = folder / f"{name}.pcap"
        write_pcap(made[f"{name}.pcap"], reads)
    table, length = bulk_rtu.frames(frames)
    for name, damaged in (("rtu", 0.0), ("rtu-damaged", 0.005)):
        spoilt = bulk_rtu.damaged(table, length, damaged) if damaged else table
        for count, kind in ((frames, name), (min(frames, PEER_FRAMES), f"{name}-short")):
            reads = bulk_rtu.bus(spoilt[:count], length[:count], bulk_rtu.TIMING)
            reads = replace(reads, times=reads.times + _BASE)
            made[kind] = _recorded(folder / f"{kind}.mcap", reads, bulk_rtu.TIMING.line, "modbus-rtu")
        made[f"{name}.pcap"] = folder / f"{name}.pcap"
        tagged = laid(np.tile(np.frombuffer(_TAGS, np.uint8), (len(reads), 1)), reads, 0)
        write_pcap(
            made[f"{name}.pcap"], replace(reads, octets=tagged, lengths=reads.lengths + len(_TAGS)), EXPORTED_PDU
        )
    return made


def _recorded(path: Path, reads: Reads, line: LineSettings, protocol: str) -> Path:
    write_mcap(path, reads, Session("bench", line, protocol, started=int(reads.times[0])))
    return path


def rows(files: dict[str, Path], frames: int, rounds: int) -> Iterator[Row]:
    """Every line, as it is measured."""
    counting = ("-q", "-z", "io,stat,0")
    for name in ("mstp", "mstp-damaged"):
        peer = ("tshark", "-n", "-r", str(files[f"{name}.pcap"]))
        for kind in (name, f"{name}.pcap"):
            yield _pair(f"info, {kind}", frames, ("info", str(files[kind])), (*peer, *counting), rounds)
        yield _pair(f"stats, {name}", frames, ("stats", str(files[name])), (*peer, *counting), rounds)
        yield _pair(f"check, {name}", frames, ("check", str(files[name])), (*peer, *counting), 1)
    for name in ("rtu", "rtu-damaged"):
        yield _pair(f"info, {name}", frames, ("info", str(files[name])), None, rounds)
        short, peer = str(files[f"{name}-short"]), ("tshark", "-n", "-r", str(files[f"{name}.pcap"]))
        least = min(frames, PEER_FRAMES)
        yield _pair(f"info, {name}", least, ("info", short), (*peer, *counting), rounds)
        yield _pair(f"check, {name}", least, ("check", short), (*peer, *counting), 1)
    yield from _rows_of_lines(files, frames, rounds)
    yield from _rows_of_copies(files, frames, rounds)


LINES = {
    "show": ((), ()),
    "show -Y": (("-Y", "dst == 3"), ("-Y", "mstp.dst == 3")),
    "-T fields": (
        ("-T", "fields", "-e", "no", "-e", "src", "-e", "dst", "-e", "kind"),
        ("-T", "fields", "-e", "frame.number", "-e", "mstp.src", "-e", "mstp.dst", "-e", "mstp.frame_type"),
    ),
    "--csv": (("--csv",), ("-T", "fields", "-e", "frame.number", "-e", "mstp.src", "-e", "mstp.dst")),
}
"""What is listed, by us and by tshark."""


def _rows_of_lines(files: dict[str, Path], frames: int, rounds: int) -> Iterator[Row]:
    """A line a frame: all of them, those that a filter accepts, some columns."""
    for name in ("mstp", "mstp-damaged"):
        for work, (words, theirs) in LINES.items():
            peer = ("tshark", "-n", "-r", str(files[f"{name}.pcap"]), *theirs)
            yield _pair(f"{work}, {name}", frames, ("show", str(files[name]), *words), peer, rounds)
    yield _pair("show, rtu", frames, ("show", str(files["rtu"])), None, rounds)


def _rows_of_copies(files: dict[str, Path], frames: int, rounds: int) -> Iterator[Row]:
    """What tshark has nothing like: values, copies; against the same row by row, on no more frames than that stands."""
    out = str(files["mstp"].with_name("copy.mcap"))
    works = {
        "points, rtu": ("points", "rtu"),
        "points --csv, rtu": ("points", "--csv", "rtu"),
        "points, mstp": ("points", "mstp"),
        "report, mstp": ("report", "--json", "mstp"),
        "convert, rtu": ("convert", "rtu", out, "-f"),
        "convert, pcap": ("convert", "mstp.pcap", out, "-f"),
        "redissect, mstp": ("redissect", "mstp", "-f", "-o", out),
        "cut --from, rtu": ("cut", "rtu", "-f", "-o", out, "--from", "+10", "--to", "+60"),
        "cut --frames, mstp": ("cut", "mstp", "-f", "-o", out, "--frames", "2000-50000"),
        "merge, mstp": ("merge", "mstp", "mstp-damaged", "-f", "-o", out),
    }
    for work, words in works.items():
        command = tuple(str(files.get(word, word)) for word in words)
        if frames <= PEER_FRAMES:
            peer = (sys.executable, "-m", "sniff", *command, "--reference")
            yield replace(_pair(work, frames, command, peer, rounds), against="row by row")
        else:
            yield _pair(work, frames, command, None, rounds)


def _pair(work: str, frames: int, words: Sequence[str], peer: Sequence[str] | None, rounds: int) -> Row:
    ours: list[Cost] = []
    theirs: list[Cost] = []
    if peer is not None and shutil.which(peer[0]) is None:
        peer = None
    for _ in range(rounds):
        ours.append(_cost((sys.executable, "-m", "sniff", *words)))
        if peer is not None:
            theirs.append(_cost(peer))
    return Row(work, frames, _least(ours), _least(theirs) if theirs else None)


def _cost(command: Sequence[str]) -> Cost:
    begin, before = time.monotonic(), os.times()
    done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
    after = os.times()
    assert done.returncode in (0, 1), command
    used = after.children_user + after.children_system - before.children_user - before.children_system
    return Cost(used, time.monotonic() - begin)


def _least(costs: Sequence[Cost]) -> Cost:
    return min(costs, key=lambda cost: cost.processor)


def lines(frames: int, rounds: int) -> Iterator[str]:
    """The table, line by line as it is measured."""
    titles = f"{'work':<26}{'frames':>9}  {'ours: CPU s':>11}{'wall s':>8}"
    yield f"{titles}  {'peer: CPU s':>13}{'wall s':>8}  {'ratio':>6}"
    with tempfile.TemporaryDirectory() as folder:
        for row in rows(captures(Path(folder), frames), frames, rounds):
            line = f"{row.work:<26}{row.frames:>9}  {row.ours.processor:>11.2f}{row.ours.wall:>8.2f}"
            if row.peer is not None:
                ratio = row.peer.processor / row.ours.processor
                line += f"  {row.peer.processor:>13.2f}{row.peer.wall:>8.2f}  {ratio:>5.1f}×  {row.against}"
            yield line


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[1:]]
    for line in lines(numbers[0] if numbers else 1_000_000, numbers[1] if len(numbers) > 1 else ROUNDS):
        print(line, flush=True)
