"""Whole commands on long captures, against tshark on the same frames, or against the same command row by row
(`--reference`) where tshark has no such thing, in pairs A B A B in one run.

    python -m tests.bench.bulk_commands [FRAMES [ROUNDS]]        100000 frames, 2 rounds

Processor time (user and system) of the whole process and its children, the least of the rounds; wall time beside it.
Programs run as they are installed: with compiled modules and buffered output, whatever the environment says of Python.
Behind the ratio stands the one that is wanted of a million frames, where there is one.
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
from sniff.engine.session import Adapter, Session
from tests.bench import bulk_mstp, bulk_rtu
from tests.bench.bulk_files import laid, write_mcap, write_pcap

EXPORTED_PDU = 252
FRAMES = 100_000
PEER_FRAMES = 100_000
"""tshark's cost of Modbus RTU grows with the square of the frames: more would take it many minutes."""

ENVIRONMENT = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
_ROOT = Path(__file__).parents[2]

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
    """One line of the table; `peer` None where there is none, else `against`. `wanted`: what the ratio must reach."""

    work: str
    frames: int
    ours: Cost
    peer: Cost | None
    against: str = "tshark"
    wanted: str = ""


def captures(folder: Path, frames: int) -> dict[str, Path]:
    """The files by name: MS/TP and RTU, clean and with 0.5 % of the frames damaged, RTU also behind an adapter that
    holds octets back, so that no gap is to be seen; for the peer as pcap."""
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
            if not damaged:
                adapter = f"rtu-adapter{kind.removeprefix(name)}"
                held = bulk_rtu.bus(spoilt[:count], length[:count], bulk_rtu.HELD_BACK)
                held = replace(held, times=held.times + _BASE)
                path = folder / f"{adapter}.mcap"
                made[adapter] = _recorded(path, held, bulk_rtu.HELD_BACK.line, "modbus-rtu", bulk_rtu.HELD_BACK.latency)
        made[f"{name}.pcap"] = folder / f"{name}.pcap"
        tagged = laid(np.tile(np.frombuffer(_TAGS, np.uint8), (len(reads), 1)), reads, 0)
        write_pcap(
            made[f"{name}.pcap"], replace(reads, octets=tagged, lengths=reads.lengths + len(_TAGS)), EXPORTED_PDU
        )
    return made


def _recorded(path: Path, reads: Reads, line: LineSettings, protocol: str, latency: int = 0) -> Path:
    adapter = Adapter("ft232", latency=latency, latency_from="bench") if latency else Adapter()
    write_mcap(path, reads, Session("bench", line, protocol, started=int(reads.times[0]), adapter=adapter))
    return path


def rows(files: dict[str, Path], frames: int, rounds: int) -> Iterator[Row]:
    """Every line, as it is measured."""
    yield from _rows_of_starts(rounds)
    counting = ("-q", "-z", "io,stat,0")
    for name in ("mstp", "mstp-damaged"):
        peer = ("tshark", "-n", "-r", str(files[f"{name}.pcap"]), *counting)
        scan = ("mstpcap", "--scan", str(files[f"{name}.pcap"]))
        clean = name == "mstp"
        for kind, wanted in ((name, "≥5" if clean else "≥3"), (f"{name}.pcap", "≥4" if clean else "≥3")):
            for command in ("info", "stats"):
                yield _pair(f"{command}, {kind}", frames, (command, str(files[kind])), peer, rounds, wanted)
        if shutil.which(scan[0]):
            row = _pair(f"info, {name}.pcap", frames, ("info", str(files[f"{name}.pcap"])), scan, rounds, ">1")
            yield replace(row, against="mstpcap --scan")
        yield _pair(f"check, {name}", frames, ("check", str(files[name])), peer, 1, "≥2")
    for name in ("rtu", "rtu-adapter", "rtu-damaged"):
        yield _pair(f"info, {name}", frames, ("info", str(files[name])), None, rounds)
        yield _pair(f"check, {name}", frames, ("check", str(files[name])), None, 1)
        short = str(files[f"{name}-short"])
        peer = ("tshark", "-n", "-r", str(files.get(f"{name}.pcap", files["rtu.pcap"])), *counting)
        least = min(frames, PEER_FRAMES)
        for command in ("info", "stats"):
            yield _pair(f"{command}, {name}", least, (command, short), peer, rounds, "≥10")
        yield _pair(f"check, {name}", least, ("check", short), peer, 1, "≥2")
    yield from _rows_of_lines(files, frames, rounds)
    yield from _rows_of_copies(files, frames, rounds)
    yield from _rows_of_kept(files, frames, rounds)


def _rows_of_starts(rounds: int) -> Iterator[Row]:
    """What every command costs before it does anything: 0.15 s and 0.4 s are wanted."""
    small = Path(__file__).parents[2] / "captures" / "rtu-clean.cap.txt"
    yield _pair("--version", 0, ("--version",), ("tshark", "--version"), rounds)
    yield _pair("show, a small capture", 0, ("show", str(small)), None, rounds)


def _fields(*names: str) -> tuple[str, ...]:
    return "-T", "fields", *(word for name in names for word in ("-e", name))


