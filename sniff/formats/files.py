"""Opening capture files: errors in words, and new files that take their name only when they are whole."""

from __future__ import annotations

import contextlib
import errno
import os
import stat
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from io import BufferedReader, FileIO
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from sniff.engine.capture import CaptureError

if TYPE_CHECKING:
    from _typeshed import WriteableBuffer as Buffer

WAYS_OUT = {
    FileNotFoundError: "no such file",
    IsADirectoryError: "a directory, not a capture; name a file in it",
    PermissionError: "permission denied; ask its owner, or copy it",
    FileExistsError: "exists already; choose another name or remove it",
}

BY_NUMBER = {
    errno.ENOSPC: "no space left on the disk; make room, or write elsewhere",
    errno.EDQUOT: "the quota of this user is used up; make room, or write elsewhere",
    errno.EROFS: "the file system is read-only; write elsewhere",
}


def explain(path: str | Path, error: OSError) -> CaptureError:
    """An error of the operating system as one line with the way out."""
    for kind, words in WAYS_OUT.items():
        if isinstance(error, kind):
            return CaptureError(f"{path}: {words}")
    return CaptureError(f"{path}: {BY_NUMBER.get(error.errno or 0) or error.strerror or error}")


def open_capture(path: Path) -> BinaryIO:
    """Open a file for reading, as far as it goes now: what somebody appends meanwhile comes at the next opening.

    What is no file is not opened: a pipe would be waited for, a port would move its control lines, and a device may
    have no end. Raises CaptureError.
    """
    try:
        mode = os.stat(path).st_mode
        if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
            raise CaptureError(f"{path}: {_what(mode)}")
        stream = _AsOfNow(path)
        watch = _WATCH.get()
        if watch is not None:
            watch(stream)
        return BufferedReader(stream)
    except OSError as error:
        raise explain(path, error) from None
    except ValueError:  # a name with NUL in it
        raise CaptureError(f"{str(path)!r}: no file can have that name") from None


_WATCH: ContextVar[Callable[[FileIO], None] | None] = ContextVar("watch", default=None)


@contextlib.contextmanager
def watched(watch: Callable[[FileIO], None]) -> Iterator[None]:
    """Meanwhile each file that is opened here is shown, so that somebody can tell how far it has been read."""
    token = _WATCH.set(watch)
    try:
        yield
    finally:
        _WATCH.reset(token)


def _what(mode: int) -> str:
    if stat.S_ISFIFO(mode):
        return "not a regular file but a pipe; read it as standard input: `- < PIPE`"
    if stat.S_ISCHR(mode):
        return "not a regular file but a device; a serial port is listened to with `sniff485 live` or `record`"
    return "not a regular file; copy it to one first"


class _AsOfNow(FileIO):
    """A file that ends where it ended when it was opened."""

    def __init__(self, path: Path) -> None:
        super().__init__(path, "rb")
        self._end = os.fstat(self.fileno()).st_size

    def readinto(self, buffer: Buffer) -> int:
        view = memoryview(buffer).cast("B")
        left = max(0, self._end - self.tell())
        return super().readinto(view[:left]) or 0

    def readall(self) -> bytes:
        return super().read(max(0, self._end - self.tell())) or b""


class NewFile:
    """A file written beside its final name and renamed on `close`, so that a half-written one never replaces a good
    one, and a file can be converted onto itself. What is no regular file (a pipe, /dev/stdout) is written directly.

    Everything raises CaptureError.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._target = Path(os.path.realpath(path))
        self._temporary: Path | None = self._target.with_name(f".{self._target.name}.{os.getpid()}.tmp")
        try:
            if self._target.is_dir():
                raise IsADirectoryError
            if self._target.exists() and not stat.S_ISREG(self._target.stat().st_mode):
                self._temporary = None
            self.stream: BinaryIO = open(self._temporary or self._target, "wb")  # noqa: SIM115
        except FileNotFoundError:
            raise CaptureError(f"{path}: no such directory; create {self._target.parent} first") from None
        except OSError as error:
            raise explain(path, error) from None

    def write(self, octets: bytes | memoryview) -> None:
        """Append; what cannot be written gives the file up."""
        try:
            self.stream.write(octets)
        except OSError as error:
            self.discard()
            raise explain(self.path, error) from None

    def close(self) -> None:
        """Write out and take the final name; again is harmless."""
        if self.stream.closed:
            return
        try:
            if self._temporary is not None:
                self.stream.flush()
                os.fsync(self.stream.fileno())  # the name must not be there before the octets are
            self.stream.close()
            if self._temporary is not None:
                os.replace(self._temporary, self._target)
        except OSError as error:
            self.discard()
            raise explain(self.path, error) from None

    def discard(self) -> None:
        """Give the file up; what had the name before stays."""
        with contextlib.suppress(OSError):
            self.stream.close()
        if self._temporary is not None:
            self._temporary.unlink(missing_ok=True)
