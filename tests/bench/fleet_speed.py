"""What a fleet's report costs: a bus-day of a busy bus, thousands of small files, one worker against two, a full index.

    python -m tests.bench.fleet_speed [--files 2000] [--frames 1000000] [--folder DIR]

Prints CPU seconds and octets a bus-day, seconds of the whole command with 1 and 2 workers in turns (A B A B), with the
index full and after one new file, and what a file costs beside its reading. Made on disk; removed afterwards.
"""

from __future__ import annotations

import argparse
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from sniff.engine.session import Session
from sniff.fleet import codec
from sniff.fleet.archive import files_below, tasks_of
from sniff.fleet.reading import read_task
from tests.bench import bulk_files, bulk_mstp, bulk_rtu


def _command(folder: Path, *words: str) -> float:
    """Seconds of the whole command."""
    began = time.perf_counter()
    subprocess.run(
        [sys.executable, "-m", "sniff", "fleet", str(folder), "--json", *words],
        cwd=Path(__file__).parents[2], stdout=subprocess.DEVNULL, check=False,
    )  # fmt: skip
    return time.perf_counter() - began


def one_day(folder: Path, frames: int) -> None:
    """What a core reads in a second, and what comes back."""
    table, length = bulk_rtu.frames(frames)
    made = {
        "mstp": (Session("mstp", bulk_mstp.LINE, "mstp"), bulk_mstp.reads(frames)),
        "modbus-rtu": (
            Session("rtu", bulk_rtu.TIMING.line, "modbus-rtu"),
            bulk_rtu.bus(table, length, bulk_rtu.TIMING),
        ),
    }
    for name, (session, reads) in made.items():
        path = folder / f"{name}.mcap"
        bulk_files.write_mcap(path, reads, session)
        (task,) = tasks_of(files_below([str(path)]))[0]
        began = time.process_time()
        days = read_task(task)
        took = time.process_time() - began
        heard = sum(day.summary.frames for day in days)
        octets = sum(day.summary.octets for day in days)
        print(
            f"{name:11} {heard} frames, {took:.1f} s of a core: {heard / took / 1e3:.0f} k frames/s, "
            f"{octets / took / 1e6:.2f} MB of the line/s; file {path.stat().st_size / 1e6:.1f} MB; "
            f"a bus-day is {len(codec.encode(days)) / len(days) / 1e3:.1f} kB"
        )


def many(folder: Path, files: int) -> None:
    """Small files: a second of a bus each."""
    source = folder / "one.mcap"
    bulk_files.write_mcap(source, bulk_mstp.reads(400), Session("mstp", bulk_mstp.LINE, "mstp"))
    archive = folder / "many"
    for number in range(files):
        target = archive / f"site-{number % 20}" / f"{number}.mcap"
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(source, target)
    for workers in (1, 2):
        began = time.perf_counter()
        _command(archive, "--no-index", "--workers", str(workers))
        took = time.perf_counter() - began
        print(
            f"{files} small files, {workers} worker{'s' * (workers > 1)}: {took:.1f} s, "
            f"{took / files * 1e3:.1f} ms a file"
        )
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    print(f"the largest process took {peak:.0f} MB")


def cores(folder: Path, frames: int) -> None:
    """One worker against two, in turns; then the index.

    Eight files of so many frames: starting Dask and its workers takes some seconds whatever there is to read.
    """
    archive = folder / "cores"
    archive.mkdir()
    for number in range(8):
        reads = bulk_mstp.reads(frames, number + 1, damaged=0.005)
        bulk_files.write_mcap(archive / f"{number}.mcap", reads, Session(f"b{number}", bulk_mstp.LINE, "mstp"))
    one, two = [], []
    for _ in range(2):
        one.append(_command(archive, "--no-index", "--workers", "1"))
        two.append(_command(archive, "--no-index", "--workers", "2"))
    print(
        f"1 worker {min(one):.1f} s, 2 workers {min(two):.1f} s: {min(one) / min(two):.2f} times; "
        f"cores here: {os.cpu_count()}"
    )
    first = _command(archive, "--workers", "1")
    again = _command(archive, "--workers", "1")
    shutil.copy(archive / "0.mcap", archive / "new.mcap")
    new = _command(archive, "--workers", "1")
    print(f"index empty {first:.1f} s, full {again:.2f} s ({again / first:.1%}), after one new file {new:.2f} s")


def main() -> None:
    """See above."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--files", type=int, default=2000)
    parser.add_argument("--frames", type=int, default=1_000_000)
    parser.add_argument("--folder", type=Path)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=args.folder) as name:
        folder = Path(name)
        one_day(folder, args.frames)
        cores(folder, args.frames)
        many(folder, args.files)


if __name__ == "__main__":
    main()
