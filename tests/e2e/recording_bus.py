"""A bus for tests of `record`: a pseudo-terminal that is fed numbered octets, the command, its capture process, and a
disk that hangs on demand.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import signal
import struct
import subprocess
import sys
import termios
import textwrap
import threading
import time
import tty
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from dissectors.frame import Chunk
from sniff.engine.capture import CaptureError
from sniff.formats import read

LINE = ("-s", "115200,8N1", "-p", "modbus-rtu")
PATIENCE = 60.0
"""Seconds for anything to happen: so long only where this machine is overloaded, or it never will."""


def wait_until(true: Callable[[], object], what: str) -> None:
    until = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < until, what
        time.sleep(0.02)


class Feeder:
    """A pseudo-terminal. `fed`: all octets that were taken by it."""

    def __init__(self) -> None:
        self.master, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(self.master, False)
        self.path = os.ttyname(slave)
        self._slave = slave  # kept open: octets wait for the reader
        self.fed = bytearray()
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def feed(self, octets: bytes) -> None:
        until = time.monotonic() + PATIENCE
        while octets:
            try:
                taken = os.write(self.master, octets)
            except BlockingIOError:
                assert time.monotonic() < until, "nobody reads"
                time.sleep(0.001)
                continue
            self.fed += octets[:taken]
            octets = octets[taken:]

    def poll(self, message: bytes, every: float = 0.01) -> None:
        """Feed the same again and again, until `quiet`."""

        def run() -> None:
            while not self._stop.wait(every):
                self.feed(message)

        self._thread = threading.Thread(target=run, daemon=True)
        self._thread.start()

    def until_read(self) -> None:
        """Until nothing waits in the pseudo-terminal, as far as it can be seen: several times in a row."""
        quiet = 0

        def is_read() -> bool:
            nonlocal quiet
            waiting = struct.unpack("i", fcntl.ioctl(self._slave, termios.FIONREAD, bytes(4)))[0]
            quiet = 0 if waiting else quiet + 1
            return quiet > 5

        wait_until(is_read, "nobody reads")

    def quiet(self) -> None:
        self._stop.set()
        if self._thread is not None:
            self._thread.join()

    def close(self) -> None:
        self.quiet()
        os.close(self._slave)
        os.close(self.master)


class Command:
    """`sniff485` with arguments. `said`: the lines of its standard error so far."""

    def __init__(self, folder: Path, *arguments: str, environment: dict[str, str] | None = None) -> None:
        here = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2]), **(environment or {})}
        self.folder = folder
        self.process = subprocess.Popen(
            [sys.executable, "-m", "sniff", *arguments], cwd=folder, env=here, stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE, text=True, start_new_session=True,
        )  # fmt: skip
        self.said: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stderr is not None
        for line in self.process.stderr:
            self.said.append(line.rstrip("\n"))

    def until_it_says(self, words: str) -> str:
        """The first line with these words in it."""
        found: list[str] = []

        def look() -> bool:
            found[:] = [line for line in self.said if words in line]
            return bool(found) or self.process.poll() is not None

        wait_until(look, f"it never said {words!r}, but {self.said}")
        assert found, f"it ended without {words!r}: {self.said}"
        return found[0]

    def send(self, number: int) -> None:
        self.process.send_signal(number)

    def until_it_listens(self) -> None:
        """Until it takes SIGTERM as a wish to stop."""

        def listens() -> bool:
            status = Path(f"/proc/{self.process.pid}/status").read_text()
            caught = next(line.split()[1] for line in status.splitlines() if line.startswith("SigCgt"))
            return bool(int(caught, 16) >> (signal.SIGTERM - 1) & 1)

        wait_until(listens, "it never listens")

    def end(self) -> int:
        """Wait for its end; the exit code."""
        code = self.process.wait(PATIENCE)
        self._reader.join(PATIENCE)
        return code

    def close(self) -> None:
        for pid in [self.process.pid, *capture_processes(self.folder)]:
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                continue
        self.process.wait()


def capture_processes(folder: Path) -> list[int]:
    """Capture processes that were started in a folder."""
    found = []
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        try:
            ours = b"sniff.capture.process" in (entry / "cmdline").read_bytes()
            if ours and os.readlink(entry / "cwd") == str(folder):
                found.append(int(entry.name))
        except OSError:
            continue
    return found


def octets_of(path: Path) -> bytes:
    """What is in a recording by now; nothing where it only begins."""
    try:
        return b"".join(item.octets for item in read(path).items() if isinstance(item, Chunk))
    except CaptureError:
        return b""


SITECUSTOMIZE = """
    import builtins, io, os, time

    GATES = os.environ["SLOW_DISK"]

    def wait(what):
        gate = os.path.join(GATES, what)
        if os.path.exists(gate):
            io.open(gate + ".waits", "a").close()
        while os.path.exists(gate):
            time.sleep(0.005)

    class SlowFile(io.FileIO):
        def write(self, octets):
            wait("write")
            return super().write(octets)

    real_open, real_sync = builtins.open, os.fsync

    def slow_open(path, mode="r", *args, **options):
        return SlowFile(path, "xb") if mode == "xb" else real_open(path, mode, *args, **options)

    def slow_sync(descriptor):
        wait("sync")
        real_sync(descriptor)

    builtins.open, os.fsync = slow_open, slow_sync
"""


class SlowDisk:
    """Writes and syncs of recordings hang while their gate is shut. `environment` is for the command."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir()
        (folder / "sitecustomize.py").write_text(textwrap.dedent(SITECUSTOMIZE))
        path = os.pathsep.join([str(folder), str(Path(__file__).parents[2])])
        self.environment = {"SLOW_DISK": str(folder), "PYTHONPATH": path}

    def shut(self, what: str) -> None:
        (self.folder / what).touch()

    def open(self, what: str) -> None:
        (self.folder / what).unlink(missing_ok=True)

    def until_it_waits(self, what: str) -> None:
        wait_until((self.folder / f"{what}.waits").exists, f"no {what} came")

    def close(self) -> None:
        """Nothing hangs any longer."""
        self.open("write")
        self.open("sync")


@contextlib.contextmanager
def recordings(folder: Path, port: str) -> Iterator[Callable[..., Command]]:
    """Begins recordings to x.mcap in a folder, each listening when it is given; ends them all."""
    running: list[Command] = []
    listened_to = port

    def begin(*words: str, port: str = listened_to, **options: Any) -> Command:
        running.append(Command(folder, "record", port, *LINE, "-w", "x.mcap", *words, **options))
        wait_until((folder / "x.mcap").exists, "no recording was begun")
        running[-1].until_it_listens()
        return running[-1]

    try:
        yield begin
    finally:
        for command in running:
            command.close()
