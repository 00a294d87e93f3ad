"""A box for tests: ports that can be plugged in and out, the command, a service manager that listens."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import tty
from collections.abc import Iterator
from pathlib import Path

from dissectors.frame import Chunk
from sniff.box import page
from sniff.box.status import BoxStatus, BusStatus
from sniff.recording.reader import buses_of
from sniff.recording.rotation import parts
from tests.e2e.recording_bus import capture_processes, wait_until
from tests.e2e.running import rest_of

ROOT = Path(__file__).parents[2]


class Socket:
    """A port under a name of its own; nothing is plugged in at first."""

    def __init__(self, link: Path) -> None:
        self.link = link
        self.sent = b""
        self._ends: tuple[int, ...] = ()

    def plug(self) -> None:
        master, slave = os.openpty()
        tty.setraw(slave)
        self._ends = master, slave
        self.link.symlink_to(os.ttyname(slave))

    def unplug(self) -> None:
        self.link.unlink(missing_ok=True)
        for end in self._ends:
            os.close(end)
        self._ends = ()

    def send(self, octets: bytes) -> None:
        os.write(self._ends[0], octets)
        self.sent += octets


class Manager:
    """What systemd is to a service: a socket that takes its words."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "notify"
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(str(self.path))
        self._socket.setblocking(False)
        self.words: list[str] = []

    def hear(self) -> list[str]:
        with contextlib.suppress(BlockingIOError):
            while True:
                self.words += self._socket.recv(4096).decode().split("\n")
        return self.words

    def until(self, word: str) -> None:
        wait_until(lambda: any(one.startswith(word) for one in self.hear()), f"never told {word}, only {self.words}")


class Bench:
    """`sockets`: by the names of the buses. `said`: standard error of the runs that have ended."""

    def __init__(self, folder: Path, names: tuple[str, ...]) -> None:
        self.folder = folder
        self.sockets = {name: Socket(folder / name) for name in names}
        self.manager = Manager(folder)
        self.said = ""
        self.more: dict[str, str] = {}  # of the environment
        self._running: list[subprocess.Popen[str]] = []
        (folder / "sniff485.toml").write_text(
            "".join(
                f'[bus.{name}]\nport = {json.dumps(str(folder / name))}\nline = "19200,8E1"\nprotocol = "modbus-rtu"\n'
                for name in names
            )
            + '[box]\nfolder = "parts"\nkeep_free = "1MB"\n'
        )

    @property
    def page(self) -> Path:
        return self.folder / "run" / "site.sock"

    def environment(self) -> dict[str, str]:
        told = {"RUNTIME_DIRECTORY": str(self.folder / "run"), "NOTIFY_SOCKET": str(self.manager.path)}
        return {**os.environ, **told, "WATCHDOG_USEC": "60000000", "PYTHONPATH": str(ROOT), **self.more}

    def start(self, *words: str) -> subprocess.Popen[str]:
        """Start it; it records by then."""
        self.manager.hear()
        self.manager.words.clear()
        process = self.spawn([sys.executable, "-m", "sniff", "box", *words])
        self.manager.until("READY=1")
        return process

    def spawn(self, command: list[str]) -> subprocess.Popen[str]:
        self._running.append(
            subprocess.Popen(
                command, cwd=self.folder, env=self.environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                text=True, start_new_session=True,
            )
        )  # fmt: skip
        return self._running[-1]

    def end(self, process: subprocess.Popen[str], number: int = signal.SIGTERM) -> int:
        process.send_signal(number)
        self.said = rest_of(process)[1]
        return process.returncode

    def capture(self) -> int:
        (pid,) = capture_processes(self.folder)
        return pid

    def status(self) -> BoxStatus:
        self.manager.hear()  # its queue is short
        return page.ask(self.page)

    def bus(self, name: str) -> BusStatus:
        return next(bus for bus in self.status().buses if bus.name == name)

    def octets(self, bus: int) -> bytes:
        """What is in the parts, of a bus."""
        found = b""
        for _, part in parts(self.folder / "parts" / "site.mcap"):
            items = buses_of(part)[bus].items()
            found += b"".join(item.octets for item in items if isinstance(item, Chunk))
        return found

    def until_written(self) -> None:
        for number, one in enumerate(self.sockets.values()):
            wait_until(lambda number=number, one=one: self.octets(number) == one.sent, "not all is in the file")

    def close(self) -> None:
        for process in self._running:
            if process.poll() is None:
                process.kill()
                process.communicate()
        for pid in capture_processes(self.folder):
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        for one in self.sockets.values():
            one.unplug()


@contextlib.contextmanager
def bench(folder: Path, *names: str) -> Iterator[Bench]:
    made = Bench(folder, names)
    try:
        yield made
    finally:
        made.close()
