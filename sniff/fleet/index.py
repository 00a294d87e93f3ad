"""The index of what was read already: a file of SQLite beside the archive. A second run reads only what is new.

An entry is the result of one task, under the paths, sizes and times of its files and under the code that read them: a
new version of the program reads again what it reads by other code, and nothing else. Two runs at once do not harm it.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import astuple
from functools import cache
from importlib import import_module
from pathlib import Path

import dissectors
import sniff
from dissectors import registry
from sniff.engine.capture import CaptureError
from sniff.fleet import codec
from sniff.fleet.archive import Begin, FileState, Look, Task, look
from sniff.fleet.bus_day import BusDay

NAME = ".sniff485-fleet.sqlite"
"""Of the index in the archive's folder."""

VERSION = 1
"""Of its tables."""

FLUSHED_EVERY = 2.0
"""Seconds of work that are lost when a run is killed."""

PATIENCE = 30.0
"""Seconds that one run waits for another to write."""

_ROOMS = ("engine", "analysis", "recording", "formats")
_HERE = ("archive.py", "bus_day.py", "codec.py", "pieces.py", "reading.py")
"""What is read and kept depends on these; what is said of it, on the others."""

_TABLES = """
CREATE TABLE IF NOT EXISTS task (files TEXT, bus TEXT, code TEXT, days TEXT, PRIMARY KEY (files, bus));
CREATE TABLE IF NOT EXISTS file (path TEXT PRIMARY KEY, size INTEGER, changed INTEGER, code TEXT, begins TEXT);
CREATE TABLE IF NOT EXISTS said (name TEXT PRIMARY KEY, value TEXT);
"""


