"""The index of what was read already: a file of SQLite beside the archive. A second run reads only what is new.

An entry is the result of one task, under the paths, sizes and times of its files and under the code that read them: a
new version of the program reads again what it reads by other code, and nothing else. Two runs at once do not harm it.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager
from functools import cache
from importlib import import_module
from pathlib import Path

import dissectors
import sniff
from dissectors import registry
from sniff.engine.capture import CaptureError
from sniff.fleet import codec
from sniff.fleet.archive import Task
from sniff.fleet.bus_day import BusDay

NAME = ".sniff485-fleet.sqlite"
"""Of the index in the archive's folder."""

VERSION = 1
"""Of its tables."""

PATIENCE = 30.0
"""Seconds that one run waits for another to write."""

_ROOMS = ("engine", "analysis", "recording", "formats", "fleet")
_TABLES = """
CREATE TABLE IF NOT EXISTS task (files TEXT, bus TEXT, code TEXT, days TEXT, PRIMARY KEY (files, bus));
CREATE TABLE IF NOT EXISTS said (name TEXT PRIMARY KEY, value TEXT);
"""


class Index:
    """An index that is open. Raises CaptureError where the file is none, or cannot be written."""

    def __init__(self, path: Path) -> None:
        self.path = path
        with self._reach() as base:
            version = base.execute("PRAGMA user_version").fetchone()[0]
            if version > VERSION:
                raise CaptureError(f"{path}: written by a newer sniff485; use that one, or another --index")
            base.executescript(_TABLES + f"PRAGMA user_version = {VERSION};")

    def get(self, task: Task) -> list[BusDay] | None:
        """What the same code found in the same files; None where nobody knows."""
        with self._reach() as base:
            found = base.execute(
                "SELECT code, days FROM task WHERE files = ? AND bus = ?", (_files(task), task.bus or "")
            ).fetchone()
        if found is None or found[0] != code_of(task.protocol):
            return None
        try:
            return codec.decode(found[1])
        except (ValueError, KeyError, TypeError):
            return None  # somebody else's, or damaged: it is read again

    def put(self, task: Task, days: list[BusDay]) -> None:
        """Keep what was found."""
        with self._reach() as base:
            base.execute(
                "INSERT OR REPLACE INTO task VALUES (?, ?, ?, ?)",
                (_files(task), task.bus or "", code_of(task.protocol), codec.encode(days)),
            )

    def forget_all_but(self, tasks: Iterable[Task]) -> None:
        """Let go of what stands for files that are gone, or that others have followed."""
        kept = {(_files(task), task.bus or "") for task in tasks}
        with self._reach() as base:
            there = base.execute("SELECT files, bus FROM task").fetchall()
            base.executemany("DELETE FROM task WHERE files = ? AND bus = ?", [one for one in there if one not in kept])

    def said_before(self) -> set[str] | None:
        """What the run before named as wrong; None where there was none."""
        with self._reach() as base:
            found = base.execute("SELECT value FROM said WHERE name = 'findings'").fetchone()
        return None if found is None else set(json.loads(found[0]))

    def say(self, findings: Iterable[str]) -> None:
        """Keep what this run names, for the next."""
        with self._reach() as base:
            value = json.dumps(sorted(findings))
            base.execute("INSERT OR REPLACE INTO said VALUES ('findings', ?)", (value,))

    @contextmanager
    def _reach(self) -> Iterator[sqlite3.Connection]:
        try:
            with closing(sqlite3.connect(self.path, timeout=PATIENCE)) as base, base:
                yield base
        except sqlite3.Error as error:
            raise CaptureError(f"{self.path}: the index cannot be used: {error}") from None


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
    try:
        own = import_module(registry.get(protocol).framer.__module__).__file__
    except (registry.UnknownProtocol, ImportError):
        return
    if own is not None and Path(own).parent != Path(dissectors.__file__).parent:
        yield from sorted(Path(own).parent.rglob("*.py"))
