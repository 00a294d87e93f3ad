"""Ten full buses on pseudo-terminals through `record`: is every octet in the files, and what does it take?

    python -m tests.bench.ten_buses [--buses 10] [--minutes 1] [--protocol mstp | modbus-rtu] [--every 2] [--each]

Each bus is given 11520 octets a second (115200 Bd without a pause) in frames of 8 octets on average (tokens; requests
and answers), what is due `--every` ms at a time, as an adapter hands it over. Said is the CPU time of all processes of
`record` (without the one that sends) as part of one core and by frame, how long stopping took, and whether the files
hold what was sent. All are recorded by one `record`, into one file; with `--each`, each by a `record` of its own.
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
import tty
from bisect import bisect_right
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path

from fastcrc import crc16

from dissectors.bacnet.envelope import frame as mstp_frame
from dissectors.frame import Chunk
from sniff.analysis.summary import Summary
from sniff.bus.offline import survey
from sniff.recording.reader import McapCapture

OCTETS_A_SECOND = 11520
FRAME = 8
_TICKS = os.sysconf("SC_CLK_TCK")


@dataclass
class Bus:
    """A pseudo-terminal, the command that records it, its file and its place in it."""

    master: int
    slave: int
    file: Path
    place: int
    process: subprocess.Popen[str]
    sent: int = 0
    refused: int = 0


def traffic(protocol: str) -> list[bytes]:
    """Some seconds of a full bus, frames of 8 octets on average, to be sent again and again."""
    if protocol == "mstp":
        masters = 24
        return [mstp_frame(0, (at + 1) % masters, at) for at in range(masters)] * 60
    frames = []
    for turn in range(1440):  # one and two registers of 8 stations in turn
        unit, count = 1 + turn % 8, 1 + turn // 8 % 2
        for body in (
            bytes((unit, 3, 0, turn // 16 % 16, 0, count)),
            bytes((unit, 3, 2 * count, 0, turn % 200, 1, turn % 99)[: 3 + 2 * count]),
        ):
            frames.append(body + crc16.modbus(body).to_bytes(2, "little"))
    return frames


def start(folder: Path, count: int, protocol: str, each: bool) -> list[Bus]:
    """Some buses, and `record` for them."""
    lines = []
    for _ in range(count):
        master, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(master, False)
        lines.append((master, slave))
    buses: list[Bus] = []
    for group in [[line] for line in lines] if each else [lines]:
        file = folder / f"buses{len(buses)}.mcap"
        names = [os.ttyname(slave) for _, slave in group]
        process = subprocess.Popen(
            [sys.executable, "-m", "sniff", "record", *names, "-s", "115200,8N1", "-p", protocol, "-w", str(file)],
            env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
            stderr=subprocess.PIPE, text=True, start_new_session=True,
        )  # fmt: skip
        buses += [Bus(master, slave, file, place, process) for place, (master, slave) in enumerate(group)]
    return buses


def send(buses: list[Bus], frames: list[bytes], seconds: float, every: float) -> float:
    """Send whole frames to all of them for so long, at the speed of the line; how long it took."""
    octets = b"".join(frames)
    ends = [0, *accumulate(map(len, frames))]
    begin = time.monotonic()
    now = begin
    while now - begin < seconds:
        due = int((now - begin) * OCTETS_A_SECOND)
        for bus in buses:
            turn, at = divmod(bus.sent, len(octets))
            until = min(due - turn * len(octets), len(octets))
            until = ends[bisect_right(ends, until) - 1]
            if until > at:
                try:
                    bus.sent += os.write(bus.master, octets[at:until])
                except BlockingIOError:
                    bus.refused += 1
        time.sleep(max(0.0, every - (time.monotonic() - now)))
        now = time.monotonic()
    return now - begin


def cpu_of(pid: int) -> dict[str, float]:
    """CPU seconds so far of a command and of its capture process."""
    used = {"front": _seconds(pid)}
    for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split():
        used["capture"] = used.get("capture", 0.0) + _seconds(int(child))
    return used


def _seconds(pid: int) -> float:
    values = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(values[11]) + int(values[12])) / _TICKS


def measure(count: int, seconds: float, protocol: str, every: float, folder: Path, each: bool) -> bool:
    """Run it and say what came of it; whether every file holds what was sent."""
    frames = traffic(protocol)
    octets = b"".join(frames)
    buses = start(folder, count, protocol, each)
    processes = list({bus.process.pid: bus.process for bus in buses}.values())
    until = time.monotonic() + 120
    while not all(bus.file.exists() for bus in buses) and time.monotonic() < until:
        time.sleep(0.1)
    time.sleep(3)  # so that what a start costs is not counted
    before = [cpu_of(process.pid) for process in processes]
    took = send(buses, frames, seconds, every)
    after = [cpu_of(process.pid) for process in processes]
    time.sleep(0.3)
    for process in processes:
        process.send_signal(signal.SIGINT)
    begin, said = time.monotonic(), {process.pid: process.communicate()[1] for process in processes}
    stopping = time.monotonic() - begin
    sent_frames = sum(bus.sent for bus in buses) / FRAME
    for part in ("front", "capture"):
        used = sum(late[part] - early[part] for late, early in zip(after, before, strict=True))
        print(f"{part:8} {used / took:6.1%} of a core  {used / sent_frames * 1e6:6.1f} us a frame")
    used = sum(sum(late.values()) - sum(early.values()) for late, early in zip(after, before, strict=True))
    print(f"together {used / took:6.1%} of a core  {used / sent_frames * 1e6:6.1f} us a frame")
    print(f"{count} buses, {took:.0f} s")
    print(f"stopping took {stopping:.1f} s; writes refused: {sum(bus.refused for bus in buses)}")
    whole = True
    for bus in buses:
        os.close(bus.master)
        os.close(bus.slave)
        held = b"".join(item.octets for item in McapCapture(bus.file, bus.place).items() if isinstance(item, Chunk))
        sent = (octets * (bus.sent // len(octets) + 1))[: bus.sent]
        if held != sent or bus.process.returncode:
            whole = False
            print(f"{bus.file.name}: sent {len(sent)}, in the file {len(held)}, exit code {bus.process.returncode}")
            print(said[bus.process.pid])
    print(f"sent {sum(bus.sent for bus in buses)} octets: {'all of them are in the files' if whole else 'LOSS'}")
    print(*said[processes[0].pid].strip().replace("\r", "\n").splitlines()[-3:], sep="\n")
    capture = McapCapture(buses[0].file)
    again = Summary(capture.session.line)
    survey(capture, capture.session, again)
    print(f"read again from its file: {again.frames} frames ({again.damaged} damaged), {again.noise} octets of noise")
    return whole


def main() -> int:
    """See above."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--buses", type=int, default=10)
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--protocol", choices=("mstp", "modbus-rtu"), default="mstp")
    parser.add_argument("--every", type=float, default=2.0, help="ms between what is sent")
    parser.add_argument("--each", action="store_true", help="each bus by a command of its own")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        whole = measure(args.buses, 60 * args.minutes, args.protocol, args.every / 1000, Path(folder), args.each)
    return 0 if whole else 1


if __name__ == "__main__":
    sys.exit(main())
