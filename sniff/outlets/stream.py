"""Lines to standard output or into a file, by a thread that may hang without harm.

A file is bounded: at `MOST_SIZE` it becomes FILE.1, and a new one begins.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Callable

from sniff.outlet_settings import FileSettings, SettingsError
from sniff.outlets.outlet import Outlet
from sniff.outlets.told import Told

STANDARD_OUTPUT = "-"
MOST_SIZE = 256 << 20
"""Octets of a file; with the one before it it takes twice as much."""

TAKEN_AT_ONCE = 1024


class StreamOutlet(Outlet):
    """`line_of`: the line of a thing without its end, None where it has none. Raises SettingsError for a file that
    cannot be written to."""

    def __init__(
        self,
        name: str,
        settings: FileSettings,
        line_of: Callable[[Told], str | None],
        complain: Callable[[str], None],
        most_size: int = MOST_SIZE,
    ) -> None:
        super().__init__(name, complain, int(settings.every * 1e9))
        self._line_of = line_of
        self._path = settings.file
        self.where = "standard output" if settings.file == STANDARD_OUTPUT else settings.file
        self._most_size = most_size
        self._size = 0
        self._descriptor = self._open() if self._path != STANDARD_OUTPUT else 1

    def _open(self) -> int:
        """The file, opened to add to it; a pipe with a name is opened without waiting for its reader."""
        try:
            pipe = stat.S_ISFIFO(os.stat(self._path).st_mode)
        except OSError:
            pipe = False
        try:
            descriptor = os.open(self._path, os.O_RDWR if pipe else os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
        except OSError as error:
            raise SettingsError(f"{self._path}: {error.strerror}") from None
        self._size = 0 if pipe else os.fstat(descriptor).st_size
        return descriptor

    def _run(self) -> None:
        try:
            while True:
                told = self._take(TAKEN_AT_ONCE, None)
                if not told and self._closing:
                    return
                lines = [line for line in map(self._line_of, told) if line is not None]
                if not self._write(lines):
                    return
        finally:
            if self._path != STANDARD_OUTPUT:
                os.close(self._descriptor)

    def _write(self, lines: list[str]) -> bool:
        """Write lines; False where nobody reads them any more."""
        octets = "".join(f"{line}\n" for line in lines).encode("utf-8", "replace")
        try:
            while octets:
                octets = octets[self._write_some(octets) :]
        except OSError as error:
            self.dropped += len(lines)
            self._fare(f"{self._path}: {error.strerror}")
            gone = isinstance(error, BrokenPipeError)
            if gone:
                self._discard()
            return not gone
        self.sent += len(lines)
        if lines:
            self._fare("")
        return True

    def _write_some(self, octets: bytes) -> int:
        if self._size and self._size + len(octets) > self._most_size and self._path != STANDARD_OUTPUT:
            self._begin_anew()
        written = os.write(self._descriptor, octets)
        self._size += written
        return written

    def _begin_anew(self) -> None:
        """The file is full: it becomes the one before."""
        if not stat.S_ISREG(os.fstat(self._descriptor).st_mode):
            self._size = 0
            return
        if self._is_there():
            os.replace(self._path, f"{self._path}.1")
        descriptor = os.open(self._path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
        os.close(self._descriptor)  # not before: its number may be another file's at once
        self._descriptor = descriptor
        self._size = os.fstat(descriptor).st_size

    def _is_there(self) -> bool:
        """Whether the file is still the one of that name, and nobody has moved it away."""
        try:
            return os.path.samestat(os.stat(self._path), os.fstat(self._descriptor))
        except FileNotFoundError:
            return False

    def _discard(self) -> None:
        """Nobody reads any more: what is told from now on is counted."""
        while True:
            told = self._take(TAKEN_AT_ONCE, None)
            self.dropped += len(told)
            if not told and self._closing:
                return