_OURS = _fields("no", "src", "dst", "kind")
_MSTP = _fields("frame.number", "mstp.src", "mstp.dst", "mstp.frame_type")
_TIMES = ("frame.number", "frame.time_epoch", "frame.time_relative", "frame.protocols")
_CSV = ("-E", "separator=,", "-E", "quote=d")
MSTP_LINES: dict[str, tuple[tuple[str, ...], tuple[str, ...] | None]] = {
    "show": ((), ()),
    "show -Y": (("-Y", "dst == 3"), ("-Y", "mstp.dst == 3")),
    "show -Y verdict": (("-Y", "verdict == answered && latency_ms > 10"), None),
    "-T fields": (_OURS, _MSTP),
    "-T fields -Y": (("-Y", "dst == 3", *_OURS), ("-Y", "mstp.dst == 3", *_MSTP)),
    "--csv": (
        ("--csv",),
        (*_CSV, *_fields(*_TIMES, "mstp.src", "mstp.dst", "mstp.frame_type", "_ws.col.Info")),
    ),
    "--json": (("--json",), None),
}
"""What is listed, by us and by tshark. CSV has eighteen columns of ours; tshark's are those that it has of them."""

RTU_LINES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "show": ((), ()),
    "show -Y": (("-Y", "func == 3"), ("-Y", "modbus.func_code == 3")),
    "-T fields": (_OURS, _fields("frame.number", "mbrtu.unit_id", "modbus.func_code")),
    "--csv": (("--csv",), (*_CSV, *_fields(*_TIMES, "mbrtu.unit_id", "modbus.func_code", "_ws.col.Info"))),
}


def _rows_of_lines(files: dict[str, Path], frames: int, rounds: int) -> Iterator[Row]:
    """A line a frame: all of them, those that a filter accepts, some columns."""
    for name in ("mstp", "mstp-damaged"):
        for work, (words, theirs) in MSTP_LINES.items():
            peer = None if theirs is None else ("tshark", "-n", "-r", str(files[f"{name}.pcap"]), *theirs)
            yield _pair(f"{work}, {name}", frames, ("show", str(files[name]), *words), peer, rounds, "≥4")
    for work, (words, theirs) in RTU_LINES.items():
        if frames > PEER_FRAMES:
            yield _pair(f"{work}, rtu", frames, ("show", str(files["rtu"]), *words), None, rounds)
        peer = ("tshark", "-n", "-r", str(files["rtu.pcap"]), *theirs)
        short = ("show", str(files["rtu-short"]), *words)
        yield _pair(f"{work}, rtu", min(frames, PEER_FRAMES), short, peer, rounds, "≥4")


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


def _rows_of_kept(files: dict[str, Path], frames: int, rounds: int) -> Iterator[Row]:
    """Captures that hold what `redissect` found in them; against tshark, which finds it anew."""
    for name, short in (("mstp", ""), ("mstp-damaged", ""), ("rtu", "-short"), ("rtu-damaged", "-short")):
        kept, count = files["mstp"].with_name("kept.mcap"), min(frames, PEER_FRAMES) if short else frames
        _cost((sys.executable, "-m", "sniff", "redissect", str(files[name + short]), "-f", "-o", str(kept)))
        peer = ("tshark", "-n", "-r", str(files[f"{name}.pcap"]))
        counting = (*peer, "-q", "-z", "io,stat,0")
        yield _pair(f"info, {name}, kept", count, ("info", str(kept)), counting, rounds, "≥5")
        yield _pair(f"check, {name}, kept", count, ("check", str(kept)), counting, rounds, "≥2")
        yield _pair(f"show, {name}, kept", count, ("show", str(kept)), peer, rounds, "≥4")


def _pair(
    work: str, frames: int, words: Sequence[str], peer: Sequence[str] | None, rounds: int, wanted: str = ""
) -> Row:
    ours: list[Cost] = []
    theirs: list[Cost] = []
    if peer is not None and shutil.which(peer[0]) is None:
        peer = None
    for _ in range(rounds):
        ours.append(_cost((sys.executable, "-m", "sniff", *words)))
        if peer is not None:
            theirs.append(_cost(peer))
    return Row(work, frames, _least(ours), _least(theirs) if theirs else None, wanted=wanted)


def _cost(command: Sequence[str]) -> Cost:
    begin, before = time.monotonic(), os.times()
    done = subprocess.run(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False, env=ENVIRONMENT, cwd=_ROOT
    )
    after = os.times()
    assert done.returncode in (0, 1), command
    used = after.children_user + after.children_system - before.children_user - before.children_system
    return Cost(used, time.monotonic() - begin)


def _least(costs: Sequence[Cost]) -> Cost:
    return min(costs, key=lambda cost: cost.processor)


def lines(frames: int, rounds: int) -> Iterator[str]:
    """The table, line by line as it is measured."""
    titles = f"{'work':<30}{'frames':>9}  {'ours: CPU s':>11}{'wall s':>8}"
    yield f"{titles}  {'peer: CPU s':>13}{'wall s':>8}  {'ratio':>6}  wanted"
    with tempfile.TemporaryDirectory() as folder:
        for row in rows(captures(Path(folder), frames), frames, rounds):
            line = f"{row.work:<30}{row.frames:>9}  {row.ours.processor:>11.2f}{row.ours.wall:>8.2f}"
            if row.peer is not None:
                ratio = row.peer.processor / row.ours.processor
                line += f"  {row.peer.processor:>13.2f}{row.peer.wall:>8.2f}  {ratio:>5.1f}×  {row.wanted:<4}"
                line += f"  {row.against}"
            yield line


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[1:]]
    for line in lines(numbers[0] if numbers else FRAMES, numbers[1] if len(numbers) > 1 else ROUNDS):
        print(line, flush=True)
