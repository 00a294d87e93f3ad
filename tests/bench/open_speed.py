"""The terminal UI on a long capture, as a user meets it: `sniff485 open` on a pseudo-terminal, keys in, screens out.

    python -m tests.bench.open_speed [FRAMES …]       seconds and octets, of each length (1000000)

A screen counts as there when the words that are waited for have come out of the terminal. Times of keys are from the
key to the words, those of filters until everything was searched. The two sizes, 80×24 and 200×60, are taken in turn.
Everything is written to a recording first, a million frames at a time.
"""

from __future__ import annotations

import fcntl
import os
import pty
import re
import select
import signal
import struct
import sys
import tempfile
import termios
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from dissectors.columns import Reads
from sniff.engine.session import Session
from tests.bench import bulk_files, bulk_mstp

SIZES = ((80, 24), (200, 60))
MILLION = 1_000_000
PATIENCE = 900.0
_ESCAPE = re.compile(rb"\x1b(?:\[[0-9;?<>=]*[A-Za-z]|\][^\x07\x1b]*(?:\x07|\x1b\\)|[PX^_][^\x1b]*\x1b\\|[()#].|.)")
FILTERS = ("dst == 3", 'kind contains "read"', 'verdict == "no answer"', "latency_ms > 30")
ROUNDS = 2
WANTED = {
    "first screen": "1 s",
    "jump": "0.016 s computed",
    **dict.fromkeys(FILTERS, "0.050 s computed"),
    "octets a row": "120",
}
"""What is to be reached with ten million rows; `octets a row`: of memory, of the whole process."""