class Index:
    """An index that is open. Raises CaptureError where the file is none, or cannot be written."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._new: list[tuple[str, str, str, str]] = []
        self._flushed = time.monotonic()
        self._looks: dict[FileState, str] = {}
        self._looked: dict[FileState, tuple[Begin, ...] | str] = {}
        with self._reach() as base:
            version = base.execute("PRAGMA user_version").fetchone()[0]
            if version > VERSION:
                raise CaptureError(f"{path}: written by a newer sniff485; use that one, or another --index")
            base.executescript(_TABLES + f"PRAGMA user_version = {VERSION};")

    def known(self, tasks: Iterable[Task]) -> Iterator[tuple[Task, list[BusDay] | None]]:
        """Each task with what the same code found in the same files; None where nobody knows."""
        with self._reach() as base:
            for task in tasks:
                found = base.execute(
                    "SELECT code, days FROM task WHERE files = ? AND bus = ?", (_files(task), _storable(task.bus or ""))
                ).fetchone()
                same = found is not None and found[0] == code_of(task.protocol)
                yield task, _days(found[1]) if same else None

    def put(self, task: Task, days: list[BusDay]) -> None:
        """Keep what was found; it is in the file after `flush`, or by itself after some seconds."""
        self._new.append((_files(task), _storable(task.bus or ""), code_of(task.protocol), codec.encode(days)))
        if time.monotonic() - self._flushed > FLUSHED_EVERY:
            self.flush()

    def flush(self) -> None:
        """Write what waits."""
        with self._reach() as base:
            base.executemany("INSERT OR REPLACE INTO task VALUES (?, ?, ?, ?)", self._new)
        self._new = []
        self._flushed = time.monotonic()

    def look(self) -> Look:
        """What `archive.look` says of a file, read from the index where that is possible; what was new is kept when all
        files were looked at (`keep_looks`)."""
        with self._reach() as base:
            rows = base.execute(
                "SELECT path, size, changed, begins FROM file WHERE code = ?", (code_of(""),)
            ).fetchall()
        self._looks = {FileState(*row[:3]): row[3] for row in rows}
        self._looked = {}

        def known_or_new(file: FileState) -> tuple[Begin, ...] | str:
            known = _begins(self._looks.get(file, ""))
            if known is not None:
                return known
            self._looked[file] = look(file)
            return self._looked[file]

        return known_or_new

    def keep_looks(self) -> None:
        """Keep what was new."""
        rows = [
            (_storable(file.path), file.size, file.changed, code_of(""), json.dumps([astuple(one) for one in told]))
            for file, told in self._looked.items()
            if not isinstance(told, str)  # it may be readable another time: permissions, a medium that was away
        ]
        with self._reach() as base:
            base.executemany("INSERT OR REPLACE INTO file VALUES (?, ?, ?, ?, ?)", rows)

    def forget_all_but(self, tasks: Sequence[Task]) -> None:
        """Let go of what stands for files that are gone, or that others have followed."""
        kept = {(_files(task), _storable(task.bus or "")) for task in tasks}
        paths = {_storable(file.path) for task in tasks for file in task.files}
        with self._reach() as base:
            there = base.execute("SELECT files, bus FROM task").fetchall()
            base.executemany("DELETE FROM task WHERE files = ? AND bus = ?", [one for one in there if one not in kept])
            files = base.execute("SELECT path FROM file").fetchall()
            base.executemany("DELETE FROM file WHERE path = ?", [one for one in files if one[0] not in paths])

    def said_before(self, folders: Iterable[str]) -> set[str] | None:
        """What the run before over the same folders named as wrong; None where there was none."""
        with self._reach() as base:
            found = base.execute("SELECT value FROM said WHERE name = ?", (_asked(folders),)).fetchone()
        try:
            return None if found is None else {str(one) for one in json.loads(found[0])}
        except (ValueError, TypeError):
            return None  # damaged

    def say(self, folders: Iterable[str], findings: Iterable[str]) -> None:
        """Keep what this run names, for the next."""
        with self._reach() as base:
            value = json.dumps(sorted(findings))
            base.execute("INSERT OR REPLACE INTO said VALUES (?, ?)", (_asked(folders), value))

    @contextmanager
    def _reach(self) -> Iterator[sqlite3.Connection]:
        try:
            with closing(sqlite3.connect(self.path, timeout=PATIENCE)) as base, base:
                yield base
        except sqlite3.Error as error:
            raise CaptureError(f"{self.path}: the index cannot be used: {error}") from None


def _asked(folders: Iterable[str]) -> str:
    """What a run was about: a run over less names less, and nothing is gone for that."""
    return json.dumps(["findings", *sorted({str(Path(folder).absolute()) for folder in folders})])


def _days(text: str) -> list[BusDay] | None:
    try:
        return codec.decode(text)
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return None  # somebody else's, or damaged: it is read again


def _begins(text: str) -> tuple[Begin, ...] | None:
    try:
        if not text:
            return None
        return tuple(Begin(bus, protocol, part, tuple(of)) for bus, protocol, part, of in json.loads(text))
    except (ValueError, TypeError, RecursionError):
        return None


def _storable(name: str) -> str:
    """A name as the index can hold it: that of a file may be no text. Such a file is looked at every time."""
    return name.encode("utf-8", "backslashreplace").decode()


def _files(task: Task) -> str:
    return json.dumps([task.site, *([file.path, file.size, file.changed] for file in task.files)])


@cache
def code_of(protocol: str) -> str:
    """A mark of the code by which captures of a protocol are read and judged."""
    mark = hashlib.sha256()
    for path in _sources(protocol):
        mark.update(path.name.encode() + b"\0" + path.read_bytes())
    return mark.hexdigest()[:24]


def _sources(protocol: str) -> Iterator[Path]:
    yield from sorted(Path(dissectors.__file__).parent.glob("*.py"))
    for room in _ROOMS:
        yield from sorted(Path(sniff.__file__).parent.joinpath(room).glob("*.py"))
    yield from (Path(__file__).with_name(name) for name in _HERE)
    try:
        own = import_module(registry.get(protocol).framer.__module__).__file__
    except (registry.UnknownProtocol, ImportError):
        return
    if own is not None and Path(own).parent != Path(dissectors.__file__).parent:
        yield from sorted(Path(own).parent.rglob("*.py"))
