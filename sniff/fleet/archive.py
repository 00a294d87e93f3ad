"""An archive: captures found below folders, and the parts of recordings grouped into tasks.

A task is what one worker reads at a time: one capture, or the parts of one recording that began on one day. Only the
beginning of each file is read here, and none that the index knows.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from glob import glob, has_magic
from pathlib import Path

from sniff.analysis.told_protocol import detected
from sniff.engine.capture import Capture, CaptureError
from sniff.formats import read
from sniff.formats.files import open_capture
from sniff.formats.mark_file import unmarked
from sniff.formats.several_buses import buses_in
from sniff.formats.table import suffixes
from sniff.recording import scan
from sniff.recording.reader import McapCapture
from sniff.recording.rotated import joined

NS_PER_S = 1_000_000_000
NS_PER_DAY = 86_400 * NS_PER_S
STILL_WRITTEN = 120 * NS_PER_S
"""A recording that was not written to for so long, and has no end, was cut off."""


@dataclass(frozen=True, slots=True)
class FileState:
    """A file as it was found. `size`: octets; `changed`: ns since the epoch."""

    path: str
    size: int
    changed: int


@dataclass(frozen=True, slots=True)
class Window:
    """From when (with it) until when (without it), ns; None: from the begin, to the end."""

    begin: int | None
    end: int | None


@dataclass(frozen=True, slots=True)
class Task:
    """What is read in one go: files that follow one another, of one site and one `bus` of several in them (None: the
    only one). `protocol`: a registry name, "" where it is not known yet or cannot be. `window`: of a piece of a task
    that is too large (pieces.py)."""

    site: str
    files: tuple[FileState, ...]
    protocol: str = ""
    bus: str | None = None
    window: Window | None = None

    @property
    def whole(self) -> Task:
        """What a piece is a piece of."""
        return replace(self, window=None)

    @property
    def name(self) -> str:
        """For people."""
        more = f" and {len(self.files) - 1} more" if len(self.files) > 1 else ""
        return f"{self.files[0].path}{more}"

    @property
    def size(self) -> int:
        """Octets of all files."""
        return sum(file.size for file in self.files)


@dataclass(frozen=True, slots=True)
class Begin:
    """What the begin of a file tells of one bus in it. `bus`: its name, None for the only one; `protocol`: as in Task;
    `part`: of a recording, from 1; `recording`: what parts that are read together have in common, empty for others."""

    bus: str | None
    protocol: str
    part: int = 1
    recording: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Unreadable:
    """A file that is none of ours, or damaged at its very begin; `why` in words."""

    file: FileState
    site: str
    why: str


def files_below(words: Iterable[str]) -> list[tuple[str, FileState]]:
    """Site and state of every capture, and of folders that do not let one look: `words` are folders, files and
    patterns. The site is the first folder below the named one, "" for files that lie in it. Raises CaptureError for a
    word that names nothing."""
    found: dict[str, tuple[str, FileState]] = {}
    for word in words:
        is_pattern = has_magic(word) and not os.path.exists(word)  # "plant [2]" may be the name of a folder
        paths = sorted(glob(word, recursive=True)) if is_pattern else [word]
        if not any(os.path.exists(path) for path in paths):
            raise CaptureError(f"{word}: no such file or folder")
        for path in paths:
            for site, each in _captures(Path(path)):
                state = _state(each)
                if state is not None:
                    found.setdefault(os.path.realpath(each), (site, state))
    return sorted(found.values(), key=lambda one: one[1].path)


def _captures(path: Path) -> Iterable[tuple[str, Path]]:
    if path.is_file():
        yield path.parent.name, path
        return
    closed: list[OSError] = []
    for folder, names, files in os.walk(path, onerror=closed.append):
        names.sort()
        inside = Path(folder).relative_to(path).parts
        for name in sorted(files):
            if name.lower().endswith(suffixes()) and not name.endswith(".expect.txt"):
                yield (inside[0] if inside else ""), Path(folder, name)
    for error in closed:  # what is in there is not passed over in silence
        inside = Path(error.filename).relative_to(path).parts
        yield (inside[0] if inside else ""), Path(error.filename)


def _state(path: Path) -> FileState | None:
    try:
        status = path.stat()
    except OSError:  # it went away meanwhile
        return None
    return FileState(str(path), status.st_size, status.st_mtime_ns)


def is_being_written(file: FileState, now: int) -> bool:
    """Whether a recording has no end yet and changed lately (`now`: ns since the epoch): its turn comes when it is
    closed."""
    if not file.path.lower().endswith(".mcap") or now - file.changed > STILL_WRITTEN:
        return False
    try:
        with open_capture(Path(file.path)) as stream:
            begins = stream.read(len(scan.MAGIC)) == scan.MAGIC
            stream.seek(max(0, file.size - len(scan.MAGIC)))
            return begins and stream.read() != scan.MAGIC
    except (CaptureError, OSError):
        return False


Look = Callable[[FileState], "tuple[Begin, ...] | str"]
"""What is known of a file: of each bus in it, or why it cannot be read."""


def look(file: FileState) -> tuple[Begin, ...] | str:
    """Read the begin of a file."""
    if os.path.isdir(file.path):
        return "a folder that cannot be looked into"
    try:
        capture = read(file.path)
    except CaptureError as error:
        return _why(error, file)
    buses = [_told(unmarked(bus)[0]) for bus in buses_in(capture)]
    return tuple(
        Begin(bus.session.bus if len(buses) > 1 else None, bus.session.protocol, _part(bus), _recording(bus, file))
        for bus in buses
    )


def tasks_of(
    found: Sequence[tuple[str, FileState]], since: int | None = None, look: Look = look
) -> tuple[list[Task], list[Unreadable]]:
    """Group files into tasks, in the order of their names. `since`: ns; files that ended before are left out.

    `look`: gives what is known of each file; those that cannot be read are given beside.
    """
    groups: dict[tuple[str, ...], list[tuple[int, FileState, Begin]]] = {}
    unreadable = []
    for site, file in found:
        if since is not None and file.changed < since:
            continue
        begins = look(file)
        if isinstance(begins, str):
            unreadable.append(Unreadable(file, site, begins))
            continue
        for one in begins:
            key = (site, one.bus or "", *(one.recording or (file.path,)))
            groups.setdefault(key, []).append((one.part, file, one))
    tasks = []
    for (site, *_), members in groups.items():
        members.sort(key=lambda one: (one[0], one[1].path))
        first = members[0][2]
        tasks.append(Task(site, tuple(file for _, file, _ in members), first.protocol, first.bus))
    return sorted(tasks, key=lambda task: (task.files[0].path, task.bus or "")), unreadable


def opened(task: Task) -> list[Capture]:
    """The captures of a task, parts of a recording as one. Raises CaptureError."""
    return [capture for _, capture in joined([(file.path, _bus_of(task, read(file.path))) for file in task.files])]


def _bus_of(task: Task, capture: Capture) -> Capture:
    """The bus that a task is about."""
    return next(_told(unmarked(bus)[0]) for bus in buses_in(capture) if task.bus in (None, bus.session.bus))


def _told(bus: Capture) -> Capture:
    """The bus, of which its octets say what its file does not."""
    bus.session = detected(bus.session)
    return bus


def _why(error: CaptureError, file: FileState) -> str:
    """Without the file's name, which stands before it anyhow."""
    return re.sub(rf"^{re.escape(file.path)}(:\d+)*: ", "", str(error))


def _part(capture: Capture) -> int:
    return capture.part if isinstance(capture, McapCapture) else 1


def _recording(capture: Capture, file: FileState) -> tuple[str, ...]:
    """What the parts of one recording that are read together have in common: its port, its begin, and the day on which
    their first reads came."""
    session = capture.session
    is_part = isinstance(capture, McapCapture) and (capture.part > 1 or Path(file.path).stem.endswith("-0001"))
    if not (session.started and is_part and session.sample):
        return ()
    return session.port, str(session.started), str(session.sample[0].time // NS_PER_DAY)
