"""Leftovers of earlier runs: a capture that still runs, parts that a power cut left open, files half written."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import threading
import time
from collections.abc import Callable
from pathlib import Path

from sniff.box.status import Recovered
from sniff.engine.capture import CaptureError
from sniff.recording.recovery import recover
from sniff.recording.rotation import parts
from sniff.recording.scan import MAGIC
from sniff.sources.ports import find_holders

PATIENCE = 45.0
"""Seconds for a capture to close its files: more than it gives a slow disk itself."""

LOOK_EVERY = 0.1


def cut_parts(path: Path) -> list[Path]:
    """Parts of a recording that do not end as a whole file does, oldest first; not those that somebody has open."""
    cut = [part for _, part in parts(path) if not _ends_whole(part)]
    held = find_holders([str(part) for part in cut])
    return [part for part in cut if not held.get(str(part))]


def _ends_whole(part: Path) -> bool:
    try:
        with part.open("rb") as stream:
            stream.seek(-len(MAGIC), os.SEEK_END)
            return stream.read() == MAGIC and part.stat().st_size > 2 * len(MAGIC)
    except OSError:
        return False


def remove_half_written(path: Path) -> None:
    """Remove what an interrupted recovery of a part left beside it."""
    with contextlib.suppress(OSError):
        for left in path.parent.glob(f".{path.stem}-*{path.suffix}.*.tmp"):
            with contextlib.suppress(OSError):
                left.unlink()


def close_part(part: Path, keep_free: int) -> Recovered:
    """Make a cut part whole, in its place; `keep_free`: octets of the disk that stay free meanwhile. Never raises."""
    try:
        size = part.stat().st_size
        if size == 0:
            part.unlink()
            return Recovered(part.name, "empty: nothing of it had reached the disk", False, "removed")
        if shutil.disk_usage(part.parent).free < size + keep_free:
            return Recovered(part.name, "cut", False, "no room on the disk to write it anew; it can be read as it is")
        return Recovered(part.name, recover(part, part).text, True)
    except (CaptureError, OSError) as error:
        return Recovered(part.name, "cut", False, str(error).removeprefix(f"{part}: "))


class Closing:
    """Closes cut parts one after the other beside everything else; `told` gets each when it is done."""

    def __init__(self, cut: list[Path], keep_free: int, told: Callable[[Recovered], None]) -> None:
        self._stopped = False
        self._thread = threading.Thread(target=self._run, args=(cut, keep_free, told), name="closing", daemon=True)
        self._thread.start()

    def _run(self, cut: list[Path], keep_free: int, told: Callable[[Recovered], None]) -> None:
        for part in cut:
            if self._stopped:
                return
            told(close_part(part, keep_free))

    @property
    def done(self) -> bool:
        """Whether all of them are."""
        return not self._thread.is_alive()

    def stop(self) -> None:
        """Begin no other."""
        self._stopped = True


# -- a capture that outlived its box -----------------------------------------------------------------------------


class CapturePid:
    """Remembers which capture process is this box's, in a file that no reboot survives."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def remember(self, pid: int) -> None:
        """It runs."""
        with contextlib.suppress(OSError):
            self._path.write_text(f"{pid} {_begun(pid)}\n")

    def forget(self) -> None:
        """It has ended."""
        self._path.unlink(missing_ok=True)

    def left_behind(self) -> int | None:
        """The capture process that outlived the box before this one."""
        try:
            pid, begun = map(int, self._path.read_text().split())
        except (OSError, ValueError):
            return None
        return pid if begun and _begun(pid) == begun else None

    def end(self, pid: int) -> str:
        """End it with its files closed, by force if need be; how, in words."""
        begun = _begun(pid)
        with contextlib.suppress(OSError):
            os.kill(pid, signal.SIGTERM)
        until = time.monotonic() + PATIENCE
        while begun and _begun(pid) == begun:
            if time.monotonic() > until:
                with contextlib.suppress(OSError):
                    os.kill(pid, signal.SIGKILL)
                return f"capture process {pid} of the box before did not end, and was killed"
            time.sleep(LOOK_EVERY)
        self.forget()
        return f"capture process {pid} of the box before went on without it; its file is closed now"


def _begun(pid: int) -> int:
    """When a process was begun (clock ticks since the machine was), 0 where it is not there, is ending, or the system
    does not tell. A number that was given to another process is another begin."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        return 0 if fields[0] in "ZX" else int(fields[19])
    except (OSError, ValueError, IndexError):
        return 0