def capture_file(folder: Path, frames: int) -> Path:
    """An MS/TP recording of about so many frames, made a million at a time."""
    parts, end = [], 0
    for number in range(max(1, frames // MILLION)):
        part = bulk_mstp.reads(min(frames, MILLION), seed=number + 1)
        times = part.times + (end - int(part.times[0]) if number else 0)
        end = int(times[-1]) + 20 * bulk_mstp.MS
        parts.append((part.octets, times, part.lengths))
    octets, times, lengths = (np.concatenate(column) for column in zip(*parts, strict=True))
    path = folder / f"{frames}.mcap"
    session = Session("/dev/ttyUSB0", bulk_mstp.LINE, "mstp", bulk_mstp.BASE)
    bulk_files.write_mcap(path, Reads(octets, times, lengths, np.zeros(len(lengths), bool)), session)
    return path


class Screen:
    """A program on a pseudo-terminal. `said`: what came out since the last key, without escapes."""

    def __init__(self, command: list[str], size: tuple[int, int]) -> None:
        self.began = time.perf_counter()
        self.pid, self._terminal = pty.fork()
        if not self.pid:
            os.environ.update(TERM="xterm-256color", TZ="UTC", COLUMNS=str(size[0]), LINES=str(size[1]))
            os.execv(command[0], command)
        fcntl.ioctl(self._terminal, termios.TIOCSWINSZ, struct.pack("HHHH", size[1], size[0], 0, 0))
        self.said = b""

    def keys(self, text: str) -> None:
        """Press keys."""
        self.began, self.said = time.perf_counter(), b""
        os.write(self._terminal, text.encode())

    def wait(self, words: str, patience: float = PATIENCE) -> float:
        """Seconds from the last key, or from the start, until a pattern came out. Raises TimeoutError."""
        wanted, raw = re.compile(words.encode()), b""
        while not wanted.search(self.said):
            left = self.began + patience - time.perf_counter()
            if left <= 0:
                raise TimeoutError(f"{words!r} did not come; {self.said[-400:]!r}")
            if select.select([self._terminal], [], [], min(left, 1.0))[0]:
                raw += os.read(self._terminal, 1 << 16)
                self.said = _ESCAPE.sub(b"", raw)
        return time.perf_counter() - self.began

    def pressed(self, keys: str, words: str) -> tuple[float, float]:
        """Seconds from the keys to the words, and those that the thread with the screen computed meanwhile."""
        before = self.computed()
        self.keys(keys)
        return self.wait(words), self.computed() - before

    def computed(self) -> float:
        """Seconds that the thread with the screen ran on a processor."""
        return int(Path(f"/proc/{self.pid}/schedstat").read_text("ascii").split()[0]) / 1e9

    def asked(self, key: str, words: str, text: str) -> None:
        """Press a key that asks for something, and type it."""
        self.pressed(key, words)
        self.drain(0.3)
        self.keys(text)
        self.drain(1.0)

    def cpu(self) -> float:
        """Seconds of processors that it took."""
        fields = Path(f"/proc/{self.pid}/stat").read_text("ascii").rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def drain(self, seconds: float) -> None:
        """Read what comes for some time."""
        until = time.perf_counter() + seconds
        while (left := until - time.perf_counter()) > 0:
            if select.select([self._terminal], [], [], left)[0]:
                os.read(self._terminal, 1 << 16)

    def memory(self, what: str = "VmHWM") -> int:
        """Octets of memory, the most that it ever had."""
        found = re.search(rf"{what}:\s+(\d+) kB", Path(f"/proc/{self.pid}/status").read_text("ascii"))
        return int(found[1]) * 1024 if found else 0

    def close(self) -> None:
        """End it."""
        os.kill(self.pid, signal.SIGTERM)
        os.waitpid(self.pid, 0)
        os.close(self._terminal)


@contextmanager
def opened(path: Path, size: tuple[int, int]) -> Iterator[Screen]:
    """`sniff485 open` on a file."""
    screen = Screen([str(Path(sys.executable).parent / "sniff485"), "open", str(path)], size)
    try:
        yield screen
    finally:
        screen.close()


def measure(path: Path, size: tuple[int, int], last: int) -> dict[str, tuple[float, float]]:
    """What a user waits for: seconds, and those that the thread with the screen computed; last the memory, MB."""
    took: dict[str, tuple[float, float]] = {}
    with opened(path, size) as screen:
        opened_at = screen.began
        first = screen.wait(r"10:00:00\.\d{3}")
        took["first screen"] = first, screen.computed()
        screen.drain(0.3)
        took["key while reading"] = screen.pressed("j", r">\s+2\s")
        took["End while reading"] = screen.pressed("G", r">\s+\d{4,}\s")
        screen.wait(r"% judged|FILE\s+[\d.]+ [kMG]B")
        took["all read"] = time.perf_counter() - opened_at, screen.computed()
        screen.drain(1.0)
        took["Home"] = screen.pressed("g", r">\s+1\s")
        took["End"] = screen.pressed("G", rf">\s+{last}\s")
        took["page up"] = screen.pressed("\x1b[5~", r">\s+\d+\s")
        screen.asked(":", r"10:32:05", str(last // 2))
        took["jump"] = screen.pressed("\r", rf">\s+{last // 2}\s")
        for text in FILTERS:
            screen.asked("/", "valid|empty", text)
            took[text] = screen.pressed("\r", r"of \d+ rows · esc")
            screen.keys("\x1b")
            screen.drain(1.0)
        took["megabytes; all threads computed"] = screen.memory() / 1e6, screen.cpu()
        took["octets a row"] = screen.memory() / last, 0.0
    return took


def main(lengths: list[int]) -> None:
    """Print a table of each length."""
    for frames in lengths:
        with tempfile.TemporaryDirectory(prefix="tui-bench-") as folder:
            path = capture_file(Path(folder), frames)
            for line in lines(path):
                print(line, flush=True)


def lines(path: Path) -> Iterator[str]:
    """The table of one file: the sizes in turn, twice; the best of each."""
    from sniff import formats
    from sniff.analysis.summary import Summary
    from sniff.bus.offline import survey

    capture = formats.read(path)
    summary = Summary(capture.session.line)
    survey(capture, capture.session, summary)
    best: dict[tuple[int, int], dict[str, tuple[float, float]]] = {}
    for size in SIZES * ROUNDS:
        for name, value in measure(path, size, summary.frames).items():
            known = best.setdefault(size, {})
            known[name] = min(value, known.get(name, value))
    yield f"{summary.frames} frames, {path.stat().st_size / 1e6:.1f} MB, load of the machine {os.getloadavg()[0]:.1f}"
    sizes = "".join(f"{f'{width}x{height}':>18}" for width, height in SIZES)
    yield f"{'seconds, and of computing':36}{sizes}  wanted"
    for name in best[SIZES[0]]:
        values = (best[size][name] for size in SIZES)
        columns = "".join(f"{waited:10.3f}{computed:8.3f}" for waited, computed in values)
        yield f"{name:36}{columns}  {WANTED.get(name, '')}".rstrip()


if __name__ == "__main__":
    main([int(one) for one in sys.argv[1:]] or [MILLION])
